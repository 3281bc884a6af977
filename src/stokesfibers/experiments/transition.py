"""The buckling transition in shear: what N_1 a fiber leaves per half turn, local drag or not.

Becker & Shelley (2001) found with local drag that N_1 sets in where a fiber buckles; the paper's
last section leaves open what non-local forces change. A nearly straight fiber turns over once from
-W to W about the vertical. A straight one is compressed before it and pulled after it, where N_1 is
mostly negative and mostly positive, as much:

    int N_1 dt = 0,    int_0^W N_1 dt = 8 pi mu rate L^3 / (48 c_1) [ln(1 + W^2) + 2/(1 + W^2) - 2]

with c_1 = -log(eps^2 e) for local drag and 2 less with the non-local operator, whose eigenvalue for
a force linear in s is -2, (B.5). What buckling leaves is given in units of this lobe.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.fiber.initial import NearlyStraight
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import simulate
from stokesfibers.slender.mobility import (
    AbstractMobility,
    LocalDrag,
    NonLocal,
    slenderness_constant,
)
from stokesfibers.slender.regularization import SpheroidalRegularization

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SPAN = 20.0
"""W, in units of 1 / rate."""
ONSET = 1e-2
"""N_1 of a half turn, over the straight fiber's lobe, that counts as the transition."""
_NON_LOCAL = NonLocal(SpheroidalRegularization())
_MODELS: dict[str, tuple[AbstractMobility, float]] = {
    "local drag, eps = 0.01": (LocalDrag(), 1e-2),
    "non-local, eps = 0.01": (_NON_LOCAL, 1e-2),
    "local drag, eps = 0.001": (LocalDrag(), 1e-3),
    "non-local, eps = 0.001": (_NON_LOCAL, 1e-3),
}
_AMPLITUDE = -1e-4
_COMPARED = tuple(_MODELS)[:2]
_EARLIER = 4.9  # a run starts this much before -W, so that what it starts with has decayed
_OBSERVE = 0.05
_RTOL, _FINER = 1e-4, 1e-5
_LEAST = 1e-3  # of the lobe: below, what is left of N_1 is the start's


@dataclass(frozen=True)
class _Turn:
    """What one half turn leaves: the integral of N_1, that of its later half, the energy's peak."""

    integral: float
    lobe: float
    energy: float


def run(settings: Settings) -> xr.Dataset:
    """Return N_1 of half turns against eta by model, and by amplitude. Takes five minutes."""
    eta = np.array([100.0, 1e4, 3e4, 1e5]) if settings.quick else np.logspace(1.5, 5.25, 46)
    amplitudes = [1e-4] if settings.quick else [1e-2, 1e-3, 1e-4, 1e-5, 1e-6]
    models = _COMPARED if settings.quick else tuple(_MODELS)
    tasks = _Told(settings, len(models) + len(_COMPARED) * (len(amplitudes) + 1))
    found = [[_turn(model, e) for e in eta] for model in tasks.each(models)]
    onsets = []
    for model in _COMPARED:
        row = []
        for d in tasks.each(amplitudes):
            turns = [_turn(model, e, amplitude=-d) for e in eta]
            row.append(onset(eta, np.array([t.integral for t in turns]) / _lobe(model)))
        onsets.append(row)
    checked = eta[2::8]
    finer = [[_turn(m, e, rtol=_FINER).integral for e in checked] for m in tasks.each(_COMPARED)]
    names = ("integral", "lobe", "energy")
    axes = ("model", "eta")
    return xr.Dataset(
        {
            **{n: (axes, [[getattr(one, n) for one in row] for row in found]) for n in names},
            "finer": (("compared", "eta_checked"), finer),
            "straight": (("model",), [_lobe(model) for model in models]),
            "onset": (("compared", "amplitude"), onsets),
        },
        coords={
            "model": list(models),
            "eta": eta,
            "eta_checked": checked,
            "compared": list(_COMPARED),
            "amplitude": amplitudes,
        },
        attrs={"quick": int(settings.quick)},
    )


class _Told:
    """Tells how far the experiment is."""

    def __init__(self, settings: Settings, parts: int) -> None:
        self._settings, self._parts, self._done = settings, parts, 0

    def each(self, things: Iterable[Any]) -> Iterator[Any]:
        """Yield things, each a part of the work."""
        for thing in things:
            if self._settings.progress is not None:
                self._settings.progress(f"half turns, {thing}", min(1.0, self._done / self._parts))
            self._done += 1
            yield thing


@cache
def _turn(model: str, eta: float, *, amplitude: float = _AMPLITUDE, rtol: float = _RTOL) -> _Turn:
    """Return N_1 / (8 pi mu rate L^3) of a half turn; eta = mu_bar / (-c)."""
    mobility, eps = _MODELS[model]
    fiber = Fiber(slenderness=eps)
    mu_bar = -eta * slenderness_constant(eps)
    problem = Problem(
        fiber,
        mu_bar=mu_bar,
        flow=Shear(1.0),
        mobility=mobility,
        engine=SpectralEngine(rtol=rtol),
    )
    vertical = SPAN + _EARLIER
    start = NearlyStraight(angle=np.pi - np.arctan2(1.0, vertical), amplitude=amplitude)
    result = simulate(
        problem,
        start.curves((fiber,), problem.domain.lengths),
        until=vertical + SPAN,
        record=Schedule(vertical + SPAN, _OBSERVE),
    )
    if result.status.code == "interrupted":
        raise KeyboardInterrupt
    if not result.status.ok:  # it bends within its own thickness, where the theory ends
        return _Turn(np.nan, np.nan, np.nan)
    observed = result.data["observables"].to_dataset()
    time = observed["time"].to_numpy() - vertical
    n1 = observed["first_normal_stress_difference"].to_numpy() / mu_bar
    within, after = time >= -SPAN - 1e-9, time >= -1e-9
    return _Turn(
        float(np.trapezoid(n1[within], time[within])),
        float(np.trapezoid(n1[after], time[after])),
        float(observed["elastic_energy"].max()),
    )


def _lobe(model: str) -> float:
    """Return int_0^W N_1 dt of a straight fiber over 8 pi mu rate L^3."""
    mobility, eps = _MODELS[model]
    c = -slenderness_constant(eps) - (2.0 if isinstance(mobility, NonLocal) else 0.0)
    square = 1.0 + SPAN**2
    return (np.log(square) + 2.0 / square - 2.0) / (48.0 * c)


def onset(eta: Array, share: Array) -> float:
    """Return eta where `share` last passes `ONSET` upwards, interpolated in logarithms."""
    below = np.flatnonzero(share < ONSET)
    if not below.size or below[-1] + 1 >= eta.size:
        return float("nan")
    k = int(below[-1])
    low, high = np.log(np.maximum(share[k : k + 2], 1e-12))
    part = (np.log(ONSET) - low) / (high - low)
    return float(eta[k] * (eta[k + 1] / eta[k]) ** part)


def growth(eta: Array, share: Array) -> tuple[float, float]:
    """Return d log share / d log eta over the last half decade, and the share at the end."""
    eta, share = eta[np.isfinite(share)], share[np.isfinite(share)]
    count = max(2, int(np.sum(eta >= eta[-1] / 10.0**0.5 * (1.0 - 1e-9))))
    late = slice(-count, None)
    return float(np.polyfit(np.log(eta[late]), np.log(share[late]), 1)[0]), float(share[-1])


def figure(data: xr.Dataset) -> Figure:
    """Draw N_1 of a half turn and the peak of the energy against eta, and where they set in."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(1, 3, width=PAGE, height=2.5)[0]
    with style():
        _draw_turns(axes[0], data)
        _draw_energy(axes[1], data)
        _draw_onsets(axes[2], data)
    return axes[0].figure


def _lines(data: xr.Dataset) -> Iterator[tuple[str, str, Any]]:
    from stokesfibers.plot.style import PALETTE

    for number, model in enumerate(data["model"].to_numpy()):
        yield str(model), PALETTE[number // 2], "-" if number % 2 else (0, (3, 1.5))


def _draw_turns(ax: Axes, data: xr.Dataset) -> None:
    eta = data["eta"].to_numpy()
    for model, colour, dash in _lines(data):
        one = data.sel(model=model)
        share = (one["integral"] / one["straight"]).to_numpy()
        ax.plot(
            eta,
            np.where(share > _LEAST, share, np.nan),
            color=colour,
            linestyle=dash,
            label=model.replace("eps = ", r"$\varepsilon=$"),
        )
    ax.set(
        xscale="log",
        yscale="log",
        xlabel=r"$\eta=\bar\mu/(-c)$",
        ylabel=r"$\int N_1\,\mathrm{d}t$ / lobe of the straight fiber",
        xlim=(1e3, 3e5),
        ylim=(_LEAST, 1.0),
    )
    ax.legend(loc="upper left", fontsize=6.5)


def _draw_energy(ax: Axes, data: xr.Dataset) -> None:
    for model, colour, dash in _lines(data):
        ax.plot(data["eta"], data["energy"].sel(model=model), color=colour, linestyle=dash)
    ax.set(
        xscale="log",
        yscale="log",
        xlabel=r"$\eta=\bar\mu/(-c)$",
        ylabel="largest elastic energy $L/E$",
        ylim=(1e-11, 3e3),
    )


def _draw_onsets(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import PALETTE

    for number, model in enumerate(data["compared"].to_numpy()):
        ax.plot(
            data["amplitude"],
            data["onset"].sel(compared=model),
            "o-" if number else "o--",
            color=PALETTE[0],
            markersize=3.0,
            markerfacecolor="white",
            label=str(model).replace("eps = ", r"$\varepsilon=$"),
        )
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="$d_y$ of the initial shape (47)",
        ylabel=rf"$\eta$ where $N_1$ reaches {ONSET:g} lobes",
    )
    ax.legend(loc="upper right", fontsize=6.5)


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare the straight limit with its exact answer; state transition and growth."""
    rows = []
    eta = data["eta"].to_numpy()
    for model in data["model"].to_numpy():
        one = data.sel(model=model)
        exact, name = float(one["straight"]), f"lobe of N_1 of the stiffest fiber, {model}"
        near = exact * 1e-3
        exactly = "A straight rod in closed form."
        rows.append(Row(name, float(one["lobe"][0]), exact, exact - near, exact + near, exactly))
        share = (one["integral"] / exact).to_numpy()
        left = f"what it leaves, over the lobe, {model}"
        rows.append(Row(left, float(share[0]), 0.0, -_LEAST, _LEAST, "Nothing, if straight."))
        slope, last = growth(eta, share)
        followed = float(eta[np.isfinite(share)][-1])
        ends = "Beyond it the fiber bends within its own thickness, or the study ends."
        rows.append(Row(f"largest eta followed, {model}", followed, note=ends))
        rows.append(Row(f"N_1 left there, over the lobe, {model}", last, low=0.0))
        rows.append(Row(f"its growth exponent with mu_bar there, {model}", slope))
    for model in data["compared"].to_numpy():
        coarse = data["integral"].sel(model=model).interp(eta=data["eta_checked"])
        apart = abs(data["finer"].sel(compared=model) - coarse).max() / abs(coarse).max()
        told = f"rtol = {_FINER:g} against {_RTOL:g}."
        rows.append(Row(f"error of the integrals, {model}", float(apart), high=1e-2, note=told))
        for amplitude, at in zip(
            data["amplitude"].to_numpy(), data["onset"].sel(compared=model).to_numpy(), strict=True
        ):
            rows.append(Row(f"eta of the transition, d_y = {amplitude:g}, {model}", float(at)))
    return rows
