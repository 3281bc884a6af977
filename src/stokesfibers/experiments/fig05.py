"""Fig. 5: line tension T(s) at the times of Fig. 3, and that of the straight filament, (44)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import runs, straight
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.fig03 import MU_BAR
from stokesfibers.experiments.shapes import SHAPE_FRAMES
from stokesfibers.experiments.tiers import EPS, BucklingRun, tier

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_EARLY = -16
"""Frame long before the buckling: t = 41.472 in the paper's run."""
_BUCKLED = -1


def run(settings: Settings) -> xr.Dataset:
    """Return computed and straight tensions at the frames of Fig. 3, and early and late."""
    chosen = tier(settings.quick)
    case = BucklingRun(chosen, MU_BAR, chosen.drawn)
    frames = np.array([_EARLY, *SHAPE_FRAMES, chosen.last_frame])
    found = runs.frames(runs.finished([case], settings)[0], chosen.at(frames))
    s = found["arclength"].to_numpy()[0]
    theta = straight.angle(found["time"].to_numpy(), chosen.vertical)
    amplitude = straight.tension_amplitude(theta, MU_BAR, EPS)
    return xr.Dataset(
        {
            "tension": (("time", "node"), found["tension"].to_numpy()[:, 0]),
            "straight_tension": (("time", "node"), amplitude[:, None] * s * (1.0 - s)),
            "frame": (("time",), frames),
        },
        coords={"time": found["time"].to_numpy(), "arclength": (("node",), s)},
        attrs={"mu_bar": MU_BAR, "intervals": case.intervals, "quick": int(settings.quick)},
    )


def figure(data: xr.Dataset) -> Figure:
    """Draw one panel per time of Fig. 3."""
    from stokesfibers.plot.style import FAINT, PAGE, PALETTE, new_panels, style

    axes = new_panels(2, len(SHAPE_FRAMES) // 2, width=PAGE, height=3.2)
    s = data["arclength"].to_numpy()
    with style():
        for ax, frame in zip(axes.flat, SHAPE_FRAMES, strict=True):
            one = _at(data, frame)
            ax.axhline(0.0, color=FAINT, linewidth=0.4, zorder=0)
            dashed = (0, (4, 2))
            ax.plot(s, one["straight_tension"], color=PALETTE[1], linewidth=0.8, linestyle=dashed)
            ax.plot(s, one["tension"], color=PALETTE[0])
            ax.set_title(f"$t = {float(one['time']):.6g}$")
            ax.set_xlim(0.0, 1.0)
            ax.set_xticks([0.0, 0.5, 1.0])
            ax.ticklabel_format(axis="y", scilimits=(-3, 5))
        lines = axes[0, 0].get_lines()
        axes[0, 0].legend(lines[:0:-1], ["computed", "straight, (44)"], loc="upper center")
        for ax in axes[-1]:
            ax.set_xlabel("$s$")
        for ax in axes[:, 0]:
            ax.set_ylabel("$T$")
        axes[0, 0].figure.align_ylabels(list(axes[:, 0]))
    return axes[0, 0].figure


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare with the parabola (44) before and after, and count extrema in between."""
    early, buckled, late = _at(data, _EARLY), _at(data, _BUCKLED), data.isel(time=-1)
    middle = data.sizes["node"] // 2
    close = 0.03 if data.attrs["quick"] else 0.01
    regularised = "The run is regularised (15), (24); (44) is the unregularised solution."
    return [
        Row(
            f"T(1/2) over that of (44), t = {float(early['time']):g}",
            float(early["tension"][middle] / early["straight_tension"][middle]),
            "negative parabola",
            1.0 - close,
            1.0 + close,
            regularised,
        ),
        Row(
            f"T(1/2) at t = {float(early['time']):g}",
            float(early["tension"][middle]),
            "negative, to resist compression",
            high=0.0,
        ),
        Row(
            f"extrema of T between the ends, t = {float(buckled['time']):g}",
            _extrema(buckled["tension"].to_numpy()),
            "a more complicated structure",
            low=3,
            note="A parabola has one.",
        ),
        Row(
            f"T(1/2) over that of (44), t = {float(late['time']):g}",
            float(late["tension"][middle] / late["straight_tension"][middle]),
            "parabolic once more",
            1.0 - 5.0 * close,
            1.0 + 5.0 * close,
            "The buckling has turned the filament a little ahead of, or behind, the straight one.",
        ),
        Row(
            f"T(1/2) at t = {float(late['time']):g}",
            float(late["tension"][middle]),
            "positive, to resist extension",
            low=0.0,
        ),
    ]


def _at(data: xr.Dataset, frame: int) -> xr.Dataset:
    return data.isel(time=int(np.argmax(data["frame"].to_numpy() == frame)))


def _extrema(values: Array) -> int:
    slopes = np.sign(np.diff(values))
    return int(np.sum(slopes[1:] * slopes[:-1] < 0.0))
