"""Fig. 1: a straight rod in shear, with points that follow the flow (T = 0) and inextensible."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import straight
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.tiers import EPS
from stokesfibers.fiber import curves
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ANGLE = 5.0 * pi / 6.0
"""theta_0. The paper does not print that of its figure; sin(theta_0) = 1/2 here."""
VERTICAL = -cos(ANGLE) / sin(ANGLE)
MU_BAR = 1e4
FRAMES = 5
_STEPS, _QUICK_STEPS = 400, 160


def run(settings: Settings) -> xr.Dataset:
    """Turn the rod from theta_0 to the mirror image of that in both ways."""
    steps = _QUICK_STEPS if settings.quick else _STEPS
    fiber = Fiber(length=1.0, slenderness=EPS, rigidity=1.0)
    flow = Shear(rate=1.0)
    problem = Problem(
        fiber,
        mu_bar=MU_BAR,
        flow=flow,
        engine=PaperEngine(intervals=25 if settings.quick else 50, dt=2.0 * VERTICAL / steps),
    )
    start = curves.straight(fiber, angle=ANGLE)
    each = 2.0 * VERTICAL / (FRAMES - 1)
    result = simulate(
        problem, start, until=2.0 * VERTICAL, record=Schedule(each, 2.0 * VERTICAL / steps)
    )
    trajectory = result.data["trajectory"].to_dataset()
    rod = trajectory["position"].to_numpy()[:, 0]
    times = trajectory["time"].to_numpy()
    carried = _carried(flow, rod[0], times)
    observed = result.data["observables"]
    ends = observed["end_to_end"].to_numpy()[:, 0]
    return xr.Dataset(
        {
            "with_tension": (("time", "node", "space"), rod),
            "without_tension": (("time", "node", "space"), carried),
            "length_error": (("observed",), observed["length_error"].to_numpy()[:, 0]),
            "angle": (("observed",), np.arctan2(-ends[:, 1], -ends[:, 0]) % pi),
        },
        coords={"time": times, "observed": observed["time"].to_numpy()},
        attrs={"theta_0": ANGLE, "vertical": VERTICAL, "quick": int(settings.quick)},
    )


def _carried(flow: Shear, points: Array, times: Array) -> Array:
    """Return where the flow carries `points` (node, 3), by Runge-Kutta steps between `times`."""
    found = [points]
    for before, after in pairwise(times):
        x, dt, middle = found[-1], after - before, 0.5 * (before + after)
        k1 = flow.velocity(x, before)
        k2 = flow.velocity(x + 0.5 * dt * k1, middle)
        k3 = flow.velocity(x + 0.5 * dt * k2, middle)
        k4 = flow.velocity(x + dt * k3, after)
        found.append(x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
    return np.stack(found)


def _lengths(positions: Array) -> Array:
    return np.linalg.norm(np.diff(positions, axis=1), axis=2).sum(axis=1)


def figure(data: xr.Dataset) -> Figure:
    """Draw two rows: without tension above, with tension below, as the paper does."""
    from stokesfibers.plot.style import FAINT, PAGE, PALETTE, new_panels, style

    axes = new_panels(2, FRAMES, width=PAGE, height=3.2, shared_scale=True)
    rows = ("without_tension", "with_tension")
    with style():
        for row, (name, label) in enumerate(zip(rows, ("$T = 0$", "$T(s)$ of (22)"), strict=True)):
            positions = data[name].to_numpy()
            for ax, x, length in zip(axes[row], positions, _lengths(positions), strict=True):
                _draw_flow(ax, FAINT)
                ax.plot(x[:, 0], x[:, 1], color=PALETTE[1 - row], linewidth=2.0)
                ax.set_xlabel(rf"$\ell = {length:.2f}$", labelpad=3.0)
            axes[row, 0].set_ylabel(label)
        for ax, time in zip(axes[0], data["time"].to_numpy(), strict=True):
            ax.set_title(f"$t = {time:.2f}$")
        _bare(axes)
    return axes[0, 0].figure


def _draw_flow(ax: Axes, colour: str) -> None:
    y = np.linspace(-0.4, 0.4, 9)
    zero = np.zeros_like(y)
    style: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.6}
    ax.quiver(zero, y, y, zero, color=colour, width=0.006, alpha=0.55, zorder=0, **style)
    ax.plot([0.0, 0.0], [-0.45, 0.45], color=colour, linewidth=0.4, zorder=0)


def _bare(axes: NDArray[Any]) -> None:
    for ax in axes.ravel():
        ax.set(xlim=(-0.52, 0.52), ylim=(-0.53, 0.53), xticks=[], yticks=[])
        ax.set_aspect("equal")
        ax.spines[:].set_visible(False)


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare lengths, end points and angle with Section 4.1 (end points halved: errata)."""
    middle = FRAMES // 2
    loose = _lengths(data["without_tension"].to_numpy())
    top = float(np.abs(data["without_tension"][middle, :, 1]).max())
    angles = data["angle"].to_numpy()
    exact = straight.angle(data["observed"].to_numpy(), VERTICAL)
    turned = float(np.abs(angles - exact).max())
    expected = sin(ANGLE)
    tight = 1e-12
    return [
        Row(
            "length at the vertical over initial length, T = 0",
            loose[middle] / loose[0],
            "sin(theta_0)",
            expected - tight,
            expected + tight,
            f"sin(theta_0) = {expected:g}",
        ),
        Row(
            "y of the upper end at the vertical, T = 0",
            top,
            "sin(theta_0)",
            0.5 * expected - tight,
            0.5 * expected + tight,
            "Half the printed value: the filament has length 1 (errata).",
        ),
        Row(
            "final length over initial length, T = 0",
            loose[-1] / loose[0],
            "extended again",
            1.0 - tight,
            1.0 + tight,
        ),
        Row(
            "largest relative length error with tension",
            float(data["length_error"].max()),
            "fixed length",
            high=2e-3 if data.attrs["quick"] else 1e-4,
        ),
        Row(
            "largest error of the angle against (45), radians",
            turned,
            high=2e-3 if data.attrs["quick"] else 1e-4,
        ),
    ]
