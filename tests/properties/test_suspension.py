"""Interacting fibers: what must hold whatever the shapes are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.constraint.coupled import FixedPoint, Krylov, TensionError
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.slender.suspension import Interaction, Scene
from stokesfibers.stepping.paper import PaperStepper
from stokesfibers.summation.close_approach import PaperCloseApproach
from stokesfibers.summation.images import TruncatedSum
from support import assert_close, free_end_curve

INTERVALS = 24


def _positions(count, spread=0.7, seed=4):
    """Bent fibers with free ends, turned and shifted at random, (fiber, node, 3)."""
    random = np.random.default_rng(seed)
    curve = free_end_curve()(np.linspace(0.0, 1.0, INTERVALS + 1)).T
    turned = []
    for _ in range(count):
        rotation, _ = np.linalg.qr(random.normal(size=(3, 3)))
        rotation[:, 0] *= np.sign(np.linalg.det(rotation))
        turned.append(curve @ rotation.T + spread * random.normal(size=3))
    return np.array(turned)


def _problem(count=4, **changes):
    problem = sf.Problem(
        sf.Fiber(slenderness=1e-2, count=count),
        mu_bar=2e3,
        flow=sf.Shear(1.0),
        engine=sf.PaperEngine(INTERVALS, dt=0.01),
    )
    return replace(problem, **changes)


def _advance(problem, positions, steps=3, threads=1):
    stepper = PaperStepper(problem, threads)
    carry = stepper.init(positions)
    for _ in range(steps):
        carry, report = stepper.step(carry)
    return carry, report


DOMAINS = [Free(), Periodic((2.0, 0.0, 0.0)), Periodic((2.0, 2.0, 0.0))]
FEW_IMAGES = TruncatedSum(reach=3)


@pytest.mark.parametrize("domain", DOMAINS, ids=["free", "one period", "two periods"])
def test_assembled_influence_equals_the_sum_it_stands_for(domain):
    close = PaperCloseApproach(d0=0.15)
    fibers = PaperStepper(_problem(domain=domain, image_sum=FEW_IMAGES), 1).fibers
    positions = _positions(4, spread=0.35)
    shapes = tuple(f.shape(x.T) for f, x in zip(fibers, positions, strict=True))
    interaction = Interaction.build(fibers, domain, image_sum=FEW_IMAGES, close_approach=close)
    scene = Scene(interaction, shapes, Workers(1))
    tension = np.zeros((4, INTERVALS + 1))
    tension[:, 1:-1] = np.random.default_rng(0).normal(size=(4, INTERVALS - 1))
    direct = scene.stretching(
        scene.integrated_force(tension, bending=False),
        scene.tensile_value(tension),
    )
    assembled = np.einsum("lmkn,kn->lm", scene.influence(), tension[:, 1:-1])
    assert_close(assembled, direct[:, 1:-1], rtol=1e-11)


@pytest.mark.parametrize("domain", DOMAINS[:2], ids=["free", "one period"])
def test_krylov_and_fixed_point_give_the_same_run(domain):
    positions = _positions(4)
    runs = [
        _advance(_problem(domain=domain, tension_solver=solver), positions)[0]
        for solver in (FixedPoint(tolerance=1e-12), Krylov(tolerance=1e-13))
    ]
    assert_close(runs[0].tension, runs[1].tension, rtol=1e-9)
    assert_close(runs[0].x, runs[1].x, rtol=1e-11)


def test_results_do_not_depend_on_the_number_of_threads():
    positions = _positions(5)
    problem = _problem(5, domain=Periodic((2.0, 0.0, 0.0)))
    one, two = (_advance(problem, positions, threads=t)[0] for t in (1, 2))
    for name, values in one.arrays().items():
        assert np.array_equal(values, two.arrays()[name]), name


def test_relabelling_fibers_relabels_the_run():
    positions, order = _positions(4), [2, 0, 3, 1]
    problem = _problem(tension_solver=FixedPoint(tolerance=1e-13))
    run = _advance(problem, positions)[0]
    again = _advance(problem, positions[order])[0]
    assert_close(again.x, run.x[order], rtol=1e-12)
    assert_close(again.tension, run.tension[order], rtol=1e-9)


def test_a_shift_by_a_period_changes_nothing_but_the_position():
    problem = _problem(domain=Periodic((2.0, 0.0, 0.0)), tension_solver=FixedPoint(1e-13))
    positions = _positions(4)
    moved = positions.copy()
    moved[1] += (6.0, 0.0, 0.0)
    run, again = (_advance(problem, x)[0] for x in (positions, moved))
    difference = again.positions - run.positions
    expected = np.zeros_like(difference)
    expected[1, :, 0] = 6.0
    assert_close(difference, expected, atol=1e-10)


def test_fibers_far_apart_move_as_each_alone():
    positions = _positions(2, spread=0.0)
    alone = [_advance(_problem(1), positions[[k]])[0].x[0] for k in range(2)]
    errors = []
    for distance in (20.0, 40.0):
        apart = positions.copy()
        apart[1, :, 2] += distance
        both = _advance(_problem(2), apart)[0].x.copy()
        both[1, 2] -= distance
        errors.append(np.abs(both - np.array(alone)).max())
    # the velocity they induce on each other falls as 1/R^2
    assert 3.5 < errors[0] / errors[1] < 4.5
    assert errors[0] < 1e-5


def test_mixed_fibers_equal_each_alone_when_far_apart():
    kinds = (sf.Fiber(slenderness=1e-2), sf.Fiber(length=2.0, slenderness=5e-3, rigidity=3.0))
    problem = replace(_problem(1), fiber=kinds)
    positions = np.stack([_positions(1, 0.0)[0], 2.0 * _positions(1, 0.0)[0]])
    positions[1, :, 2] += 60.0
    both = _advance(problem, positions)[0].x
    single = replace(_problem(1), fiber=kinds[1], mu_bar=None, viscosity=problem.drag / 8 / np.pi)
    alone = _advance(single, positions[[1]])[0].x[0]
    assert_close(both[1], alone, atol=2e-6)


def test_a_cell_shorter_than_a_fiber_is_refused():
    with pytest.raises(sf.InputError, match="periods"):
        _problem(domain=Periodic((0.9, 0.0, 0.0)))


def test_sweeps_that_do_not_converge_say_so():
    problem = _problem(tension_solver=FixedPoint(tolerance=1e-14, most=2))
    with pytest.raises(TensionError, match="did not reach"):
        _advance(problem, _positions(4))
