"""A slightly bent fiber straightens at rest: eigenvalues of the free beam, rates of runs."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from stokesfibers.core.arrays import Array
from stokesfibers.experiments.base import Settings
from stokesfibers.experiments.linearised import linearised, straight_fiber
from stokesfibers.flow import NoFlow
from stokesfibers.numerics.step_control import AdaptiveSteps
from stokesfibers.slender.mobility import (
    AbstractMobility,
    LocalDrag,
    NonLocal,
    slenderness_constant,
)
from stokesfibers.slender.regularization import SpheroidalRegularization
from stokesfibers.stepping.spectral import SpectralStepper
from stokesfibers.study.validation.record import Entry, Finding, close

BETA = (4.730040744862704, 7.853204624095838, 10.995607838001671)
"""Roots of cos(beta) cosh(beta) = 1: the free-free beam."""
_EPS, _NODES = 1e-2, 32
_VANISHING = 1e-16  # slenderness at which terms in 1/c^2 are left out
NON_LOCAL = NonLocal(SpheroidalRegularization())


def beam_mode(n: int, s: Array) -> Array:
    """Return the n-th free-free eigenfunction of y_ssss = beta^4 y on [0, 1]."""
    b = BETA[n - 1]
    sigma = (np.cosh(b) - np.cos(b)) / (np.sinh(b) - np.sin(b))
    # cosh - sigma sinh in a form that does not cancel at s = 1
    steep = 0.5 * (1.0 + sigma) * np.exp(-b * s) + 0.5 * (1.0 - sigma) * np.exp(b * s)
    shape = steep + np.cos(b * s) - sigma * np.sin(b * s)
    return np.asarray(shape, dtype=np.float64)


@cache
def rates(mobility: AbstractMobility, eps: float) -> Array:
    """Return the decay rates of a fiber at rest times 8 pi mu L^4 / (-c E), the slowest first."""
    bending, _ = linearised(straight_fiber(mobility, eps, _NODES))
    values = np.real(np.linalg.eigvals(-bending)) / -slenderness_constant(eps)
    return np.sort(np.asarray(values, dtype=np.float64))


def first_correction(n: int) -> float:
    """Return k of rate = beta^4 (1 + k / (-c) + ...): the mean of 2 + S_0 over the mode.

    S_0 is that of (B.3), whose eigenfunctions are Legendre polynomials, with -lambda_n of (B.5).
    """
    alpha, weight = legendre.leggauss(60)
    degree = np.arange(40)
    norm = 2.0 / (2.0 * degree + 1.0)
    mode = beam_mode(n, 0.5 * (alpha + 1.0))
    series = (weight * mode) @ legendre.legvander(alpha, 39) / norm
    harmonic = 2.0 * np.concatenate([[0.0], np.cumsum(1.0 / degree[1:])])
    return 2.0 - float(np.sum(harmonic * series**2 * norm) / np.sum(series**2 * norm))


def measured_rate(n: int) -> float:
    """Return the decay rate of mode n of a run with local drag, in the units of `rates`."""
    fiber = straight_fiber(LocalDrag(), _EPS, _NODES)
    drag = -slenderness_constant(_EPS)
    stepper = SpectralStepper(
        (fiber,), drag=drag, flow=NoFlow(), control=AdaptiveSteps(1e-7), threads=1
    )

    def bent(sigma: Array) -> Array:
        deflection = 1e-6 * beam_mode(n, sigma)
        return np.stack([sigma - 0.5, 0.6 * deflection, 0.8 * deflection], axis=-1)

    carry = stepper.init((bent,))
    mode, times, sizes = beam_mode(n, fiber.sigma), np.array([0.5, 1.5]) / BETA[n - 1] ** 4, []
    for t in times:
        while carry.time < t:
            carry, _ = stepper.step(carry)
        modes = stepper.interpolate(carry, float(t)).modes[0]
        bend = fiber.position(modes, fiber.sigma, 2)
        sizes.append(float((0.6 * bend[1] + 0.8 * bend[2]) * mode @ fiber.quadrature))
    return float(np.log(sizes[0] / sizes[1]) / (times[1] - times[0]))


def _relaxation(_: Settings) -> Iterator[Finding]:
    found = rates(LocalDrag(), _EPS)
    for n, beta in enumerate(BETA, start=1):
        yield close(
            f"eigenvalue {n} of the free-free beam, beta^4", found[n - 1], beta**4, rtol=1e-8
        )
    for n in (1, 2):
        quantity = f"decay rate of mode {n} of a run, local drag"
        yield close(quantity, measured_rate(n), BETA[n - 1] ** 4, rtol=1e-6)


def _non_local_rate(_: Settings) -> Iterator[Finding]:
    size = -slenderness_constant(_VANISHING)
    for n in (1, 2):
        ratio = rates(NON_LOCAL, _VANISHING)[n - 1] / rates(LocalDrag(), _VANISHING)[n - 1]
        quantity = f"non-local correction of the rate of mode {n}, times -c, eps = 1e-16"
        yield close(quantity, (ratio - 1.0) * size, first_correction(n), rtol=1e-3)


ENTRIES = (
    Entry("beam", "exact", "A bent fiber straightens at rest", "free-free beam", _relaxation),
    Entry(
        "beam-non-local",
        "independent",
        "The same with the non-local operator",
        "Legendre series",
        _non_local_rate,
    ),
)
