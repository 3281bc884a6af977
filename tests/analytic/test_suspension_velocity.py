"""The fluid's velocity among several fibers, with images and close approach."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.domain import Periodic
from stokesfibers.load import StericRepulsion
from stokesfibers.observe.snapshot import Snapshot, Surroundings
from stokesfibers.slender.field import disturbance
from stokesfibers.stepping.paper import PaperStepper
from stokesfibers.summation.close_approach import PaperCloseApproach
from support import assert_close, assert_order, free_end_curve

POINTS = np.array([[0.1, 0.35, 0.3], [0.5, -0.4, 0.1], [-0.6, 0.2, -0.5]])


def _moment(intervals, count=2, **changes):
    problem = sf.Problem(
        sf.Fiber(slenderness=1e-2, count=count),
        mu_bar=500.0,
        flow=sf.Shear(1.0),
        engine=sf.PaperEngine(intervals, dt=1e-3),
    )
    problem = replace(problem, **changes)
    s = np.linspace(0.0, 1.0, intervals + 1)
    curve = free_end_curve()(s).T
    positions = np.stack([curve, curve[:, [1, 2, 0]] + np.array([0.1, 0.2, 0.6])])[:count]
    stepper = PaperStepper(problem, 1)
    carry = stepper.init(positions)
    surroundings = Surroundings(problem.domain, problem.load)
    snapshot = Snapshot.take(
        0.0, stepper.fibers, carry.positions, carry.tension, surroundings=surroundings
    )
    return problem, snapshot, carry


def test_velocity_of_two_fibers_is_the_sum_of_each_alone():
    errors = []
    for intervals in (40, 80, 160):
        # refinement near a fiber leaves an error of its own where it stops
        problem, moment, _ = _moment(intervals, close_approach=PaperCloseApproach(near=0.0))
        expected = problem.flow.velocity(POINTS, 0.0)
        for fiber, shape, tension in zip(moment.fibers, moment.shapes, moment.tension, strict=True):
            force = fiber.elastic_force(shape, tension)
            expected = expected + disturbance(fiber, shape, force, POINTS) / problem.drag
        found = sf.fluid_velocity(problem, moment, POINTS, threads=1)
        errors.append(np.abs(found - expected).max() / np.abs(expected).max())
    # below second order: T_s in the plain form (5) varies fast at the fibers' ends
    assert_order(errors, between=(1.3, 2.3), final=2e-4)


def test_velocity_at_a_centreline_is_that_of_the_fiber():
    problem, moment, carry = _moment(40)
    own = (carry.slow[0] + moment.fibers[0].bending_velocity(moment.shapes[0])) / problem.drag
    nodes = moment.positions[0, 5:-5]
    found = sf.fluid_velocity(problem, moment, nodes + 1e-9, threads=1)
    assert_close(found, own.T[5:-5], rtol=2e-3)


def test_velocity_is_periodic():
    problem, moment, _ = _moment(30, domain=Periodic((2.0, 0.0, 0.0)))
    disturbed = [
        sf.fluid_velocity(problem, moment, x, threads=1) - problem.flow.velocity(x, 0.0)
        for x in (POINTS, POINTS + np.array([4.0, 0.0, 0.0]))
    ]
    assert_close(disturbed[1], disturbed[0], rtol=1e-12)
    free = _moment(30)
    lonely = sf.fluid_velocity(free[0], free[1], POINTS) - free[0].flow.velocity(POINTS, 0.0)
    assert np.abs(lonely - disturbed[0]).max() > 1e-3 * np.abs(lonely).max()


def test_threads_do_not_change_a_bit_of_the_velocity():
    problem, moment, _ = _moment(30, domain=Periodic((2.0, 0.0, 0.0)))
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 7)] * 3), axis=-1)
    one, two = (sf.fluid_velocity(problem, moment, grid, threads=t) for t in (1, 2))
    assert one.shape == grid.shape
    assert np.array_equal(one, two)


@pytest.mark.parametrize("strength", [0.0, 1e4])
def test_repulsion_stirs_the_fluid(strength):
    load = StericRepulsion(strength=strength or 1.0, range=0.8 if strength else 1e-6)
    quiet = _moment(30)
    pushed = _moment(30, load=load)
    base, moved = (sf.fluid_velocity(p, m, POINTS) for p, m, _ in (quiet, pushed))
    change = np.abs(moved - base).max()
    assert change > 1e-3 if strength else change == 0.0
