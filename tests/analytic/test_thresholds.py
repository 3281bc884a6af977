"""The linearised fiber against published numbers, exact quadrature and runs (case A2)."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.linalg import eigvals

from stokesfibers.experiments.linearised import leading, linearised, straight_fiber, thresholds
from stokesfibers.experiments.thresholds import measured_growth
from stokesfibers.slender.mobility import LocalDrag, NonLocal, slenderness_constant
from stokesfibers.slender.regularization import PaperRegularization, SpheroidalRegularization
from support import assert_close

NON_LOCAL = NonLocal(SpheroidalRegularization())


@pytest.mark.parametrize("nodes", [14, 24, 40])
def test_threshold_with_local_drag(nodes):
    fiber = straight_fiber(LocalDrag(), 1e-2, nodes)
    eta = thresholds(fiber, 2) / -slenderness_constant(1e-2)
    assert eta[0] == pytest.approx(153.20243, abs=2e-5)
    assert eta[1] == pytest.approx(774.3885, abs=2e-3)


@pytest.mark.parametrize(
    ("eta", "rate"), [(100.0, -1.735612), (200.0, 0.762085), (400.0, 2.002340), (1e3, 2.709680)]
)
def test_growth_with_local_drag(eta, rate):
    fiber = straight_fiber(LocalDrag(), 1e-3, 20)
    assert leading(fiber, -eta * slenderness_constant(1e-3))[0] == pytest.approx(rate, abs=1e-6)


def bare_threshold(eps: float, count: int = 12) -> float:
    """Return the lowest eta without regularisation, in a way of its own.

    The deflection is a polynomial in a = 2 s - 1 whose curvature is (1 - a^2)^2 times another, and
    every finite-part integral is exact: on each side of a point its integrand is a polynomial.
    """
    size = -slenderness_constant(eps)
    points, _ = np.polynomial.legendre.leggauss(count + 2)
    half, weight = np.polynomial.legendre.leggauss(2 * count + 8)
    a = Polynomial([0.0, 1.0])
    pull = a / 4.0 / (size - 2.0)  # T_s / mu_bar: M' P_1 = 2 (-c - 2) P_1
    tension = (a * a - 1.0) / 16.0 / (size - 2.0)

    def finite_part(integrand, at):
        """Return the integral over s' of integrand(a') / |s - s'|, which vanishes at a' = a."""
        total = 0.0
        for end in (-1.0, 1.0):
            there = at + 0.5 * (end - at) * (half + 1.0)
            total += float(weight @ (integrand(there) / (half + 1.0)))
        return total

    def spread(g):
        return np.array([finite_part(lambda there, at=at: g(there) - g(at), at) for at in points])

    def tilted(y):
        slope, out = 2.0 * y.deriv(), []
        for at in points:

            def integrand(there, at=at):
                chord = 2.0 * (y(at) - y(there)) / (at - there)
                return chord * pull(there) - slope(at) * pull(at)

            out.append(finite_part(integrand, at) + (size - 2.0) * slope(at) * pull(at))
        return np.array(out)

    values, bending, compressing = [], [], []
    bends = [((1.0 - a * a) ** 2 * a**k).integ(2) for k in range(count)]
    for y in [Polynomial([1.0]), a, *bends]:
        fourth, tensile = 16.0 * y.deriv(4), 4.0 * (tension * y.deriv()).deriv()
        values.append(y(points))
        bending.append(-(2.0 + size) * fourth(points) - spread(fourth))
        compressing.append(y(points) + (2.0 + size) * tensile(points) + spread(tensile) + tilted(y))
    invert = np.linalg.inv(np.array(values).T)
    left, right = (invert @ np.array(m).T for m in (bending, compressing))
    assert_close(right[:2, :2], np.diag([1.0, 2.0]), atol=1e-9)  # moving and turning as a whole
    found = eigvals(left[2:, 2:], -right[2:, 2:])
    real = found[np.abs(found.imag) < 1e-8 * np.abs(found)].real
    return float(real[real > 0.0].min() / size)


@pytest.mark.parametrize(("eps", "apart"), [(1e-2, 0.1), (1e-3, 1e-3), (1e-4, 1e-5)])
def test_threshold_of_the_bare_operator(eps, apart):
    """The regularisation moves it by eps^2 log eps, the non-local terms by a tenth."""
    found = thresholds(straight_fiber(NON_LOCAL, eps, 24))[0] / -slenderness_constant(eps)
    bare = bare_threshold(eps)
    assert found == pytest.approx(bare, abs=apart)
    assert bare < 0.96 * 153.2


def test_bare_threshold_is_converged():
    assert bare_threshold(1e-3, 9) == pytest.approx(bare_threshold(1e-3, 13), abs=1e-4)


@pytest.mark.parametrize("mobility", [LocalDrag(), NON_LOCAL])
def test_runs_grow_as_the_eigenvalue_says(mobility):
    for eta in (120.0, 145.0, 300.0):
        fiber = straight_fiber(mobility, 1e-2, 24)
        expected = leading(fiber, -eta * slenderness_constant(1e-2))[0]
        assert measured_growth(mobility, eta) == pytest.approx(expected, abs=2e-6)


def test_non_local_threshold_of_runs():
    """Growth measured on both sides of the threshold changes sign where the eigenvalue does."""
    eta = thresholds(straight_fiber(NON_LOCAL, 1e-2, 24))[0] / -slenderness_constant(1e-2)
    assert eta == pytest.approx(137.5606, abs=1e-3)
    below, above = (measured_growth(NON_LOCAL, f * eta) for f in (0.9999, 1.0001))
    assert below < 0.0 < above
    assert eta * (0.9999 - 2e-4 * below / (above - below)) == pytest.approx(eta, abs=2e-4)


def test_non_local_threshold_of_the_paper_s_regularisation_is_close():
    paper = thresholds(straight_fiber(NonLocal(PaperRegularization()), 1e-2, 48))[0]
    ours = thresholds(straight_fiber(NON_LOCAL, 1e-2, 48))[0]
    assert 1e-5 < abs(paper / ours - 1.0) < 3e-4


def test_rigid_motion_is_left_out():
    fiber = straight_fiber(NON_LOCAL, 1e-2, 20)
    bending, compressing = linearised(fiber)
    assert bending.shape == compressing.shape == (18, 18)
    # far below the threshold every bending mode decays, rigid motion would not
    assert leading(fiber, 1.0)[0] < -100.0
