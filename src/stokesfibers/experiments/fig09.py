"""Fig. 9: length errors in time at three resolutions; and what the penalisation beta does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.experiments import runs
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.convergence import distance
from stokesfibers.experiments.tiers import BucklingRun, Tier, tier

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MU_BAR = 4e5
_BETAS = {"full": (0.0, 10.0, 20.0, 50.0), "quick": (0.0, 10.0, 15.0, 20.0)}
_COMPARED = (-1, 1, 2)
"""Frames at which shapes for different beta are compared: 49.152, 50.176, 50.688."""
_DRAWN_FROM = -9
_DASHES: tuple[Any, ...] = ((0, (5, 1.5, 1, 1.5)), (0, (4, 1.5)), "-")


def run(settings: Settings) -> xr.Dataset:
    """Return length errors by mu_bar and level, and by beta at the middle level."""
    chosen = tier(settings.quick)
    cases = [BucklingRun(chosen, mu, n) for mu in chosen.mu_bars for n in chosen.levels_for(mu)]
    trees = runs.finished(cases, settings)
    time = runs.series(trees[0], "time")[0]
    errors = np.full((len(chosen.mu_bars), len(chosen.levels), len(time)), np.nan)
    for case, tree in zip(cases, trees, strict=True):
        row, column = chosen.mu_bars.index(case.mu_bar), chosen.levels.index(case.intervals)
        errors[row, column] = _on(time, tree)
    data = xr.Dataset(
        {"length_error": (("mu_bar", "intervals", "time"), errors)},
        coords={
            "time": time,
            "mu_bar": list(chosen.mu_bars),
            "intervals": list(chosen.levels),
        },
        attrs={"vertical": chosen.vertical, "beta": chosen.beta, "quick": int(settings.quick)},
    )
    return _with_betas(data, chosen, settings)


def _with_betas(data: xr.Dataset, chosen: Tier, settings: Settings) -> xr.Dataset:
    """Add what runs with other beta give at the middle level; NaN after a blow-up."""
    betas = list(_BETAS[chosen.name])
    middle = chosen.levels[1]
    cases = [BucklingRun(chosen, _MU_BAR, middle, beta=beta) for beta in betas]
    trees = runs.attempted(cases, settings)
    times = chosen.at(np.array(_COMPARED))
    usual = runs.frames(trees[betas.index(chosen.beta)], times)["position"].to_numpy()[:, 0]
    apart = np.full(len(betas), np.nan)
    for k, tree in enumerate(trees):
        if runs.status(tree)["code"] == "done":
            x = runs.frames(tree, times)["position"].to_numpy()[:, 0]
            apart[k] = max(distance(a, b) for a, b in zip(x, usual, strict=True))
    finer = BucklingRun(chosen, _MU_BAR, chosen.levels[2])
    fine = runs.frames(runs.finished([finer], settings)[0], times)["position"].to_numpy()[:, 0]
    time = data["time"].to_numpy()
    return data.assign_coords(beta=betas).assign(
        beta_length_error=(("beta", "time"), np.stack([_on(time, tree) for tree in trees])),
        beta_distance=(("beta",), apart),
        beta_end=(("beta",), [float(runs.status(tree)["time"]) for tree in trees]),
        grid_distance=((), max(distance(a, b) for a, b in zip(usual, fine, strict=True))),
    )


def _on(time: np.ndarray, tree: xr.DataTree) -> np.ndarray:
    """Return the length error at the times that all runs share; NaN behind the run's end."""
    stored, error = runs.series(tree, "length_error")
    values = np.full(len(time), np.nan)
    count = min(len(stored), len(time))
    if not np.allclose(stored[:count], time[:count], rtol=0.0, atol=1e-6):
        raise ValueError("the runs were not observed at the same times")
    values[:count] = error[:count]
    return values


def figure(data: xr.Dataset) -> Figure:
    """Draw one panel per mu_bar, and one for the values of beta."""
    from stokesfibers.plot.style import PAGE, PALETTE, new_panels, style

    count = data.sizes["mu_bar"]
    axes = new_panels(1, count + 1, width=PAGE, height=2.4)[0]
    with style():
        for ax, mu in zip(axes, data["mu_bar"].to_numpy(), strict=False):
            colours = (PALETTE[1], PALETTE[2], PALETTE[0])
            for n, dashes, colour in zip(
                data["intervals"].to_numpy(), _DASHES, colours, strict=True
            ):
                line = data["length_error"].sel(mu_bar=mu, intervals=n)
                if np.isfinite(line).any():
                    label = f"$N = {n}$"
                    ax.semilogy(data["time"], line, color=colour, linestyle=dashes, label=label)
            ax.set_title(rf"$\bar\mu = {mu / 1e5:g}\times 10^5$")
        for number, beta in enumerate(data["beta"].to_numpy()):
            line = data["beta_length_error"].sel(beta=beta)
            colour = PALETTE[(6, 5, 2, 3)[number]]
            axes[-1].semilogy(data["time"], line, color=colour, label=rf"$\beta = {beta:g}$")
        middle = int(data["intervals"][1])
        axes[-1].set_title(rf"$\bar\mu = {_MU_BAR / 1e5:g}\times 10^5$, $N = {middle}$")
        for number, ax in enumerate(axes):
            _finish(ax, data, first=number == 0)
    return axes[0].figure


def _finish(ax: Axes, data: xr.Dataset, *, first: bool) -> None:
    start = data.attrs["vertical"] + 0.512 * _DRAWN_FROM
    ax.set(xlim=(start, start + 14.0 * 0.512), ylim=(1e-9, 0.6), xlabel="time $t$")
    ax.legend(handlelength=2.2, loc="upper left", fontsize=6.5)
    if first:
        ax.set_ylabel("relative length error")
    else:
        ax.tick_params(labelleft=False)


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare peaks from one resolution to the next, and runs of different beta."""
    rows = []
    levels = data["intervals"].to_numpy()
    for mu in data["mu_bar"].to_numpy():
        peaks = data["length_error"].sel(mu_bar=mu).max("time").to_numpy()
        for n, peak in zip(levels, peaks, strict=True):
            if np.isfinite(peak):
                rows.append(Row(f"peak length error, mu_bar = {mu:g}, N = {n}", peak))
        for k, factor in enumerate(peaks[:-1] / peaks[1:]):
            if np.isfinite(factor):
                rows.append(
                    Row(
                        f"peak falls by, mu_bar = {mu:g}, N = {levels[k]} to {levels[k + 1]}",
                        factor,
                        "more than a factor of four",
                        low=3.0 if data.attrs["quick"] else 4.0,
                        note="Coarser grids than the paper's." if data.attrs["quick"] else "",
                    )
                )
    return [*rows, *_check_betas(data)]


def _check_betas(data: xr.Dataset) -> list[Row]:
    rows = []
    usual, quick = data.attrs["beta"], data.attrs["quick"]
    peaks = data["beta_length_error"].max("time")
    limit = float(data["grid_distance"])
    rows.append(
        Row(
            f"shapes of N = {int(data['intervals'][1])} and {int(data['intervals'][2])} apart",
            limit,
            note="Largest mean distance at 49.152, 50.176, 50.688, for scale.",
        )
    )
    for beta in data["beta"].to_numpy():
        peak = float(peaks.sel(beta=beta))
        if beta == 0.0:
            rows += _without_penalisation(data, peak, float(peaks.sel(beta=usual)))
            continue
        rows.append(Row(f"peak length error, beta = {beta:g}", peak))
        if beta != usual:
            rows.append(
                Row(
                    f"shapes of beta = {beta:g} and {usual:g} apart",
                    float(data["beta_distance"].sel(beta=beta)),
                    "only very marginally",
                    high=(1.0 if quick else 0.5) * limit,
                    note="Mean distance; range: half the distance to the next resolution."
                    if not quick
                    else "",
                )
            )
    return rows


def _without_penalisation(data: xr.Dataset, peak: float, usual: float) -> list[Row]:
    end = float(data["beta_end"].sel(beta=0.0))
    lost = not np.isclose(end, float(data["time"][-1]))
    note = f"The run blew up at t = {end:g}." if lost else "The run reached its end."
    return [
        Row(
            "peak length error without penalisation over that with it",
            peak / usual,
            "larger, could render very inaccurate simulations",
            low=3.0,
            note=note,
        )
    ]
