"""Filaments close to each other: errors of the induced velocity, and iterations for the tensions.

Two crossing filaments of given shape and tension are brought together from one length to d_0. The
velocity that one induces at the nodes of the other, (17) and (18), is held against adaptive
quadrature of (7) and (8): with the plain trapezoidal rule and with the refinement of
Section 3.3.3. From 2 d_0 down that section blends in the centreline's own velocity, another model;
there the refinement is measured without the blend. The tensions of filaments in shear are solved
by the sweeps (39) and by GMRES, down to half of d_0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.experiments import close_pair_rows as rows
from stokesfibers.experiments import close_pair_tensions as tensions
from stokesfibers.experiments import close_pair_velocity as velocity
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.close_pair_velocity import blend_distance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COUNTS = (1, 2, 5, 10, 20, 50, 100, 200)


@dataclass(frozen=True)
class Plan:
    """What is measured.

    Attributes
    ----------
    levels
        Intervals for the velocity.
    distances
        Smallest distances of the centrelines for the velocity.
    intervals
        Intervals for the tensions.
    ratios
        Distances over d_0 for the tensions.
    """

    levels: tuple[int, ...]
    distances: tuple[float, ...]
    intervals: int
    ratios: tuple[float, ...]


def _distances(start: int, per_octave: int) -> tuple[float, ...]:
    steps = range(start, 4 * per_octave + 1)
    return (*(rows.NEAR * 2.0 ** (j / per_octave) for j in steps), 1.0)


_FULL = Plan(
    (50, 100, 200),
    _distances(-14, 4),
    100,
    (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0, 10.0, 20.0, 50.0),
)
_QUICK = Plan((50, 100), _distances(-5, 2), 50, (0.5, 1.0, 2.0, 3.0, 10.0, 50.0))


def run(settings: Settings) -> xr.Dataset:
    """Return errors by distance, and iterations by distance over d_0."""
    plan = _QUICK if settings.quick else _FULL
    errors = velocity.errors(plan.levels, plan.distances)
    counts = tensions.iterations(plan.intervals, plan.ratios, settings.progress)
    return xr.merge([errors, counts]).assign_attrs(
        intervals_of_tensions=plan.intervals,
        eps_of_tensions=tensions.EPS,
        quick=int(settings.quick),
    )


def figure(data: xr.Dataset) -> Figure:
    """Draw the errors of both rules for both eps, and the iterations of both solvers."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(2, 2, width=0.92 * PAGE, height=4.7)
    with style():
        for ax, eps in zip(axes[0], velocity.EPSILONS, strict=True):
            _draw_errors(ax, data, eps)
        axes[0, 0].set_ylabel("relative error of the velocity")
        axes[0, 0].legend(loc="upper right", ncols=2)
        for ax, solver in zip(axes[1], tensions.SOLVERS, strict=True):
            _draw_iterations(ax, data, solver)
        axes[1, 0].set_ylabel("iterations")
        axes[1, 0].legend(loc="upper right")
    return axes[0, 0].figure


def _draw_errors(ax: Axes, data: xr.Dataset, eps: float) -> None:
    from stokesfibers.plot.style import FAINT, INK, PALETTE

    levels = data["intervals"].to_numpy()
    for rule, dash in (("plain", (0, (3, 1.5))), ("refined", "-")):
        for n, colour in zip(levels, PALETTE, strict=False):
            ratio = data["distance"].to_numpy() / blend_distance(eps, n)
            label = f"{rule}, $N = {n}$"
            values = rows.errors(data, rule, eps, n)
            line = {"color": colour, "linestyle": dash, "markersize": 1.6}
            ax.loglog(ratio, values, marker="o", label=label, **line)
    _shade(ax, 1.0)
    ax.axvline(rows.LIMIT, color=INK, linewidth=0.6, linestyle=(0, (1, 2)))
    where = ax.get_xaxis_transform()
    ax.text(1.04 * rows.LIMIT, 0.02, "$3 d_0$", fontsize=7, va="bottom", transform=where)
    ax.set(xlim=(1.0, 200.0), ylim=(8e-7, 1.0), xlabel="smallest distance, $d/d_0$")
    ticks = (1, 2, 5, 10, 20, 50, 100, 200)
    ax.set_xticks(ticks, [str(tick) for tick in ticks])
    ax.xaxis.minorticks_off()
    ax.tick_params(axis="y", which="minor", color=FAINT)
    scale = "h" if blend_distance(eps, levels[0]) > 2.0 * eps else r"2\varepsilon"
    ax.set_title(rf"$\varepsilon = 10^{{{round(np.log10(eps))}}}$, $d_0 = {scale}$")


def _draw_iterations(ax: Axes, data: xr.Dataset, solver: str) -> None:
    from stokesfibers.plot.style import INK, PALETTE

    ratio, most = data["ratio"].to_numpy(), tensions.SOLVERS[solver].most
    names = data["case"].to_numpy()
    height = 1.25 * most
    for name, colour, marker in zip(names, PALETTE, "os^D", strict=False):
        found = rows.counts(data, name, solver)
        line = {"color": colour, "marker": marker, "markersize": 3.0}
        ax.loglog(ratio, found, linewidth=0.8, label=str(name), **line)
        lost = ratio[np.isnan(found)]
        if lost.size:
            at = np.full(lost.size, height)
            ax.plot(lost, at, linestyle="none", markerfacecolor="white", **line)
            height *= 1.3
    _shade(ax, 0.4)
    ax.plot([0.4, 2.0], [most, most], color=INK, linewidth=0.6)
    ax.text(2.1, most, f"gives up at {most}", fontsize=7, va="center")
    ax.set(xlim=(0.4, 60.0), ylim=(1.0, 400.0), xlabel="smallest distance, $d/d_0$")
    for axis, ticks in ((ax.xaxis, (0.5, 1, 2, 5, 10, 20, 50)), (ax.yaxis, _COUNTS)):
        axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.minorticks_off()
    ax.set_title({"sweeps": "sweeps (39)", "gmres": "GMRES"}[solver])


def _shade(ax: Axes, start: float) -> None:
    """Shade the distances at which the velocities are blended."""
    from stokesfibers.plot.style import FAINT

    ax.axvspan(start, 2.0, color=FAINT, alpha=0.22, linewidth=0.0)
    where = ax.get_xaxis_transform()
    ax.text(1.9, 0.02, "blend", fontsize=7, ha="right", va="bottom", transform=where)


def check(data: xr.Dataset) -> Sequence[Row]:
    """State errors, orders and iterations."""
    return [*rows.velocity_rows(data), *rows.tension_rows(data)]
