"""Each compiled kernel against its slow twin, and both against the continuous operators (24)."""

from __future__ import annotations

import numpy as np
import pytest

from reference import twins
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.mobility import NonLocal, slenderness_constant
from stokesfibers.slender.regularization import (
    ConstantRegularization,
    NoRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)
from support import assert_close, assert_order, helical_curve, observed_orders

N = 10
REGULARIZATIONS = [PaperRegularization(), ConstantRegularization(), SpheroidalRegularization()]
by_kind = pytest.mark.parametrize("regularization", REGULARIZATIONS, ids=lambda r: r.kind)


def build(regularization, intervals: int, eps: float = 0.02, length: float = 1.0) -> DiscreteFiber:
    return DiscreteFiber.build(
        length, eps, rigidity=1.0, intervals=intervals, mobility=NonLocal(regularization)
    )


@pytest.fixture(scope="module")
def rough() -> np.ndarray:
    """Positions (node, space) of a bent curve whose nodes are not quite at equal arclengths."""
    noise = np.random.default_rng(7).normal(size=(N + 1, 3))
    return helical_curve().nodes(N).T + 2e-3 * noise


@pytest.fixture(scope="module")
def force() -> np.ndarray:
    return np.random.default_rng(8).normal(size=(N + 1, 3))


def test_differences_are_those_of_the_appendix(rough):
    shape = build(PaperRegularization(), N).shape(rough.T)
    for order, values in enumerate((shape.xs, shape.xss, shape.xsss, shape.xssss), start=1):
        assert_close(values, (twins.differences(order, N) @ rough).T, rtol=1e-13)


@by_kind
@pytest.mark.parametrize("eps", [0.02, 1e-3])
def test_finite_part_is_the_quadrature_of_30_to_32(regularization, eps, rough, force):
    fiber = build(regularization, N, eps)
    found = fiber.finite_part(fiber.shape(rough.T), force.T)
    assert_close(found.T, twins.finite_part(rough, fiber.weights.delta, force), rtol=1e-10)


def test_unregularised_finite_part_is_the_quadrature_of_30_to_32(rough, force):
    fiber = build(NoRegularization(), N)
    found = fiber.finite_part(fiber.shape(rough.T), force.T)
    assert_close(found.T, twins.finite_part(rough, np.zeros(N + 1), force), rtol=1e-10)


def test_finite_part_has_no_unit_of_length(rough, force):
    one, five = build(PaperRegularization(), N), build(PaperRegularization(), N, length=5.0)
    expected = one.finite_part(one.shape(rough.T), force.T)
    assert_close(five.finite_part(five.shape(5.0 * rough.T), force.T), expected, rtol=1e-13)


def test_evolution_matrix_is_its_twin(rough):
    fiber = build(PaperRegularization(), N)
    factor = 3e-7
    found = fiber.evolution_matrix(fiber.shape(rough.T), factor)
    c = slenderness_constant(0.02)
    expected = twins.evolution_matrix(
        rough, fiber.weights.delta, a=2.0 - c, b=-(2.0 + c), factor=factor
    )
    assert_close(found, expected, rtol=1e-10)
    # The part beside the identity, which a small factor would hide.
    eye = np.eye(3 * (N + 1))
    assert_close((found - eye) / factor, (expected - eye) / factor, rtol=1e-10)


@by_kind
@pytest.mark.parametrize("eps", [0.02, 1e-3])
def test_tension_coupling_is_the_quadrature_of_37_and_38(regularization, eps, rough):
    fiber = build(regularization, N, eps)
    w = fiber.weights
    matrix, bending = fiber.tension_coupling(fiber.shape(rough.T))
    assert_close(matrix[1:-1], twins.tension_matrix(rough, w.delta_half, w.phi_0), rtol=1e-10)
    expected = twins.bending_term(rough, w.delta, w.delta_half, w.phi_0)
    assert_close(bending[1:-1], expected, rtol=1e-10)


def test_unregularised_tension_coupling_of_a_straight_fiber():
    fiber = build(NoRegularization(), N)
    x = np.outer(np.linspace(-0.5, 0.5, N + 1), [0.6, 0.0, 0.8])
    matrix, bending = fiber.tension_coupling(fiber.shape(x.T))
    expected = twins.tension_matrix(x, np.zeros(N), 0.0)
    assert_close(matrix[1:-1], expected, rtol=1e-10)
    assert np.abs(bending).max() < 1e-6 * np.abs(matrix).max()


def test_the_splitting_constant_of_37_is_the_integral_at_the_middle():
    for regularization in REGULARIZATIONS:
        w = build(regularization, 20).weights
        d = 0.04 if regularization.kind != "spheroidal" else 0.08 * np.sqrt(0.25 + 0.0016)
        printed = np.log((0.5 + np.hypot(0.5, d)) ** 2 / d**2)
        assert w.phi_0 == pytest.approx(printed, rel=1e-14)


# --- against the continuous operators ---------------------------------------------------------

CURVE = helical_curve()
TENSION = np.polynomial.Polynomial([0.0, 1.0, 0.6, -3.2, 1.6])  # zero at 0 and at 1
INTERVALS = (50, 100, 200, 400)
# Nodes of all grids; not 0.1 and 0.9, where delta(s) of (16) has a jump in its second derivative.
SAMPLES = np.array([0.04, 0.06, 0.14, 0.24, 0.5, 0.62, 0.86, 0.96])
LARGEST_BENDING = 1.6e-4  # relative errors at N = 400
LARGEST_TENSILE = {"paper": 2.5e-4, "constant": 1.2e-4, "spheroidal": 3.5e-5}


def at_samples(nodal, samples=SAMPLES):
    places = samples * (len(nodal) - 1)
    assert np.abs(places - places.round()).max() < 1e-9
    return nodal[places.round().astype(int)]


def discrete_stretching(regularization, intervals):
    """Return x_s . d/ds K_delta of (T x_s)_s and of x_ssss at the nodes, by (37) and (38)."""
    fiber = build(regularization, intervals)
    shape = fiber.shape(CURVE.nodes(intervals))
    matrix, bending = fiber.tension_coupling(shape)
    tension = TENSION(fiber.nodes)
    curved = np.zeros_like(tension)
    curved[1:-1] = 2.0 * np.diff(tension, 2) * intervals**2
    curved -= tension * np.sum(shape.xss**2, axis=0)
    return -(matrix @ tension) - fiber.weights.phi_0 * curved, bending


def continuous(regularization, force, samples=SAMPLES):
    def delta(s):
        return regularization.delta(s, 0.02)

    return np.array([twins.continuous_stretching(CURVE, force, s, delta) for s in samples])


def tensile_force(s):
    return TENSION.deriv()(s) * CURVE(s, 1) + TENSION(s) * CURVE(s, 2)


@by_kind
def test_37_and_38_approach_the_continuous_operator_at_second_order(regularization):
    tensile = continuous(regularization, tensile_force)
    bending = continuous(regularization, lambda s: CURVE(s, 4))
    errors = []
    for intervals in INTERVALS:
        found = discrete_stretching(regularization, intervals)
        errors.append(
            [
                np.abs(at_samples(values) - exact).max() / np.abs(exact).max()
                for values, exact in zip(found, (tensile, bending), strict=True)
            ]
        )
    tensile_errors, bending_errors = np.array(errors).T
    assert_order(tensile_errors, between=(1.9, 2.2), final=LARGEST_TENSILE[regularization.kind])
    assert_order(bending_errors, between=(1.9, 2.3), final=LARGEST_BENDING)


def test_finite_part_approaches_the_continuous_operator_at_second_order():
    regularization = SpheroidalRegularization()
    exact = np.stack(
        [
            twins.continuous_finite_part(
                CURVE, tensile_force, s, float(regularization.delta(np.array(s), 0.02))
            )
            for s in SAMPLES
        ]
    )
    errors = []
    for intervals in INTERVALS[:3]:
        fiber = build(regularization, intervals)
        found = fiber.finite_part(fiber.shape(CURVE.nodes(intervals)), tensile_force(fiber.nodes))
        errors.append(np.abs(at_samples(found.T) - exact).max() / np.abs(exact).max())
    assert_order(errors, between=(1.9, 2.2), final=6e-5)


def test_ramp_of_16_costs_one_order_at_its_two_ends_only():
    """The narrow difference (33) across the jump of delta'' is of first order at that node."""
    kink = np.array([0.1])
    for regularization in REGULARIZATIONS:
        value = [at_samples(discrete_stretching(regularization, n)[0], kink)[0] for n in INTERVALS]
        order = observed_orders(np.abs(np.diff(value)))[-1]
        assert order == pytest.approx(1.0 if regularization.kind == "paper" else 2.0, abs=0.15)
