"""Buckling of a compressed fiber with local drag: growth rates and thresholds (case A2).

With tension T = (mu_bar / (-c)) (s^2 - 1/4) / 4 along the compressive axis of planar extension,
a small deflection y obeys y_t = p y + s y_s + (s^2 - 1/4) y_ss / 4 - y_ssss / eta, p = 1 within the
plane of the flow and 0 across it, with eta = mu_bar / (-c) and y_ss = y_sss = 0 at the ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.polynomial import Legendre, Polynomial
from scipy.optimize import brentq

import stokesfibers as sf
from stokesfibers.core.arrays import Array
from stokesfibers.flow import AbstractFlow
from stokesfibers.slender.mobility import slenderness_constant
from support import advance, assert_order

EPS = 1e-2
GROWTH = {100.0: -1.735612, 200.0: 0.762085, 400.0: 2.002340, 1000.0: 2.709680}
CRITICAL = 153.20243


def leading_mode(eta: float, count: int = 18) -> tuple[float, Polynomial]:
    """Return growth rate and deflection of the leading mode within the plane, by collocation.

    The curvature is (1 - a^2)^2 times a polynomial in a = 2 s, s in [-1/2, 1/2]: the end conditions
    hold identically and rigid motions drop out.
    """
    at, _ = np.polynomial.legendre.leggauss(count)
    clamp = Polynomial([1.0, 0.0, -1.0]) ** 2
    s, tension = Polynomial([0.0, 0.5]), Polynomial([-1.0, 0.0, 1.0]) / 16.0
    basis = [clamp * Legendre.basis(k).convert(kind=Polynomial) for k in range(count)]
    # The equation differentiated twice, z = y_ss, d/ds = 2 d/da.
    moved = [
        3.0 * z + 2.0 * s * z.deriv() + 4.0 * (tension * z).deriv(2) - 16.0 * z.deriv(4) / eta
        for z in basis
    ]
    left, right = (np.array([p(at) for p in polys]).T for polys in (basis, moved))
    rates, vectors = np.linalg.eig(np.linalg.solve(left, right))
    lead = int(np.argmax(rates.real))
    curvature = sum((c * z for c, z in zip(vectors[:, lead].real, basis, strict=True)), 0.0 * s)
    return float(rates[lead].real), curvature.integ(2, lbnd=0) / 4.0


@dataclass(frozen=True)
class Compression:
    """A steady flow that compresses along `axis` at `rate`, and the direction to deflect in."""

    flow: AbstractFlow
    axis: Array
    across: Array
    rate: float = 1.0


EXTENSION = Compression(sf.PlanarExtension(rate=1.0), np.eye(3)[1], np.eye(3)[0])


def measured_growth(eta: float, intervals: int, setting: Compression = EXTENSION) -> float:
    """Return the growth rate of the curvature between t rate = 0.2 and 0.4 of a run."""
    _, deflection = leading_mode(eta * setting.rate)
    places = np.linspace(-0.5, 0.5, intervals + 1)
    y = deflection(2.0 * places)
    x = np.outer(setting.axis, places) + np.outer(setting.across, 1e-5 * y / np.abs(y).max())
    dt = 0.2 / (intervals * setting.rate)
    case = sf.Problem(
        sf.Fiber(slenderness=EPS),
        mu_bar=-eta * slenderness_constant(EPS),
        flow=setting.flow,
        mobility=sf.LocalDrag(),
        engine=sf.PaperEngine(intervals=intervals, dt=dt, beta=20.0 * setting.rate),
    )
    sizes = []
    for steps in (intervals, 2 * intervals):
        stepper, carry = advance(case, x, steps)
        curvature = stepper.fibers[0].shape(carry.x[0]).xss
        sizes.append(setting.across @ curvature[:, intervals // 2])
    return float(np.log(sizes[1] / sizes[0]) / (dt * intervals))


def measured_threshold(
    guess: float, width: float, intervals: int, setting: Compression = EXTENSION
) -> float:
    """Return the eta of zero growth by a parabola through three runs; it must be bracketed."""
    etas = guess + width * np.array([-1.0, 0.0, 1.0])
    rates = np.array([measured_growth(eta, intervals, setting) for eta in etas])
    assert rates[0] < 0.0 < rates[2], rates
    return float(np.polyfit(rates, etas, 2)[-1])


@pytest.mark.parametrize(("eta", "rate"), GROWTH.items())
def test_listed_growth_rates_solve_the_eigenproblem(eta, rate):
    assert leading_mode(eta)[0] == pytest.approx(rate, abs=1e-6)


def test_listed_threshold_solves_the_eigenproblem():
    found = brentq(lambda eta: leading_mode(eta)[0], 150.0, 156.0, xtol=1e-7)
    assert found == pytest.approx(CRITICAL, abs=2e-5)


@pytest.mark.parametrize(
    ("eta", "between", "final"),
    [
        (100.0, (1.9, 2.4), 1.6e-2),
        (200.0, (3.0, 4.5), 6e-4),  # the coefficient of h^2 nearly vanishes here
        (400.0, (1.8, 2.1), 7e-3),
        (1000.0, (1.9, 2.2), 9e-3),
    ],
)
def test_runs_grow_at_the_listed_rates(eta, between, final):
    errors = [abs(measured_growth(eta, n) - GROWTH[eta]) for n in (20, 40, 80)]
    assert_order(errors, between=between, final=final)


def test_growth_across_the_plane_is_slower_by_the_rate():
    across = Compression(EXTENSION.flow, EXTENSION.axis, np.eye(3)[2])
    difference = measured_growth(200.0, 40) - measured_growth(200.0, 40, across)
    assert difference == pytest.approx(1.0, abs=2e-4)


def test_threshold_in_planar_extension():
    found = [measured_threshold(153.0, 8.0, n) for n in (40, 80)]
    assert found[1] == pytest.approx(CRITICAL, abs=0.3)
    # With the leading error removed
    assert found[1] - (found[0] - found[1]) / 3.0 == pytest.approx(CRITICAL, abs=0.15)


def test_threshold_of_a_fiber_frozen_at_45_degrees_in_shear():
    """Shear without its rotation compresses at half its rate along 135 degrees: twice the eta."""

    def without_rotation(x, t):  # noqa: ARG001
        return 0.5 * np.stack([x[:, 1], x[:, 0], 0.0 * x[:, 2]], axis=1)

    frozen = Compression(
        sf.UserFlow(without_rotation),
        np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0),
        np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0),
        rate=0.5,
    )
    found = measured_threshold(2.0 * 153.0, 16.0, 80, frozen)
    assert found == pytest.approx(306.40486, abs=0.6)


@pytest.mark.slow
def test_threshold_converges_at_second_order():
    errors = [abs(measured_threshold(153.0, 8.0, n) - CRITICAL) for n in (40, 80, 160)]
    assert_order(errors, between=(1.9, 2.5), final=0.06)
