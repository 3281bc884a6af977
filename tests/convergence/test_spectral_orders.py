"""Orders of the high-order engine: in nodes by the choice of delta(s), in time for the tension."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from reference.twins import continuous_finite_part
from stokesfibers.flow import Shear
from stokesfibers.numerics.step_control import FixedSteps
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import (
    ConstantRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.stepping.spectral import SpectralStepper
from support import assert_order, free_end_curve, observed_orders

CURVE = free_end_curve()
BENT = free_end_curve(bend=90.0)
EPS = 1e-2
SPHEROIDAL, CONSTANT = SpheroidalRegularization(), ConstantRegularization()
# denser where the ramp of (16) ends: its second derivative jumps there
PLACES = np.unique(np.concatenate([np.linspace(0.02, 0.98, 49), np.linspace(0.08, 0.12, 81)]))


def _fiber(nodes, regularization=SPHEROIDAL):
    mobility = NonLocal(regularization)
    return SpectralFiber.build(1.0, EPS, rigidity=1.0, nodes=nodes, mobility=mobility)


def _force(s):
    return np.stack([np.cos(3.0 * s), np.sin(2.0 * s) + s**2, np.exp(-s)])


def _finite_part_errors(regularization, counts):
    """Largest error of K_delta[f] of (24) between the nodes, where a polynomial goes through."""
    delta = regularization.delta(PLACES, EPS)
    pairs = zip(PLACES, delta, strict=True)
    exact = np.stack([continuous_finite_part(CURVE, _force, s, d) for s, d in pairs], axis=1)
    errors = []
    for nodes in counts:
        fiber = _fiber(nodes, regularization)
        force, tangent = _force(fiber.sigma), CURVE(fiber.sigma, 1)
        found, _ = fiber.mobility_velocity(fiber.fit(lambda q: CURVE(q).T), force)
        along = tangent * np.sum(tangent * force, axis=0)
        finite = found - fiber.local.a * force - fiber.local.b * along
        errors.append(float(np.abs(fiber.between_nodes(finite, PLACES) - exact).max()))
    return np.array(errors)


def test_spheroidal_and_constant_delta_converge_faster_than_any_power_of_the_nodes():
    errors = _finite_part_errors(SPHEROIDAL, (8, 12, 16, 24))
    orders = observed_orders(errors[:2], 1.5)[0], observed_orders(errors[2:], 1.5)[0]
    assert orders[0] > 5.0
    assert orders[1] > 2.0 * orders[0]
    assert errors[-1] < 3e-8
    errors = _finite_part_errors(CONSTANT, (16, 32, 64, 128))
    orders = observed_orders(errors[:-1])  # the last error is rounding
    assert orders[0] > 5.0
    assert orders[1] > 1.5 * orders[0]
    assert errors[-1] < 1e-11


def test_the_choice_16_converges_at_second_order_in_the_end():
    """Its delta(s) is C^1; spheroidal delta is 1000 times more accurate long before."""
    counts = np.array([24, 32, 48, 64, 96, 128])
    errors = _finite_part_errors(PaperRegularization(), counts)
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert 1.5 < slope < 2.5
    assert 3e-6 < errors[-1] < 2e-5
    assert errors[0] > 1e3 * _finite_part_errors(SPHEROIDAL, (24,))[0]


def _end(stepper, end):
    """Return shape and tension of a bent fiber at `end`, at equally spaced arclengths."""
    carry = stepper.init((lambda q: BENT(q).T,))
    while carry.time < end:
        carry, _ = stepper.step(carry)
    state, s, fiber = stepper.interpolate(carry, end), np.linspace(0.0, 1.0, 31), stepper.fibers[0]
    return fiber.position(state.modes[0], s), fiber.tension(state.tensions[0], s)


def _stepper(nodes, control, regularization=SPHEROIDAL):
    fibers = (_fiber(nodes, regularization),)
    return SpectralStepper(fibers, drag=1e5, flow=Shear(1.0), control=control, threads=1)


def _shape(nodes, regularization):
    return _end(_stepper(nodes, FixedSteps(0.05, 4), regularization), 1.5)[0]


@pytest.mark.parametrize("regularization", [SPHEROIDAL, CONSTANT, PaperRegularization()])
def test_shapes_converge_spectrally_to_1e_7_with_every_choice(regularization):
    """The end of (16) is far below: the bending force smooths what a kink in delta(s) brings."""
    fine = _shape(80, regularization)
    errors = [float(np.abs(_shape(n, regularization) - fine).max()) for n in (16, 24, 32, 48)]
    assert errors[0] > 20.0 * errors[1] > 400.0 * errors[2]
    assert errors[2] < 1.5e-6
    assert errors[3] < 1e-7


@cache
def _tension(dt, order):
    return _end(_stepper(36, FixedSteps(dt, order)), 1.5)[1]


@pytest.mark.parametrize(
    ("order", "between", "final"),
    [
        (1, (0.8, 1.2), 3e-2),
        (2, (1.7, 2.3), 5e-4),
        (3, (2.6, 4.0), 2e-5),
        (4, (3.4, 4.9), 8e-7),
        (5, (4.2, 6.8), 9e-8),
    ],
)
def test_order_of_the_tension_in_time(order, between, final):
    exact = _tension(0.005, 5)
    scale = np.abs(exact).max()
    errors = [float(np.abs(_tension(dt, order) - exact).max() / scale) for dt in (0.06, 0.03)]
    assert_order(errors, between=between, final=final)
