"""Fig. 15: the filament of Appendix C, its two nearest images, and the lines of test points.

The paper's shape is not published (errata, item 8); ours is the most bent one of the buckling run.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.experiments import images
from stokesfibers.experiments.base import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

run = images.run


def figure(data: xr.Dataset) -> Figure:
    """Draw the filament and its images, and dashed the lines of test points."""
    from stokesfibers.plot.style import INK, PAGE, PALETTE, new_axes, style

    ax = new_axes(width=PAGE, height=2.8)
    period = images.PERIODS[0]
    x, y, _ = data["position"].sel(filament="bent").to_numpy()
    with style():
        for p in (-1, 0, 1):
            ax.plot(x - p * period, y, color=PALETTE[0], linewidth=1.3)
        for line in images.LINES:
            ends = images.HEIGHTS[[0, -1]]
            ax.plot([line, line], ends, color=INK, linewidth=0.7, linestyle=(0, (4, 2)))
            ax.text(line, 0.84, rf"$\bar{{x}} = {line}$", ha="center", fontsize=7)
        ax.set_aspect("equal", adjustable="box")
        ax.set(xlim=(-2.5, 2.5), ylim=(-0.95, 0.95), xlabel="$x$", ylabel="$y$")
    return ax.figure  # pyright: ignore[reportReturnType]


def check(data: xr.Dataset) -> Sequence[Row]:
    """Check that the shape is strongly bent, planar, free at its ends and clear of the lines."""
    position = data["position"].to_numpy()
    ends = np.linalg.norm(position[:, :, -1] - position[:, :, 0], axis=1)
    force = np.linalg.norm(data["force"].to_numpy(), axis=1)
    energy = data["elastic_energy"].to_numpy()
    share = energy / float(data["largest_energy"])
    clear = images.LINES[0] - position[0, 0].max()
    return [
        Row("time of the shape", float(data["time"][0])),
        Row("elastic energy of the shape", energy[0]),
        Row(
            "elastic energy over the largest of the run",
            share[0],
            "rather high curvature",
            0.98,
            1.0,
        ),
        Row("end-to-end distance", ends[0], "rather high curvature", high=0.9),
        Row("largest |z|", np.abs(position[:, 2]).max(), "in the xy-plane", high=1e-12),
        Row(
            "|F| at the ends over the largest",
            float((force[:, [0, -1]].max(axis=1) / force.max(axis=1)).max()),
            "0",
            high=1e-7,
            note="Section 2.5; (17) rests on it.",
        ),
        Row(
            "distance of the nearest line of test points to the filament",
            clear,
            low=1.0 / data.attrs["intervals"],
            note="At least the spacing of the nodes.",
        ),
        Row("elastic energy of the straighter shape over the largest", share[1], None, 0.15, 0.35),
        Row("end-to-end distance of the straighter shape", ends[1], None, float(ends[0]), 1.0),
    ]
