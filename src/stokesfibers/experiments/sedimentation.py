"""Terminal shapes of a flexible fiber that falls, against the elasto-gravitational number B.

B is the total weight times L^2 / E. A weight like the cross-section pulls the middle down; where it
is small, y_ssss = B P_2(2 s - 1) in every model, since P_2 is an eigenfunction of the operator and
only what a constant velocity does not carry bends the fiber: the sag is 11 B / 3840 and the largest
curvature B / 32. Under a uniform weight the straight fiber is a steady shape at every B, since the
radius r(s) gives the same drag to all parts; strongly bent fibers need not come back to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.settling import Settled, settled, slightly_bent, uniform
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.load import Gravity
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import simulate
from stokesfibers.slender.mobility import AbstractMobility, LocalDrag, NonLocal
from stokesfibers.slender.regularization import SpheroidalRegularization

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SAG_PER_NUMBER = 11.0 / 3840.0
CURVATURE_PER_NUMBER = 1.0 / 32.0
_NON_LOCAL = NonLocal(SpheroidalRegularization())
_MODELS: dict[str, tuple[AbstractMobility, float]] = {
    "local drag": (LocalDrag(), 1e-2),
    "non-local, eps = 0.01": (_NON_LOCAL, 1e-2),
    "non-local, eps = 0.001": (_NON_LOCAL, 1e-3),
}
_DRAWN = (10.0, 100.0, 1000.0, 1e4)
_TILT = 1.2  # radians from the horizontal
_UNIFORM = 1000.0  # B of the uniform weight that a slightly bent fiber is given
_LEAST_UNIFORM = 90.0  # B from which hairpins are given a uniform weight
_SHOWN_UNIFORM = "non-local, eps = 0.01"
_STRAIGHT = 1e-2  # sag below which a shape counts as straight
_OWN = "Ours: no published number to compare with was at hand."


def run(settings: Settings) -> xr.Dataset:
    """Return steady shapes and what is measured of them. Takes two minutes in full."""
    numbers = np.logspace(0.0, 3.0, 4) if settings.quick else np.logspace(0.0, 4.0, 17)
    found: list[list[Settled]] = []
    for done, (mobility, eps) in enumerate(_MODELS.values()):
        if settings.progress:
            settings.progress("falling fibers", done / len(_MODELS))
        found.append([settled(b, mobility, eps) for b in numbers])
    hairpins = list(_MODELS).index(_SHOWN_UNIFORM)
    mobility, eps = _MODELS[_SHOWN_UNIFORM]
    stiff = int(np.sum(numbers < _LEAST_UNIFORM))
    from_hairpins = [
        settled(b, mobility, eps, weight=uniform, start=one.curve)
        for b, one in zip(numbers[stiff:], found[hairpins][stiff:], strict=True)
    ]
    turned = settled(100.0, mobility, eps, start=slightly_bent(_TILT))
    axes = ("model", "number")

    def table(name: str) -> tuple[tuple[str, str], list[list[float]]]:
        return axes, [[getattr(one, name) for one in row] for row in found]

    shapes = [[one.shape for one in row] for row in found]
    names = ("sag", "span", "curvature", "velocity", "fallen", "error")
    straightened, bend = _uniform_weight()
    return xr.Dataset(
        {
            "shape": ((*axes, "space", "point"), shapes),
            **{name: table(name) for name in names},
            "uniform_sag": (("uniform_number",), [one.sag for one in from_hairpins]),
        },
        coords={
            "model": list(_MODELS),
            "number": numbers,
            "space": ["x", "y"],
            "uniform_number": numbers[stiff:],
        },
        attrs={
            "quick": int(settings.quick),
            "turned_to": turned.angle,
            "turned_sag": turned.sag,
            "uniform_span": straightened,
            "uniform_bend": bend,
        },
    )


def _uniform_weight() -> tuple[float, float]:
    """Return the distance between the ends and the largest curvature of a bent fiber in the end."""
    fiber = Fiber(slenderness=1e-2)
    problem = Problem(
        fiber,
        mu_bar=1.0,
        mobility=_NON_LOCAL,
        load=Gravity((0.0, -_UNIFORM, 0.0)),
        engine=SpectralEngine(rtol=1e-4),
    )
    until = 0.01  # forty times the decay time of the slowest bend
    data = simulate(problem, slightly_bent(0.3), until=until, record=Schedule(until, until)).data
    last = data["observables"].to_dataset().isel(time=-1, fiber=0)
    return float(np.linalg.norm(last["end_to_end"])), float(last["largest_curvature"])


def figure(data: xr.Dataset) -> Figure:
    """Draw the shapes, the sag and the velocity."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(1, 3, width=PAGE, height=2.4)[0]
    with style():
        _draw_shapes(axes[0], data)
        _draw_sag(axes[1], data)
        _draw_velocity(axes[2], data)
    return axes[0].figure


def _draw_shapes(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import PALETTE

    models = list(_MODELS)
    dashes = {models[0]: (0, (3, 1.5)), models[1]: "-"}
    for number, b in enumerate(_DRAWN):
        if not np.isclose(data["number"], b).any():
            continue
        for model, dash in dashes.items():
            x, y = data["shape"].sel(model=model).sel(number=b, method="nearest").to_numpy()
            label = f"$10^{{{round(log(b, 10))}}}$" if model == models[1] else None
            low = y - y.min()
            ax.plot(x, low, color=PALETTE[number], linestyle=dash, linewidth=0.9, label=label)
    ax.set_aspect("equal")
    ax.set(xlabel="$x / L$", ylabel="$y / L$", xlim=(-0.53, 0.53), ylim=(-0.04, 0.66))
    ax.legend(title="$B$", ncols=4, loc="upper center", columnspacing=0.8, handlelength=1.0)


def _draw_sag(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import FAINT, PALETTE

    b = data["number"].to_numpy()
    ax.plot(b, SAG_PER_NUMBER * b, color=FAINT, linewidth=0.7, label="$11 B / 3840$")
    for model, colour, dash in _lines(data):
        ax.plot(b, data["sag"].sel(model=model), color=colour, linestyle=dash, label=_label(model))
    bent = data["uniform_sag"].where(data["uniform_sag"] > _STRAIGHT)
    ax.plot(
        data["uniform_number"],
        bent,
        "o",
        color=PALETTE[0],
        markerfacecolor="white",
        markersize=3.2,
        label=r"uniform weight, $\varepsilon=0.01$",
    )
    ax.set(xscale="log", yscale="log", xlabel="$B$", ylabel="sag / $L$", ylim=(2e-3, 1.0))
    ax.legend(loc="lower right", fontsize=7)


def _draw_velocity(ax: Axes, data: xr.Dataset) -> None:
    b = data["number"].to_numpy()
    for model, colour, dash in _lines(data):
        ax.plot(b, data["velocity"].sel(model=model), color=colour, linestyle=dash)
    ax.set(xscale="log", xlabel="$B$", ylabel="velocity / straight, across", ylim=(0.95, 2.0))


def _lines(data: xr.Dataset) -> list[tuple[str, str, Any]]:
    from stokesfibers.plot.style import INK, PALETTE

    colours: tuple[str, ...] = (INK, *PALETTE[:2])
    dashes = ((0, (3, 1.5)), "-", "-")
    models = [str(model) for model in data["model"].to_numpy()]
    return list(zip(models, colours, dashes, strict=True))


def _label(model: str) -> str:
    return model.replace("eps = ", r"$\varepsilon=$")


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare weak bending with its exact limit; state the rest."""
    return [*_weak(data.isel(number=0)), *_strong(data), *_orientation_and_uniform_weight(data)]


def _weak(data: xr.Dataset) -> list[Row]:
    rows = []
    b = float(data["number"])
    exact = "Exact for small B, in every model."
    for model in data["model"].to_numpy():
        one, where = data.sel(model=model), f"B = {b:g}, {model}"
        for name, quantity, limit in (
            ("sag", "sag / (B L)", SAG_PER_NUMBER),
            ("curvature", "largest curvature L / B", CURVATURE_PER_NUMBER),
        ):
            ours, low, high = float(one[name]) / b, limit * (1.0 - 1e-4), limit * (1.0 + 1e-4)
            rows.append(Row(f"{quantity}, {where}", ours, limit, low, high, exact))
    return rows


def _strong(data: xr.Dataset) -> list[Row]:
    rows = []
    strong = data.isel(number=-1)
    for model in data["model"].to_numpy():
        one, where = strong.sel(model=model), f"B = {float(strong['number']):.4g}, {model}"
        span, velocity = float(one["span"]), float(one["velocity"])
        rows += [
            Row(f"distance of the ends / L, {where}", span, note=_OWN),
            Row(f"velocity over that of a straight fiber, {where}", velocity, note=_OWN),
        ]
    last = data.sel(model="local drag").isel(number=slice(-2, None))
    slope = np.diff(np.log(last["curvature"])) / np.diff(np.log(last["number"]))
    scaling = "A hairpin whose legs pull at the bend with the drag of its width: 1/3 for large B."
    return [
        *rows,
        Row(
            "d log(curvature) / d log(B) at the largest B, local drag",
            float(slope[0]),
            note=scaling,
        ),
        Row(
            "largest error of a shape through lack of nodes", float(data["error"].max()), high=1e-5
        ),
    ]


def _orientation_and_uniform_weight(data: xr.Dataset) -> list[Row]:
    from_hairpin = data["uniform_sag"].sel(uniform_number=_UNIFORM, method="nearest")
    return [
        Row(
            f"angle to the horizontal in the end, B = 100, started at {_TILT:g} rad",
            float(data.attrs["turned_to"]),
            0.0,
            -1e-3,
            1e-3,
            "A fiber that bends turns across the force.",
        ),
        Row(
            f"distance of the ends / L under a uniform weight, B = {_UNIFORM:g}",
            float(data.attrs["uniform_span"]),
            1.0,
            1.0 - 1e-6,
            1.0 + 1e-6,
            "It started with a slight bend; the straight fiber is an exact steady shape.",
        ),
        Row(
            f"sag / L under a uniform weight, B = {_UNIFORM:g}, from a hairpin",
            float(from_hairpin),
            note="A second steady shape. " + _OWN,
        ),
    ]
