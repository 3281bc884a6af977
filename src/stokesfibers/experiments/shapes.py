"""What Figs. 2-4 share: shapes of the buckling filament at one mu_bar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.experiments import runs, straight
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.tiers import BucklingRun, tier

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHAPE_FRAMES = (-7, -3, -2, -1, 0, 1, 2, 3)
"""Times drawn, in frames of 0.512 from the vertical: 46.08, 48.128, ..., 51.2 in the paper's runs.

The paper's own times are not printed.
"""


@dataclass(frozen=True)
class Expected:
    """What a run at the paper's resolution has to give; our converged values, not the paper's.

    Attributes
    ----------
    statement
        What the paper says of the buckling.
    energy
        Peak elastic energy (49).
    shortest
        Smallest end-to-end distance.
    """

    statement: str
    energy: float
    shortest: float


def run(settings: Settings, mu_bar: float) -> xr.Dataset:
    """Return shapes and tensions at `SHAPE_FRAMES`, and the run's energy and lengths."""
    chosen = tier(settings.quick)
    case = BucklingRun(chosen, mu_bar, chosen.drawn)
    tree = runs.finished([case], settings)[0]
    data = runs.frames(tree, chosen.at(np.array(SHAPE_FRAMES)))
    time, energy = runs.series(tree, "elastic_energy")
    ends = np.linalg.norm(runs.series(tree, "end_to_end")[1], axis=1)
    lengths = runs.series(tree, "length_error")[1]
    data = data.assign_coords(observed=time)
    return data.assign(
        elastic_energy=(("observed",), energy),
        end_to_end=(("observed",), ends),
        length_error=(("observed",), lengths),
    ).assign_attrs(
        mu_bar=mu_bar,
        intervals=case.intervals,
        vertical=chosen.vertical,
        quick=int(settings.quick),
    )


def figure(data: xr.Dataset) -> Figure:
    """Draw one panel per time; dashed, the straight filament (44) of the same initial angle."""
    from stokesfibers.plot.style import FAINT, PAGE, PALETTE, new_panels, style

    across = len(SHAPE_FRAMES) // 2
    axes = new_panels(2, across, width=PAGE, height=3.95, shared_scale=True)
    times = data["time"].to_numpy()
    thetas = straight.angle(times, data.attrs["vertical"])
    positions = data["position"].to_numpy()[:, 0]
    ticks = [-0.5, 0.0, 0.5]
    with style():
        for ax, time, theta, x in zip(axes.flat, times, thetas, positions, strict=True):
            rod = straight.centreline(theta)
            ax.plot(*rod.T, color=FAINT, linewidth=0.7, linestyle=(0, (4, 2)))
            ax.plot(x[:, 0], x[:, 1], color=PALETTE[0], linewidth=1.3)
            ax.set_aspect("equal", adjustable="box")
            ax.set(xlim=(-0.56, 0.56), ylim=(-0.56, 0.56), xticks=ticks, yticks=ticks)
            ax.set_title(f"$t = {time:.6g}$")
        for ax in axes[-1]:
            ax.set_xlabel("$x$")
        for ax in axes[:, 0]:
            ax.set_ylabel("$y$")
    return axes[0, 0].figure


def check(data: xr.Dataset, expected: Expected) -> Sequence[Row]:
    """Check how far the filament buckles, that it straightens again and keeps its length."""
    quick = bool(data.attrs["quick"])
    energy = float(data["elastic_energy"].max())
    shortest = float(data["end_to_end"].min())
    ours = "Range: our converged value, 3 %."
    near = (0.97, 1.03)
    return [
        Row(
            "peak elastic energy",
            energy,
            expected.statement,
            *((1.0, None) if quick else (near[0] * expected.energy, near[1] * expected.energy)),
            note="" if quick else ours,
        ),
        Row(
            "smallest end-to-end distance",
            shortest,
            expected.statement,
            *(
                (0.3, 0.995)
                if quick
                else (near[0] * expected.shortest, near[1] * expected.shortest)
            ),
            note="" if quick else ours,
        ),
        Row(
            "end-to-end distance at the end",
            float(data["end_to_end"][-1]),
            "extends to a straight shape again",
            0.9999,
            1.0001,
        ),
        Row(
            "largest relative length error",
            float(data["length_error"].max()),
            high=0.05 if quick else 5e-4,
        ),
    ]
