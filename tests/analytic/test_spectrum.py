"""Appendix B: the straight filament's operator and where it loses its sign."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.constraint.line_tension import solve_tension, tension_system
from stokesfibers.core.errors import InputError
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.mobility import LocalDrag, NonLocal, slenderness_constant
from stokesfibers.slender.regularization import (
    ConstantRegularization,
    NoRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)
from stokesfibers.slender.spectrum import (
    crossing,
    legendre_eigenvalue,
    smallest_eigenvalue,
    straight_operator,
)
from support import assert_close, assert_order


def straight_fiber(regularization, eps: float, intervals: int):
    fiber = DiscreteFiber.build(
        1.0, eps, rigidity=1.0, intervals=intervals, mobility=NonLocal(regularization)
    )
    places = np.linspace(-0.5, 0.5, intervals + 1)
    return fiber, fiber.shape(np.outer([0.6, 0.0, 0.8], places))


def smallest(regularization, eps: float, intervals: int) -> float:
    return smallest_eigenvalue(NonLocal(regularization).weights(intervals, eps), eps)


def test_legendre_eigenvalues_are_twice_the_harmonic_numbers():
    sums = 2.0 * np.concatenate([[0.0], np.cumsum(1.0 / np.arange(1, 2001))])
    assert_close(legendre_eigenvalue(np.arange(2001)), sums, rtol=1e-14)
    assert legendre_eigenvalue(1) == pytest.approx(2.0, rel=1e-15)


@pytest.mark.parametrize(("eps", "last"), [(1e-2, 33), (1e-3, 340), (1e-4, 3404)])
def test_solvability_condition_crosses_where_figure_14_says(eps, last):
    assert crossing(eps) == last
    c = slenderness_constant(eps)
    assert c + legendre_eigenvalue(last) < 0.0 < c + legendre_eigenvalue(last + 1)
    assert last == pytest.approx(np.exp(-0.5 - np.euler_gamma) / eps, abs=1.5)


def test_crossing_of_any_slenderness_is_where_the_sign_changes():
    for eps in np.geomspace(1e-5, 0.6, 60):
        n, c = crossing(eps), slenderness_constant(eps)
        assert c + legendre_eigenvalue(n) < 0.0 <= c + legendre_eigenvalue(n + 1)
    for bad in (0.0, -1.0, np.nan, 0.61):
        with pytest.raises(InputError):
            crossing(bad)


def test_discrete_eigenvalues_approach_those_of_the_legendre_polynomials():
    exact = legendre_eigenvalue(np.arange(7))
    errors = []
    for intervals in (40, 80, 160):
        operator = straight_operator(NonLocal(NoRegularization()).weights(intervals, 1e-2), 1e-2)
        values = -np.linalg.eigvals(operator) - slenderness_constant(1e-2)
        assert np.abs(values.imag).max() == 0.0
        found = np.sort(values.real)[:7]
        # Piecewise linear functions hold P_0 and P_1.
        assert np.abs(found - exact)[:2].max() < 1e-12
        errors.append(np.abs(found - exact).max() / exact.max())
    assert_order(errors, between=(1.9, 2.2), final=8e-4)


def test_legendre_polynomials_are_eigenfunctions_of_the_discrete_operator():
    for n, final in ((2, 5e-4), (5, 9e-3)):
        errors = []
        for intervals in (50, 100, 200):
            weights = NonLocal(NoRegularization()).weights(intervals, 1e-2)
            s = np.linspace(0.0, 1.0, intervals + 1)
            p = np.polynomial.Legendre.basis(n, domain=[0, 1])(s)
            found = straight_operator(weights, 1e-2) @ p
            expected = -(slenderness_constant(1e-2) + legendre_eigenvalue(n)) * p
            errors.append(np.abs(found - expected).max())
        assert_order(errors, between=(1.7, 2.0), final=final)  # h^2 log h


def test_purely_local_drag_has_one_eigenvalue():
    weights = LocalDrag().weights(20, 1e-2)
    assert_close(straight_operator(weights, 1e-2), -slenderness_constant(1e-2) * np.eye(21))


@pytest.mark.parametrize(("intervals", "value"), [(50, 0.44), (100, -0.10), (200, -1.2)])
def test_ramp_of_16_only_postpones_the_loss_of_sign(intervals, value):
    assert smallest(PaperRegularization(), 1e-2, intervals) == pytest.approx(value, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("intervals", "value"), [(400, 0.49), (800, -0.08)])
def test_ramp_of_16_only_postpones_the_loss_of_sign_for_thin_fibers(intervals, value):
    assert smallest(PaperRegularization(), 1e-3, intervals) == pytest.approx(value, abs=0.005)


@pytest.mark.parametrize("regularization", [ConstantRegularization(), SpheroidalRegularization()])
@pytest.mark.parametrize("m", [1.8, 2.0, 3.0])
def test_constant_and_spheroidal_delta_keep_the_sign(regularization, m):
    kept = type(regularization)(m=m)
    values = [smallest(kept, 1e-2, n) for n in (50, 100, 200, 300)]
    # -(c + phi(s)) is log(m^2 / e) at mid-length and, spheroidal, log(2 m / e) at the ends.
    bound = np.log((m**2 if kept.kind == "constant" else min(m**2, 2.0 * m)) / np.e)
    assert min(values) >= bound - 2e-3
    assert max(values) <= np.log(m**2 / np.e) + 0.1


@pytest.mark.slow
@pytest.mark.parametrize("regularization", [ConstantRegularization(), SpheroidalRegularization()])
def test_constant_and_spheroidal_delta_keep_the_sign_for_thin_fibers(regularization):
    values = [smallest(regularization, 1e-3, n) for n in (400, 800, 1600)]
    assert min(values) > 0.385
    assert values[-1] == pytest.approx(np.log(4.0 / np.e), abs=0.01)


def test_delta_below_root_e_eps_loses_the_sign():
    """B.2's limit, m > sqrt(e) = 1.6487, for a constant delta."""
    assert smallest(ConstantRegularization(m=1.7), 1e-2, 300) > 0.03
    assert smallest(ConstantRegularization(m=1.6, allow_small_m=True), 1e-2, 300) < -0.03


def tension_eigenvalues(regularization, intervals: int, eps: float = 1e-2) -> np.ndarray:
    """Return the eigenvalues of the tension equation divided by D_2: 2 (c + lambda) in (B.2)."""
    fiber, shape = straight_fiber(regularization, eps, intervals)
    stretching = np.ones(intervals + 1)
    matrix, _ = tension_system(fiber, shape, stretching, drag=1.0, beta=0.0)
    inner = intervals - 1
    second = (np.eye(inner, k=1) + np.eye(inner, k=-1) - 2.0 * np.eye(inner)) * intervals**2
    values = np.linalg.eigvals(np.linalg.solve(second, matrix))
    assert np.abs(values.imag).max() < 0.03
    return values.real


def test_unregularised_tension_equation_turns_singular_past_the_solvability_condition():
    """At eps = 1e-2 the condition (B.6) crosses at n = 33: the discrete equation near N = 29."""
    below, above = (
        tension_eigenvalues(NoRegularization(), 28),
        tension_eigenvalues(NoRegularization(), 30),
    )
    assert below.max() < -0.1
    assert (above > 0.0).sum() == 1
    # The determinant changed its sign, and refinement only brings more eigenvalues across.
    assert np.sign(np.prod(np.sign(below))) == (-1.0) ** below.size
    assert np.sign(np.prod(np.sign(above))) == -((-1.0) ** above.size)
    crossed = [(tension_eigenvalues(NoRegularization(), n) > 0.0).sum() for n in (34, 40, 50, 60)]
    assert crossed == sorted(set(crossed))
    assert crossed[-1] >= 20
    # Some grids come close to a zero eigenvalue: no choice of N is safe.
    near = min(np.abs(tension_eigenvalues(NoRegularization(), n)).min() for n in range(38, 56, 2))
    assert near < 5e-3


def test_unregularised_tension_is_lost_past_the_resolution():
    """A stretching with a jump excites every mode: N = 28 is fine, N = 42 nearly singular."""

    def tension(regularization, intervals):
        fiber, shape = straight_fiber(regularization, 1e-2, intervals)
        stretching = np.sign(fiber.nodes - 0.37)
        return solve_tension(fiber, shape, stretching, drag=1.0, beta=0.0)

    fine = tension(SpheroidalRegularization(), 300)
    scale = np.abs(fine).max()

    def error(regularization, intervals):
        at = np.linspace(0.0, 1.0, intervals + 1)
        reference = np.interp(at, np.linspace(0.0, 1.0, 301), fine)
        return np.abs(tension(regularization, intervals) - reference).max() / scale

    assert error(NoRegularization(), 28) < 0.15
    assert error(NoRegularization(), 42) > 10.0
    assert error(SpheroidalRegularization(), 42) < 0.1


def test_regularised_tension_equation_keeps_its_sign_longer():
    for intervals in (28, 100):
        assert tension_eigenvalues(PaperRegularization(), intervals).max() < -0.6
    assert tension_eigenvalues(PaperRegularization(), 200).max() > 1.0
    for regularization in (ConstantRegularization(), SpheroidalRegularization()):
        largest = tension_eigenvalues(regularization, 200).max()
        assert largest == pytest.approx(-2.0 * np.log(4.0 / np.e), abs=0.01)
