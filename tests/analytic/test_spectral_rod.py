"""The spectral engine on a straight rod, whose motion and tension in a linear flow are known.

A rod with constant drag, 1 / (a + b) along and 1 / a across (local drag), turns in unit shear like
``cot theta = cot theta_0 + t`` and carries the tension
``T = -drag (x_s . grad U x_s) s (L - s) / (2 (a + b))`` with the sign reversed under compression.
"""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.fiber import curves
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.numerics.step_control import AdaptiveSteps, FixedSteps
from stokesfibers.slender.mobility import LocalDrag, NonLocal, slenderness_constant
from stokesfibers.slender.regularization import ConstantRegularization, SpheroidalRegularization
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.stepping.spectral import SpectralStepper
from stokesfibers.stepping.spectral_carry import State
from support import assert_close, assert_negligible

LENGTH, RIGIDITY, DRAG, RATE, EPS = 2.5, 3.0, 400.0, 0.7, 1e-2
ANGLE = 0.85 * np.pi


def _stepper(mobility, nodes, control, **options):
    fiber = SpectralFiber.build(LENGTH, EPS, rigidity=RIGIDITY, nodes=nodes, mobility=mobility)
    return SpectralStepper(
        (fiber,), drag=DRAG, flow=Shear(RATE), control=control, threads=1, **options
    )


def _rod(angle=ANGLE):
    fiber = Fiber(length=LENGTH, slenderness=EPS, rigidity=RIGIDITY)
    return curves.straight(fiber, angle=angle, centre=(0.4, -0.2, 0.1)).at_fractions


@pytest.mark.parametrize("nodes", [6, 21])
def test_initial_tension_under_local_drag_is_exact(nodes):
    stepper = _stepper(LocalDrag(), nodes, AdaptiveSteps(1e-4))
    carry = stepper.init((_rod(),))
    fiber = stepper.fibers[0]
    s = np.linspace(0.0, LENGTH, 17)
    stretching = RATE * np.sin(ANGLE) * np.cos(ANGLE)
    along = -2.0 * slenderness_constant(EPS)
    expected = DRAG * stretching * s * (LENGTH - s) / (2.0 * along)
    found = fiber.tension(carry.tensions[0, 0], s)
    assert_close(found, expected, rtol=1e-11)
    assert found[8] < 0.0, "a rod in the compressive quadrant is under pressure"


def test_tension_with_the_finite_part():
    """Legendre polynomials are nearly its eigenfunctions: a few modes hold the tension."""
    s = np.linspace(0.0, LENGTH, 17)

    def tension(regularization, nodes):
        stepper = _stepper(NonLocal(regularization), nodes, AdaptiveSteps(1e-4))
        carry = stepper.init((_rod(),))
        return stepper.fibers[0].tension(carry.tensions[0, 0], s)

    fine = tension(SpheroidalRegularization(), 96)
    assert_close(tension(SpheroidalRegularization(), 8), fine, rtol=1e-8)
    # A constant delta resembles no spheroid; its operator is resolved as N delta grows.
    fine = tension(ConstantRegularization(), 96)
    scale = np.abs(fine).max()
    errors = [
        np.abs(tension(ConstantRegularization(), n) - fine).max() / scale for n in (8, 24, 64)
    ]
    assert errors[0] < 1e-2
    assert errors[0] > 5.0 * errors[1] > 25.0 * errors[2]


@pytest.mark.parametrize("mobility", [LocalDrag(), NonLocal(SpheroidalRegularization())])
def test_a_rod_tumbles_as_slender_theory_says(mobility):
    control = AdaptiveSteps(rtol=1e-7)
    stepper = _stepper(mobility, 12, control)
    carry = stepper.init((_rod(),))
    while carry.time < 5.0:
        carry, _ = stepper.step(carry)
    state = stepper.interpolate(carry, 5.0)
    fiber = stepper.fibers[0]
    ends = fiber.position(state.modes[0], np.array([0.0, LENGTH]))
    direction = (ends[:, 1] - ends[:, 0]) / LENGTH
    cot = 1.0 / np.tan(ANGLE) + RATE * 5.0
    assert_close(direction, [cot / np.hypot(1.0, cot), 1.0 / np.hypot(1.0, cot), 0.0], atol=3e-7)
    centre = ends.mean(axis=1)
    assert_close(centre, [0.4 - 0.2 * RATE * 5.0, -0.2, 0.1], atol=1e-7)
    bend = fiber.position(state.modes[0], fiber.sigma * LENGTH, 2)
    assert_negligible(bend * LENGTH, scale=1.0, rtol=1e-9)
    assert_negligible(np.linalg.norm(direction) - 1.0, scale=1.0, rtol=1e-9)


def test_velocity_of_a_rod_is_rigid():
    stepper = _stepper(NonLocal(SpheroidalRegularization()), 24, AdaptiveSteps(1e-4))
    carry = stepper.init((_rod(),))
    state = State(carry.modes[:, 0], carry.tensions[:, 0])
    found = stepper.velocity(state, 0.0)[0]
    fiber = stepper.fibers[0]
    offset = (fiber.sigma - 0.5) * LENGTH
    turning = -RATE * np.sin(ANGLE) ** 2
    across = np.array([-np.sin(ANGLE), np.cos(ANGLE), 0.0])
    expected = np.outer(across, turning * offset)
    expected[0] -= 0.2 * RATE
    assert_close(found, expected, rtol=1e-6)


def test_a_rod_under_a_uniform_load_falls_with_its_drag():
    weight = np.array([0.3, -2.0, 0.5])

    def load(points, t):  # noqa: ARG001
        return np.broadcast_to(weight, points.shape)

    fiber = SpectralFiber.build(LENGTH, EPS, rigidity=RIGIDITY, nodes=10, mobility=LocalDrag())
    stepper = SpectralStepper(
        (fiber,), drag=DRAG, flow=Shear(0.0), control=FixedSteps(0.05, 3), load=load, threads=1
    )
    carry = stepper.init((_rod(),))
    start = carry.modes[0, 0, :, 0] * LENGTH
    while carry.time < 1.0:
        carry, _ = stepper.step(carry)
    moved = carry.modes[0, 0, :, 0] * LENGTH - start
    tangent = np.array([np.cos(ANGLE), np.sin(ANGLE), 0.0])
    a = -slenderness_constant(EPS)
    expected = carry.time * (a * weight + a * tangent * (tangent @ weight)) / DRAG
    assert_close(moved, expected, rtol=1e-9)
