"""Runs in a sheared cell: images slide with the flow; nothing jumps where the lattice repeats."""

from __future__ import annotations

import signal
from dataclasses import replace

import numpy as np
import pytest

from stokesfibers.config.case import case_from_tables
from stokesfibers.core.errors import InputError
from stokesfibers.domain import Free, Sheared
from stokesfibers.fiber import curves
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import OscillatoryShear, Shear
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import resume, simulate
from stokesfibers.run.velocity import velocity_from_run
from stokesfibers.summation import FastImages
from support import assert_close, assert_same

UNTIL = 0.8
RECORD = Schedule(0.1, 0.05, checkpoint_every=0.1)
CELL = Sheared((1.6, 1.5, 1.4))
PROBLEM = Problem(
    Fiber(count=2, slenderness=1e-2),
    mu_bar=2e3,
    flow=Shear(1.0),
    domain=CELL,
    engine=SpectralEngine(nodes=10, rtol=1e-3),
)
SHAPES = tuple(
    curves.segment(PROBLEM.fibers[0], centre=np.array(c), direction=np.array(d))
    for c, d in (([0.5, 0.2, 0.4], [1.0, 0.5, 0.2]), ([0.9, 1.2, 0.9], [-0.4, 1.0, 0.6]))
)


def run(problem=PROBLEM, shapes=SHAPES, out=None, until=UNTIL, watch=None):
    return simulate(problem, shapes, until=until, record=RECORD, out=out, watch=watch)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    result = run(out=tmp_path_factory.mktemp("sheared") / "run.zarr")
    assert result.status.code == "done"
    return result.data.load()


def values(data, name):
    return data["observables"][name].to_numpy()


def test_the_cell_follows_the_flow_and_nothing_jumps_at_the_flip(whole):
    """The offset passes Lx / 2 at a strain of 0.533, within the run."""
    time = values(whole, "time")
    assert_close(values(whole, "strain"), time, atol=1e-12)
    for name in ("shear_stress", "smallest_distance", "first_normal_stress_difference"):
        second = np.abs(np.diff(values(whole, name), 2))
        flip = np.abs(time[1:-1] - 0.533) < 0.06
        assert flip.sum() >= 2
        assert (
            second[flip].max() < 3.0 * np.median(second) + 1e-4 * np.abs(values(whole, name)).max()
        )


def test_stress_is_per_volume_of_the_cell(whole):
    volume = 1.6 * 1.5 * 1.4
    stress = values(whole, "extra_stress")
    assert_close(values(whole, "particle_stress"), stress / volume, rtol=1e-13)
    normal = values(whole, "first_normal_stress_difference")
    assert_close(normal, stress[:, 0, 0] - stress[:, 1, 1], rtol=1e-13)
    viscosity = PROBLEM.drag / (8.0 * np.pi)
    specific = stress[:, 0, 1] / (volume * viscosity)
    assert_close(values(whole, "specific_viscosity"), specific, rtol=1e-13)
    assert np.abs(specific).max() > 1e-3


@pytest.mark.parametrize("stop", [0.3, 0.5])
def test_restart_before_the_flip_is_bitwise_no_restart(stop, whole, tmp_path):
    out = tmp_path / "run.zarr"

    def watch(moment):
        if moment.time > stop:
            signal.raise_signal(signal.SIGINT)

    first = run(out=out, watch=watch)
    assert first.status.code == "interrupted"
    assert stop < first.status.time < UNTIL
    assert_same(resume(out).data, whole)


def test_a_whole_strain_of_the_lattice_changes_nothing():
    """Strain s and s - Lx / Ly span the same lattice.

    Steps are fixed: rounding may turn the choice of an order, and with it the error of the steps.
    """
    fixed = replace(PROBLEM, engine=SpectralEngine(nodes=10, dt=0.02, order=2))
    here = run(fixed)
    other = run(replace(fixed, domain=CELL.at(-1.6 / 1.5)))
    for name in ("shear_stress", "smallest_gap", "centre"):
        assert_close(values(other.data, name), values(here.data, name), rtol=1e-9)
    assert_close(values(other.data, "strain"), values(here.data, "strain") - 1.6 / 1.5, atol=1e-12)


def test_fibers_moved_by_lattice_vectors_run_alike(whole):
    """They move on with the flow at their place, and end at the same lattice vectors."""
    numbers = np.array([[1.0, -1.0, 0.0], [0.0, 2.0, -1.0]])
    vectors = CELL.lattice_vectors(numbers)
    moved = tuple(
        curves.segment(PROBLEM.fibers[0], centre=np.array(c) + v, direction=np.array(d))
        for (c, d), v in zip(
            (([0.5, 0.2, 0.4], [1.0, 0.5, 0.2]), ([0.9, 1.2, 0.9], [-0.4, 1.0, 0.6])),
            vectors,
            strict=True,
        )
    )
    other = run(shapes=moved)
    for name in ("shear_stress", "smallest_gap", "end_to_end"):
        assert_close(values(other.data, name), values(whole, name), rtol=2e-3)
    shift = values(other.data, "centre") - values(whole, "centre")
    expected = vectors + values(whole, "time")[:, None, None] * numbers[:, 1:2] * [1.5, 0.0, 0.0]
    assert_close(shift, expected, atol=2e-3)


def test_an_oscillating_cell_comes_back():
    flow = OscillatoryShear(1.0, frequency=2.5)
    result = run(replace(PROBLEM, flow=flow))
    time = values(result.data, "time")
    expected = np.sin(2.5 * np.pi * time) ** 2 / (2.5 * np.pi)
    assert_close(values(result.data, "strain"), expected, atol=1e-12)
    assert abs(values(result.data, "strain")[-1]) < 1e-12


def test_one_fiber_in_a_large_cell_moves_as_in_free_space():
    """The images of a stresslet act like the inverse cube of the cell."""
    errors = []
    fixed = SpectralEngine(nodes=10, dt=0.02, order=2)  # the same steps in each
    problem = replace(PROBLEM, fiber=Fiber(slenderness=1e-2), mu_bar=10.0, engine=fixed)
    free = run(replace(problem, domain=Free()), shapes=SHAPES[:1], until=0.3)
    for side in (4.0, 8.0):
        cell = replace(problem, domain=Sheared((side, side, side)))
        found = run(cell, shapes=SHAPES[:1], until=0.3)
        apart = values(found.data, "shear_stress") - values(free.data, "shear_stress")
        errors.append(np.abs(apart).max() / np.abs(values(free.data, "shear_stress")).max())
    assert errors[1] < 2e-3
    assert errors[1] < 0.3 * errors[0]


def test_the_fluid_moves_with_the_lattice(whole):
    points = np.random.default_rng(0).uniform(0.0, 1.5, (8, 3))
    cell = PROBLEM.domain_at(0.4)
    vector = cell.lattice_vectors(np.array([-1.0, 2.0, 1.0]))
    near, far = (
        velocity_from_run(whole, p, time=0.4, problem=PROBLEM) for p in (points, points + vector)
    )
    assert_close(far - near, np.tile([vector[1], 0.0, 0.0], (8, 1)), atol=1e-9)
    added = near - PROBLEM.flow.velocity(points, 0.4)
    assert np.abs(added).max() > 1e-3


def test_the_case_comes_back_from_its_tables():
    case = case_from_tables(
        {
            "fiber": {"slenderness": 1e-2},
            "fluid": {"mu_bar": 1e3},
            "flow": {"kind": "oscillatory_shear", "frequency": 0.1},
            "domain": {"kind": "sheared", "periods": [2.0, 3.0, 4.0]},
            "stepping": {"until": 1.0},
        }
    )
    assert case.tables()["domain"]["sum"] == "ewald"
    assert case_from_tables(case.tables()).problem == case.problem


def test_the_choice_of_the_sum_is_recorded_and_can_be_made(whole):
    """The result does not depend on the cut-off to the tolerance of the sum."""
    steps = whole["numerics"].to_dataset()
    assert np.all(steps["modes"] > 0)
    chosen = float(steps["cutoff"][-1])
    assert 0.0 < chosen <= 0.7 + 1e-12, "up to half the least period"
    other = run(replace(PROBLEM, image_sum=FastImages(cutoff=0.4, split="gaussian")), until=0.2)
    assert set(other.data["numerics"]["cutoff"].to_numpy()) == {0.4}
    assert chosen != 0.4
    x = [d["trajectory"]["position"].sel(time=0.2).to_numpy() for d in (whole, other.data)]
    assert np.abs(x[0] - x[1]).max() < 1e-4
    with pytest.raises(InputError, match="split"):
        FastImages(split="hasimoto")
