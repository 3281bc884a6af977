"""Buckling thresholds of a compressed fiber: local drag, and what the non-local operator changes.

Thresholds are eigenvalues (`linearised`), in eta = mu_bar / (-c), the rate being that of
compression. Growth rates of short runs of the high-order engine stand beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array, Points
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.linearised import leading, straight_fiber, thresholds
from stokesfibers.flow import PlanarExtension
from stokesfibers.numerics.step_control import AdaptiveSteps
from stokesfibers.slender.mobility import (
    AbstractMobility,
    LocalDrag,
    NonLocal,
    slenderness_constant,
)
from stokesfibers.slender.regularization import (
    AbstractRegularization,
    ConstantRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)
from stokesfibers.stepping.spectral import SpectralStepper

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CRITICAL = 153.20243
"""eta of the first mode with local drag; twice this in shear, which compresses at half its rate."""
GROWTH = {100.0: -1.735612, 200.0: 0.762085, 400.0: 2.002340, 1000.0: 2.709680}
"""Growth rates of the leading mode with local drag by eta, from an independent calculation."""
MEASURED_EPS = 1e-2
_NODES = 24
_MODES = 3
_SPAN = (0.1, 0.3)  # times between which a run's growth is measured
_AMPLITUDE = 1e-6
_TABLED = (1e-4, 1e-3, 1e-2, 10.0**-1.5)
_VANISHING = (1e-10, 1e-20)  # slenderness at which terms in 1/c^2 are left out by extrapolation
_REGULARIZATIONS: tuple[AbstractRegularization, ...] = (
    SpheroidalRegularization(),
    PaperRegularization(),
    ConstantRegularization(),
)


def run(settings: Settings) -> xr.Dataset:
    """Return thresholds against eps and growth rates against eta. Takes seconds."""
    between = np.logspace(-4.0, -1.5, 6 if settings.quick else 26)
    eps = np.unique(np.round(np.concatenate([between, _TABLED]), 12))
    eta = np.linspace(60.0, 1000.0, 20 if settings.quick else 95)
    measured = np.array([120.0, 160.0] if settings.quick else [100.0, 130.0, 150.0, 200.0, 400.0])
    models: tuple[AbstractMobility, ...] = (LocalDrag(), NonLocal(_REGULARIZATIONS[0]))
    rates = [[_rate(model, e) for e in eta] for model in models]
    runs = [[measured_growth(model, e) for e in measured] for model in models]
    expected = [[_rate(model, e) for e in measured] for model in models]
    local = thresholds(straight_fiber(LocalDrag(), MEASURED_EPS, _NODES), _MODES)
    found = [[_critical(NonLocal(r), e) for e in eps] for r in _REGULARIZATIONS]
    return xr.Dataset(
        {
            "local_threshold": (("mode",), local / -slenderness_constant(MEASURED_EPS)),
            "threshold": (("regularization", "eps", "mode"), found),
            "growth": (("mobility", "eta"), rates),
            "growth_of_runs": (("mobility", "eta_of_runs"), runs),
            "growth_expected": (("mobility", "eta_of_runs"), expected),
            "listed_growth": (("listed",), [_rate(LocalDrag(), e) for e in GROWTH]),
        },
        coords={
            "mode": np.arange(1, _MODES + 1),
            "regularization": [r.kind for r in _REGULARIZATIONS],
            "mobility": [model.kind for model in models],
            "eps": eps,
            "eta": eta,
            "eta_of_runs": measured,
            "listed": list(GROWTH),
        },
        attrs={"quick": int(settings.quick), "slope": first_order()},
    )


def _critical(mobility: AbstractMobility, eps: float) -> Array:
    found = thresholds(straight_fiber(mobility, eps, _NODES), _MODES)
    return found / -slenderness_constant(eps)


def _rate(mobility: AbstractMobility, eta: float) -> float:
    fiber = straight_fiber(mobility, MEASURED_EPS, _NODES)
    return leading(fiber, -eta * slenderness_constant(MEASURED_EPS))[0]


def first_order() -> float:
    """Return k of eta_critical = 153.2 (1 - k / (-c) + ...) as eps vanishes."""
    mobility = NonLocal(_REGULARIZATIONS[0])
    size = np.array([-slenderness_constant(eps) for eps in _VANISHING])
    found = np.array([_critical(mobility, eps)[0] for eps in _VANISHING])
    k = size * (1.0 - found / CRITICAL)
    return float((k[1] * size[1] - k[0] * size[0]) / (size[1] - size[0]))


def measured_growth(mobility: AbstractMobility, eta: float, eps: float = MEASURED_EPS) -> float:
    """Return the growth rate of the leading mode's size in a run of the high-order engine."""
    fiber = straight_fiber(mobility, eps, _NODES)
    mu_bar = -eta * slenderness_constant(eps)
    mode = leading(fiber, mu_bar)[1]
    bent = mode * (_AMPLITUDE / np.abs(fiber.tables[0][:, 2:] @ mode).max())

    def position(sigma: Array) -> Points:
        deflection = fiber.basis.positions(sigma)[:, 2:] @ bent
        return np.stack([deflection, sigma - 0.5, 0.0 * sigma], axis=-1)

    stepper = SpectralStepper(
        (fiber,),
        drag=mu_bar,
        flow=PlanarExtension(1.0),
        control=AdaptiveSteps(1e-7),
        threads=1,
    )
    carry = stepper.init((position,))
    sizes = []
    for t in _SPAN:
        while carry.time < t:
            carry, _ = stepper.step(carry)
        sizes.append(float(stepper.interpolate(carry, t).modes[0, 0, 2:] @ mode))
    return float(np.log(sizes[1] / sizes[0]) / (_SPAN[1] - _SPAN[0]))


def figure(data: xr.Dataset) -> Figure:
    """Draw the threshold against eps, and the growth rate against eta with those of runs."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(1, 2, width=PAGE, height=2.7)[0]
    with style():
        _draw_thresholds(axes[0], data)
        _draw_growth(axes[1], data)
    return axes[0].figure


def _draw_thresholds(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import INK, PALETTE

    eps = data["eps"].to_numpy()
    dashes = {"spheroidal": "-", "paper": (0, (4, 1.5)), "constant": (0, (1, 1.2))}
    ax.axhline(float(data["local_threshold"][0]), color=INK, linewidth=0.7, label="local drag")
    for number, kind in enumerate(data["regularization"].to_numpy()):
        one = data["threshold"].sel(regularization=kind, mode=1)
        ax.plot(
            eps, one, color=PALETTE[number], linestyle=dashes[str(kind)], label=f"non-local, {kind}"
        )
    size = np.array([-slenderness_constant(e) for e in eps])
    first = CRITICAL * (1.0 - data.attrs["slope"] / size)
    ax.plot(
        eps, first, color=INK, linewidth=0.6, linestyle=(0, (6, 3)), label="first order in $1/c$"
    )
    ax.set_xscale("log")
    ax.set(xlabel=r"$\varepsilon$", ylabel=r"critical $\eta=\bar\mu/(-c)$", ylim=(128.0, 156.0))
    ax.legend(loc="lower left")


def _draw_growth(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import FAINT, PALETTE

    names = {"local_drag": "local drag", "nonlocal": rf"non-local, $\varepsilon={MEASURED_EPS:g}$"}
    ax.axhline(0.0, color=FAINT, linewidth=0.5, zorder=0)
    for number, kind in enumerate(data["mobility"].to_numpy()):
        one, colour = data.sel(mobility=kind), PALETTE[1 - number]
        ax.plot(one["eta"], one["growth"], color=colour, label=names[str(kind)])
        ax.plot(
            one["eta_of_runs"],
            one["growth_of_runs"],
            "o",
            color=colour,
            markerfacecolor="white",
            markersize=3.4,
            label="runs" if number else None,
        )
    ax.set_xscale("log")
    ax.set_xticks([100, 200, 400, 1000], ["100", "200", "400", "1000"])
    ax.set(
        xlabel=r"$\eta=\bar\mu/(-c)$", ylabel="growth rate / rate of extension", ylim=(-4.0, 3.2)
    )
    ax.legend(loc="lower right")


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare with the published thresholds, growth rates and runs."""
    local = float(data["local_threshold"][0])
    rows = [
        Row(
            "critical eta, planar extension, local drag",
            local,
            CRITICAL,
            CRITICAL - 1e-4,
            CRITICAL + 1e-4,
            "Becker & Shelley 2001.",
        ),
        Row(
            "critical eta, simple shear, fiber frozen at 45 degrees, local drag",
            2.0 * local,
            306.40486,
            306.40486 - 2e-4,
            306.40486 + 2e-4,
            "Shear compresses at half its rate; the same eigenproblem. Du Roure et al. 2019.",
        ),
    ]
    for eta, ours in zip(GROWTH, data["listed_growth"].to_numpy(), strict=True):
        listed = GROWTH[eta]
        quantity = f"growth rate, local drag, eta = {eta:g}"
        rows.append(Row(quantity, float(ours), listed, listed - 2e-6, listed + 2e-6))
    apart = abs(data["growth_of_runs"] - data["growth_expected"]).max("eta_of_runs")
    for kind in data["mobility"].to_numpy():
        quantity = f"largest difference of growth rates, runs and eigenvalues, {kind}"
        rows.append(Row(quantity, float(apart.sel(mobility=kind)), high=2e-4))
    for eps in _TABLED:
        one = data["threshold"].sel(mode=1).sel(eps=eps, method="nearest")
        spread = float(one.max() - one.min())
        rows.append(
            Row(
                f"critical eta, planar extension, non-local, eps = {eps:.3g}",
                float(one.sel(regularization="spheroidal")),
                note=f"The choice of delta(s) changes it by {spread:.2g}.",
            )
        )
    slope = float(data.attrs["slope"])
    return [*rows, Row("k of critical eta = 153.2 (1 - k / (-c)), eps to 0", slope)]
