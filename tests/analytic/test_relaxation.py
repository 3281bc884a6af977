"""A bent fiber at rest straightens: decay rates of the free-free modes (validation case A1)."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import legendre

import stokesfibers as sf
from stokesfibers.slender.mobility import slenderness_constant
from support import advance, assert_order

BETA = (4.730040744862704, 7.853204624095838, 10.995607838001671)
AMPLITUDE = 1e-4


def mode(n: int, s: np.ndarray) -> np.ndarray:
    """Return the n-th free-free eigenfunction of y_ssss = beta^4 y on [0, 1], at most 2 in size."""
    b = BETA[n - 1]
    sigma = (np.cosh(b) - np.cos(b)) / (np.sinh(b) - np.sin(b))
    # cosh - sigma sinh in a form that does not cancel at s = 1
    decaying = 0.5 * (1.0 + sigma) * np.exp(-b * s) + 0.5 * (1.0 - sigma) * np.exp(b * s)
    return decaying + np.cos(b * s) - sigma * np.sin(b * s)


def measured_rate(mobility, n: int, intervals: int, *, eps: float = 1e-2) -> float:
    """Return the decay rate of mode n times zeta L^4 / E, zeta = 8 pi mu / (-c), from a run.

    The rate is that of the curvature at mid-length, or at the largest value of the mode's,
    between 1/4 and 3/4 of the run; steps are the grid's, so that the order is the scheme's.
    """
    expected = BETA[n - 1] ** 4
    steps = 2 * intervals
    dt = 1.5 / (expected * steps)
    case = sf.Problem(
        sf.Fiber(slenderness=eps),
        mu_bar=-slenderness_constant(eps),
        mobility=mobility,
        engine=sf.PaperEngine(intervals=intervals, dt=dt, beta=1.0),
    )
    s = np.linspace(0.0, 1.0, intervals + 1)
    shape = mode(n, s)
    x = np.stack([s - 0.5, AMPLITUDE * 0.6 * shape, AMPLITUDE * 0.8 * shape])
    sizes = []
    for count in (steps // 2, steps):
        stepper, carry = advance(case, x, count)
        curved = stepper.fibers[0].shape(carry.x[0]).xss
        weight = stepper.fibers[0].grid.weights * shape
        sizes.append(0.6 * curved[1] @ weight + 0.8 * curved[2] @ weight)
    return float(np.log(sizes[0] / sizes[1]) / (dt * (steps - steps // 2)))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_local_drag_decays_at_the_rate_of_the_beam(n):
    exact = BETA[n - 1] ** 4
    if n == 1:
        assert exact == pytest.approx(500.564, abs=1e-3)
    assert mode(n, np.array([0.0])) == pytest.approx(2.0, rel=1e-12)
    errors = [abs(measured_rate(sf.LocalDrag(), n, k) / exact - 1.0) for k in (20, 40, 80)]
    assert_order(errors, between=(1.95, 2.35), final=(6e-3, 1e-2, 1.2e-2)[n - 1])


def first_order_correction(n: int) -> float:
    """Return k in rate = local rate (1 + k / (-c) + ...), independently of the package.

    Across a straight fiber Lambda + K_0 = -c + 2 + S_0, with S_0 P_m = -lambda_m P_m; to first
    order in 1/c the rate changes by the mean of 2 + S_0 over the mode.
    """
    alpha, w = legendre.leggauss(60)
    y = mode(n, 0.5 * (alpha + 1.0))
    degree = np.arange(40)
    norm = 2.0 / (2.0 * degree + 1.0)
    series = (legendre.legvander(alpha, 39) * (w * y)[:, None]).sum(axis=0) / norm
    harmonic = 2.0 * np.concatenate([[0.0], np.cumsum(1.0 / degree[1:])])
    return 2.0 - float(np.sum(harmonic * series**2 * norm) / np.sum(series**2 * norm))


@pytest.mark.parametrize("n", [1, 2])
def test_non_local_correction_of_the_rate_falls_as_one_over_c(n):
    correction = first_order_correction(n)

    def scaled(eps: float, intervals: int) -> float:
        bare = measured_rate(sf.LocalDrag(), n, intervals, eps=eps)
        ratio = measured_rate(sf.NonLocal(), n, intervals, eps=eps) / bare
        return (1.0 - ratio) * slenderness_constant(eps)

    # The same constant at very different eps, within what the grid and 1/c^2 leave.
    for eps in (1e-4, 1e-16):
        assert scaled(eps, 40) == pytest.approx(correction, rel=0.04)
    # In the limit of small eps the grid's error remains: second order towards the constant.
    errors = [abs(scaled(1e-16, k) / correction - 1.0) for k in (20, 40, 80)]
    assert_order(errors, between=(1.8, 2.1), final=(7e-3, 1.2e-2)[n - 1])
