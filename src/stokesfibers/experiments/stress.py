"""What Figs. 6 and 7 share: stresses of the buckling and of the straight filament in time."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import runs, straight
from stokesfibers.experiments.base import Settings
from stokesfibers.experiments.tiers import EPS, BucklingRun, Tier, tier

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MU_BAR = 4e5
OBSERVED = {"n1": "first_normal_stress_difference", "shear_stress": "shear_stress"}


def window(chosen: Tier) -> tuple[float, float]:
    """Return the interval symmetric about the vertical that ends with the run.

    Only there does the integral of N_1 of the straight filament vanish (errata, reading 5).
    """
    return 2.0 * chosen.vertical - chosen.until, chosen.until


def series(settings: Settings) -> xr.Dataset:
    """Return N_1 and Sigma_12 in the window at all levels, and those of the straight filament."""
    chosen = tier(settings.quick)
    cases = [BucklingRun(chosen, MU_BAR, n) for n in chosen.levels_for(MU_BAR)]
    trees = runs.finished(cases, settings)
    time = runs.series(trees[0], OBSERVED["n1"])[0]
    start, end = window(chosen)
    inside = (time > start - 1e-9) & (time < end + 1e-9)
    theta = straight.angle(time[inside], chosen.vertical)
    data = xr.Dataset(
        {
            "straight_n1": (("time",), straight.normal_stress_difference(theta, MU_BAR, EPS)),
            "straight_shear_stress": (("time",), straight.shear_stress(theta, MU_BAR, EPS)),
        },
        coords={"time": time[inside], "intervals": [case.intervals for case in cases]},
        attrs={
            "mu_bar": MU_BAR,
            "vertical": chosen.vertical,
            "window": np.array([start, end]),
            "quick": int(settings.quick),
        },
    )
    for name, stored in OBSERVED.items():
        lines = [runs.series(tree, stored)[1][inside] for tree in trees]
        data[name] = (("intervals", "time"), np.stack(lines))
    return data


def direct(settings: Settings) -> tuple[Array, Array]:
    """Return stored times in the window and N_1 of (48) as printed, (intervals, time)."""
    chosen = tier(settings.quick)
    cases = [BucklingRun(chosen, MU_BAR, n) for n in chosen.levels_for(MU_BAR)]
    found = [
        runs.direct_normal_stress_difference(tree, case)
        for tree, case in zip(runs.finished(cases, settings), cases, strict=True)
    ]
    time = found[0][0]
    start, end = window(chosen)
    inside = (time > start - 1e-9) & (time < end + 1e-9)
    return time[inside], np.stack([values[inside] for _, values in found])


def bending_traces(settings: Settings) -> Array:
    """Return, by level, the trace of the bending part of (48) as printed over the energy (49)."""
    chosen = tier(settings.quick)
    cases = [BucklingRun(chosen, MU_BAR, n) for n in chosen.levels_for(MU_BAR)]
    trees = runs.finished(cases, settings)
    pairs = zip(trees, cases, strict=True)
    return np.array([runs.bending_trace_over_energy(tree, case) for tree, case in pairs])


def mirrored(settings: Settings) -> tuple[Array, Array]:
    """Return N_1 of the runs from x and from the mirror image -x, at the same coarse level."""
    chosen = tier(settings.quick)
    case = BucklingRun(chosen, MU_BAR, chosen.levels_for(MU_BAR)[0])
    cases = [case, replace(case, mirrored=True)]
    one, other = (runs.series(tree, OBSERVED["n1"])[1] for tree in runs.finished(cases, settings))
    return one, other


def draw(data: xr.Dataset, name: str, label: str) -> Figure:
    """Draw the buckling filament (solid), the straight one (dashed) and the vertical time."""
    from stokesfibers.plot.style import COLUMN, FAINT, INK, PALETTE, new_axes, style

    ax: Axes = new_axes(width=COLUMN, height=2.4)
    time = data["time"].to_numpy()
    with style():
        ax.axhline(0.0, color=FAINT, linewidth=0.4, zorder=0)
        ax.axvline(data.attrs["vertical"], color=INK, linewidth=0.6, zorder=1)
        ax.plot(
            time,
            data[f"straight_{name}"],
            color=PALETTE[1],
            linestyle=(0, (4, 1.8)),
            label="straight, (44)",
        )
        ax.plot(time, data[name][-1], color=PALETTE[0], label="buckling")
        ax.set_xlim(time[0], time[-1])
        ax.set_xlabel("time $t$")
        ax.set_ylabel(label)
        ax.legend(loc="upper left")
    return ax.figure  # pyright: ignore[reportReturnType]
