"""Averages over runs in sheared cells: means and errors over seeds, and whether they have settled.

A mean has settled if in each run blocks are long enough to be independent, as far as the values
tell (`observe.averages`). One that has not may still drift, and its error is too small: rows say
so and figures show it as an open circle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array, as_float
from stokesfibers.experiments.base import Row
from stokesfibers.experiments.sheared_cells import CellRun, dilute_stress, stresses
from stokesfibers.observe.averages import block_average

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = {"viscosity": r"$\eta_{\mathrm{sp}}$", "n1": r"$N_1/\mu\dot\gamma$"}
"""The stresses that rows and figures give, with their symbols."""
_AFTER = 0.5  # of a run: averages are over the rest
_OPEN = {"color": "none", "markeredgewidth": 0.8, "markerfacecolor": "white"}


@dataclass(frozen=True)
class Averages:
    """Stresses of runs that differ by their seed alone, (3,) each: viscosity, N_1, N_2.

    Attributes
    ----------
    mean
        Over the second half of each run and over seeds.
    error
        One standard error: the larger of what the blocks of each run tell and what the scatter of
        the seeds tells.
    settled
        Whether the mean of each run has settled.
    start
        At the start of the first run.
    alone
        There, of straight fibers that do not feel each other.
    """

    mean: Array
    error: Array
    settled: np.ndarray
    start: Array
    alone: Array

    @classmethod
    def of(cls, trees: Sequence[xr.DataTree], runs: Sequence[CellRun]) -> Averages:
        """Return the averages of finished runs."""
        found = []
        for tree, run in zip(trees, runs, strict=True):
            time, values = stresses(tree, run)
            late = time >= _AFTER * run.until - 1e-9
            found.append([block_average(time[late], one[late]) for one in values])
        means = np.array([[one.mean for one in own] for own in found])
        errors = np.array([[one.error for one in own] for own in found])
        count = len(runs)
        within = np.sqrt(np.square(errors).sum(axis=0)) / count
        scatter = np.std(means, axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.zeros(3)
        return cls(
            mean=as_float(means.mean(axis=0)),
            error=np.maximum(within, scatter),
            settled=np.all([[one.settled for one in own] for own in found], axis=0, keepdims=True)[
                0
            ],
            start=stresses(trees[0], runs[0])[1][:, 0],
            alone=dilute_stress(trees[0], runs[0], np.zeros(1))[:, 0],
        )


def variables(found: Sequence[Averages], axes: Mapping[str, int]) -> dict[str, Any]:
    """Return the variables of a dataset from averages along `axes`, the last one fastest."""
    names, shape = (*axes, "quantity"), (*axes.values(), -1)
    return {
        f.name: (names, np.stack([getattr(one, f.name) for one in found]).reshape(shape))
        for f in fields(Averages)
    }


def note(data: xr.Dataset, one: xr.Dataset, unit: float) -> str:
    """Return how sure the mean of one quantity is: its error over `unit`, and of which runs.

    Parameters
    ----------
    data
        The study.
    one
        Its part for one quantity and one kind of runs.
    unit
        What the mean is shown over.
    """
    seeds, count = data.attrs["seeds"], data.attrs["count"]
    runs = f"{seeds} seed{'s' if seeds > 1 else ''} of {count} fibers"
    bar = f"+- {float(one['error']) / unit:.2g}"
    return f"{bar}, {runs}." if bool(one["settled"]) else f"{bar} or more, {runs}. Not settled."


def unsettled(data: xr.Dataset) -> Row:
    """Return the row that counts the means which have not settled."""
    settled = data["settled"].sel(quantity=list(SHOWN))
    told = "Blocks are not independent, or the mean drifts; open circles. Longer runs settle them."
    return Row(f"means not settled, of {settled.size}", int((~settled).sum()), note=told)


def draw(ax: Axes, x: np.ndarray, data: xr.Dataset, **look: Any) -> None:
    """Draw mean and error of one quantity at `x`, open where the mean has not settled.

    Parameters
    ----------
    ax, x
        Where.
    data
        Of one axis; mean and error are over the unit they are shown in.
    look
        Label, colour and line of the points.
    """
    mean, settled = data["mean"].to_numpy(), data["settled"].to_numpy()
    look = {"fmt": "o", "markersize": 3.5, "capsize": 2.0, "linewidth": 0.8, **look}
    ax.errorbar(x, mean, data["error"], **look)
    if not settled.all():
        edge = {"marker": "o", "markersize": 3.5, "linestyle": "none", "zorder": 3}
        edge |= _OPEN | {"markeredgecolor": look["color"]}
        ax.plot(x[~settled], mean[~settled], label="_open", **edge)


def legend(ax: Axes, data: xr.Dataset) -> None:
    """Draw the legend; it says what open circles are if there are any."""
    from stokesfibers.plot.style import INK

    if not bool(data["settled"].sel(quantity=list(SHOWN)).all()):
        ax.plot([], [], "o", markersize=3.5, label="not settled", markeredgecolor=INK, **_OPEN)
    ax.legend(fontsize=6.5)
