"""Signs and balance of the coupled equations: what one fiber does to another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.load import NoLoad, StericRepulsion
from stokesfibers.slender.field import disturbance
from stokesfibers.stepping.paper import PaperStepper
from support import assert_close, free_end_curve


def _two(load, intervals=100):
    """Stepper and carry of two bent fibers beside each other, apart along z."""
    problem = sf.Problem(
        sf.Fiber(slenderness=1e-2, count=2),
        mu_bar=500.0,
        flow=sf.Shear(1.0),
        mobility=sf.NonLocal(sf.SpheroidalRegularization()),
        engine=sf.PaperEngine(intervals, dt=1e-3),
    )
    problem = replace(problem, load=load)
    curve = free_end_curve()(np.linspace(0.0, 1.0, intervals + 1)).T
    stepper = PaperStepper(problem, 1)
    return stepper, stepper.init(np.stack([curve, curve[:, [1, 0, 2]] + np.array([0, 0, 0.45])]))


def _velocities(stepper, carry):
    """8 pi mu times the velocity of each fiber, (fiber, 3, node)."""
    parts = zip(stepper.fibers, carry.x, carry.slow, strict=True)
    return [slow + fiber.bending_velocity(fiber.shape(x)) for fiber, x, slow in parts]


def test_a_fiber_moves_with_the_flow_that_the_other_makes():
    stepper, carry = _two(NoLoad())
    drag = stepper.problem.drag
    fiber, other = stepper.fibers
    shape, source = fiber.shape(carry.x[0]), other.shape(carry.x[1])
    own = fiber.tensile_velocity(shape, carry.tension[0])
    own = own + drag * stepper.problem.flow.velocity(carry.x[0].T, 0.0).T
    force = other.elastic_force(source, carry.tension[1])
    induced = disturbance(other, source, force, np.ascontiguousarray(carry.x[0].T)).T
    assert_close(carry.slow[0] - own, induced, rtol=0.02)


@pytest.mark.parametrize("load", [NoLoad(), StericRepulsion(strength=300.0, range=0.6)])
def test_coupled_tensions_keep_both_fibers_inextensible(load):
    stepper, carry = _two(load)
    for fiber, x, velocity in zip(
        stepper.fibers, carry.x, _velocities(stepper, carry), strict=True
    ):
        xs = fiber.shape(x).xs
        stretching = np.sum(xs * fiber.derivative(velocity), axis=0)[5:-5]
        flow = stepper.problem.flow.gradient(x.T, 0.0)
        scale = stepper.problem.drag * np.abs(np.einsum("in,nij,jn->n", xs, flow, xs)).max()
        assert np.abs(stretching).max() < 0.02 * scale


def test_repulsion_moves_the_fibers_apart():
    apart = []
    for load in (NoLoad(), StericRepulsion(strength=300.0, range=0.6)):
        stepper, carry = _two(load)
        one, other = _velocities(stepper, carry)
        apart.append(float(np.mean(other[2] - one[2])))
    assert apart[1] > apart[0] + 0.1 * abs(apart[0])
