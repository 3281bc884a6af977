"""Dilute fibers in oscillating shear: G', G'' and the energy they store.

The strain is gamma_0 sin(omega t), the stress that of fibers that do not feel each other, averaged
over directions by a rule that is exact to degree 9. From the last cycle, of length T,

    G' = 2 / (gamma_0 T) int sigma_xy sin(omega t) dt,   G'' = 2 / (gamma_0 T) int sigma_xy cos dt.

A straight inextensible fiber stores nothing: as gamma_0 vanishes G' = 0, and isotropic fibers give
``G'' = omega n 8 pi mu L^3 / (360 (c - 2))``, c = -log(eps^2 e). Bends turn that into elasticity.
All is for one fiber per volume, in units of 8 pi mu omega L^3; mu_bar has omega for its rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array, Points
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.fiber.curves import Curve, scaled
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import TimeDependentShear
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import simulate
from stokesfibers.slender.mobility import slenderness_constant

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EPS = 1e-2
LINEAR = 1.0 / (360.0 * (-slenderness_constant(EPS) - 2.0))
"""G'' / omega of isotropic straight fibers as gamma_0 vanishes, over n 8 pi mu L^3."""
_RTOL = 1e-4
_BEND = 1e-3  # largest deflection at the start, over the length
_SAMPLES = 128  # of the stress in a cycle
_PARTS = ("storage", "loss", "third", "stored")


def directions() -> tuple[Array, Array]:
    """Return axes (16, 3) and weights (16,) that average even polynomials to degree 8 exactly.

    The vertices of an icosahedron and of its dodecahedron with weights 5/84 and 9/140 (McLaren
    1963), turned so that none lies in a plane of the flow.
    """
    g = 0.5 * (1.0 + 5.0**0.5)
    icosahedron = [(0.0, s, g) for s in (1.0, -1.0)]
    dodecahedron = [(0.0, s * g, 1.0 / g) for s in (1.0, -1.0)]
    turned = [np.roll(v, k) for v in (*icosahedron, *dodecahedron) for k in range(3)]
    cube = [(1.0, s, t) for s in (1.0, -1.0) for t in (1.0, -1.0)]
    axes = np.array([*turned[:6], *turned[6:], *cube])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    q, _ = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))
    return axes @ q.T, np.array([5.0 / 84.0] * 6 + [9.0 / 140.0] * 10)


def run(settings: Settings) -> xr.Dataset:
    """Return moduli, third harmonics and stored energy. Takes ten minutes in full."""
    strains = (0.05, 2.0) if settings.quick else (0.05, 0.25, 0.5, 1.0, 2.0, 4.0)
    mu_bars = (1e5,) if settings.quick else (1e2, 1e3, 1e4, 1e5)
    cycles = 1 if settings.quick else 3
    axes, weights = directions()
    found = np.empty((len(_PARTS), len(mu_bars), len(strains)))
    series = np.empty((len(mu_bars), len(strains), _SAMPLES + 1))
    for i, mu_bar in enumerate(mu_bars):
        for j, strain in enumerate(strains):
            if settings.progress is not None:
                share = (i + j / len(strains)) / len(mu_bars)
                settings.progress(f"mu_bar = {mu_bar:g}, strain = {strain:g}", share)
            each = [_cycle(mu_bar, strain, axis, cycles) for axis in axes]
            stress, energy = np.tensordot(weights, np.array(each), axes=1)
            found[:, i, j] = moduli(stress, energy, strain)
            series[i, j] = stress
    dims = ("mu_bar", "strain")
    return xr.Dataset(
        {
            **{name: (dims, found[k]) for k, name in enumerate(_PARTS)},
            "stress": ((*dims, "phase"), series),
        },
        coords={
            "mu_bar": list(mu_bars),
            "strain": list(strains),
            "phase": np.linspace(0.0, 2.0 * pi, _SAMPLES + 1),
        },
        attrs={"quick": int(settings.quick), "cycles": cycles},
    )


def _cycle(mu_bar: float, strain: float, axis: Array, cycles: int) -> Array:
    """Return shear stress and elastic energy over mu_bar in the last cycle, (2, sample)."""
    fiber = Fiber(slenderness=EPS)
    problem = Problem(
        fiber,
        mu_bar=mu_bar,
        flow=TimeDependentShear(lambda t: strain * float(np.cos(t)), scale=strain),
        engine=SpectralEngine(rtol=_RTOL),
    )
    every = 2.0 * pi / _SAMPLES
    until = 2.0 * pi * cycles
    record = Schedule(until, every)
    result = simulate(problem, _bent(fiber, axis), until=until, record=record, threads=1)
    if result.status.code == "interrupted":
        raise KeyboardInterrupt
    if not result.status.ok:  # it bends within its own thickness, where the theory ends
        return np.full((2, _SAMPLES + 1), np.nan)
    observed = result.data["observables"].to_dataset().isel(time=slice(-_SAMPLES - 1, None))
    stress = observed["shear_stress"].to_numpy()
    energy = observed["elastic_energy"].to_numpy()[:, 0]
    return np.stack([stress, energy]) / mu_bar


def _bent(fiber: Fiber, axis: Array) -> Curve:
    """Return a slightly bent fiber along `axis`; the bend has no symmetry."""
    across = np.cross(axis, np.roll(axis, 1))
    across *= 256.0 * _BEND / np.linalg.norm(across)

    def position(alpha: Array) -> Points:
        bump = (alpha * (1.0 - alpha)) ** 4 * (1.0 + alpha)
        return (alpha - 0.5)[:, None] * axis + bump[:, None] * across

    def tangent(alpha: Array) -> Points:
        inside = alpha * (1.0 - alpha)
        slope = inside**3 * (4.0 * (1.0 - 2.0 * alpha) * (1.0 + alpha) + inside)
        return axis + slope[:, None] * across

    return scaled(Curve(position, tangent), fiber)


def moduli(stress: Array, energy: Array, strain: float) -> tuple[float, float, float, float]:
    """Return G', G'', the third harmonic over the first, and the stored share of the energy.

    `stress` and `energy` are of a whole cycle, both ends included, from zero strain on. The share
    is the swing of the elastic energy over what the cycle dissipates, ``pi gamma_0^2 G''``.
    """
    harmonics = 2.0 * np.fft.rfft(stress[:-1]) / (len(stress) - 1)
    storage, loss = -harmonics[1].imag / strain, harmonics[1].real / strain
    third = abs(harmonics[3]) / abs(harmonics[1])
    return storage, loss, third, float(np.ptp(energy)) / (pi * strain**2 * loss)


def figure(data: xr.Dataset) -> Figure:
    """Draw the moduli against the strain, and the stored share of the energy."""
    from stokesfibers.plot.style import FAINT, PAGE, PALETTE, new_panels, style

    axes = new_panels(1, 3, width=PAGE, height=2.4)[0]
    with style():
        for number, mu_bar in enumerate(data["mu_bar"].to_numpy()):
            one, colour = data.sel(mu_bar=mu_bar), PALETTE[number]
            label = rf"$\bar\mu_\omega=10^{{{np.log10(mu_bar):.0f}}}$"
            options = {"color": colour, "markersize": 3.0, "label": label, "linewidth": 0.8}
            axes[0].plot(one["strain"], one["loss"] / LINEAR, "o-", **options)
            axes[1].plot(one["strain"], one["storage"] / LINEAR, "o-", **options)
            axes[2].plot(one["strain"], one["stored"], "o-", **options)
        axes[0].axhline(1.0, color=FAINT, linewidth=0.6, zorder=0)
        axes[1].axhline(0.0, color=FAINT, linewidth=0.6, zorder=0)
        _label(axes)
    return axes[0].figure


def _label(axes: Sequence[Axes]) -> None:
    names = (r"$G''$ / its linear limit", r"$G'$ / linear limit of $G''$")
    for ax, name in zip(axes, (*names, "stored share of the energy"), strict=True):
        ax.set(xscale="log", xlabel=r"$\gamma_0$", ylabel=name)
    axes[2].set_yscale("log")
    axes[0].legend(fontsize=6.5)


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare the linear limit with its exact answer; state the rest."""
    rows = []
    for mu_bar in data["mu_bar"].to_numpy():
        one = data.sel(mu_bar=mu_bar)
        linear, where = one.isel(strain=0), f"mu_bar = {mu_bar:g}"
        at = f"gamma_0 = {float(linear['strain']):g}, {where}"
        loss, storage = float(linear["loss"]) / LINEAR, float(linear["storage"]) / LINEAR
        exact = "Straight isotropic fibers, in closed form."
        rows.append(Row(f"G'' over its linear limit, {at}", loss, 1.0, 0.99, 1.01, exact))
        rows.append(Row(f"G' over the limit of G'', {at}", storage, 0.0, -0.01, 0.01, exact))
        for strain in data["strain"].to_numpy()[1:]:
            held = one.sel(strain=strain)
            at = f"gamma_0 = {strain:g}, {where}"
            for name, quantity in (("storage", "G'"), ("loss", "G''")):
                value = float(held[name]) / LINEAR
                rows.append(Row(f"{quantity} over the limit of G'', {at}", value))
            rows.append(Row(f"third harmonic over the first, {at}", float(held["third"])))
            rows.append(Row(f"stored share of the energy, {at}", float(held["stored"])))
    return rows
