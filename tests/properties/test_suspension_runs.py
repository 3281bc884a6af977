"""Runs of several fibers: restart, crossings, what they record."""

from __future__ import annotations

import json
import os
import signal

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.constraint.coupled import FixedPoint
from stokesfibers.domain import Periodic
from stokesfibers.fiber.suspension import Lattice, Suspension
from stokesfibers.load import StericRepulsion
from support import assert_close, assert_same


def _problem(**changes):
    arguments = {
        "mu_bar": 2e3,
        "flow": sf.OscillatoryShear(1.0, frequency=0.5),
        "engine": sf.PaperEngine(16, dt=0.02),
        "domain": Periodic((2.0, 0.0, 0.0)),
    }
    return sf.Problem(sf.Fiber(slenderness=1e-2, count=4), **(arguments | changes))


def _initial(problem, seed=3):
    placed = Suspension(seed=seed, box=(2.0, 1.0, 1.0), least_gap=0.1)
    return placed.curves(problem.fibers, problem.domain.lengths)


@pytest.mark.parametrize("load", [None, StericRepulsion(strength=2e3, range=0.3)])
def test_stopped_and_resumed_run_is_bitwise_the_unstopped_one(load, tmp_path):
    problem = _problem(**({} if load is None else {"load": load}))
    record = sf.every(0.1, observables=0.04)
    whole = sf.simulate(problem, _initial(problem), until=0.6, record=record)

    def stop(moment):
        if moment.time > 0.27:
            os.kill(os.getpid(), signal.SIGINT)

    path = tmp_path / "run.zarr"
    half = sf.simulate(problem, _initial(problem), until=0.6, record=record, out=path, watch=stop)
    assert half.status.code == "interrupted"
    done = sf.resume(path)
    assert done.status.code == "done"
    assert_same(whole.data, done.data)


def test_suspension_records_distances_stress_and_iterations(tmp_path):
    problem = _problem()
    result = sf.simulate(
        problem, _initial(problem), until=0.1, record=sf.every(0.05), out=tmp_path / "r.zarr"
    )
    seen = result.data["observables"]
    distance, gap = seen["smallest_distance"].to_numpy(), seen["smallest_gap"].to_numpy()
    assert (distance > gap).all()
    assert (distance - gap <= 0.02 + 1e-12).all()  # two radii at most
    assert_close(seen["extra_stress"], seen["fiber_stress"].sum("fiber"), rtol=1e-13)
    assert (result.data["numerics"]["iterations"].to_numpy() > 1).all()
    assert "particle_stress" not in seen  # no volume with one period


def test_fibers_that_cross_are_reported_with_pair_and_time():
    problem = sf.Problem(
        sf.Fiber(slenderness=1e-3, count=2),
        mu_bar=100.0,
        flow=sf.UserFlow(_towards_the_plane),
        engine=sf.PaperEngine(16, dt=0.02, beta=1.0),
    )
    first = sf.shapes.segment(problem.fibers[0], centre=(0, 0, 0.1), direction=np.array([1, 0, 0]))
    other = sf.shapes.segment(
        problem.fibers[1], centre=(0.02, 0.01, -0.1), direction=np.array([0, 1.0, 0])
    )
    result = sf.simulate(problem, (first, other), until=0.4, record=sf.every(0.1))
    assert result.status.code == "done"
    assert "Fibers 0 and 1 passed through each other at t = " in result.status.explanation
    assert "steric" in result.status.hint
    (crossing,) = json.loads(result.data.attrs["crossings"])
    assert crossing["fibers"] == [0, 1]
    assert 0.05 < crossing["time"] < 0.35


def _towards_the_plane(points, _time):
    """A flow that carries the upper half down and the lower half up, through each other."""
    velocity = np.zeros_like(points)
    velocity[:, 2] = -1.0 + 0.0 * points[:, 2]
    velocity[points[:, 1] ** 2 > 1.0, 2] = 0.0
    velocity[np.abs(points[:, 0] - 0.02) < 1e-2, 2] = 1.0
    return velocity


def test_sweeps_that_fail_at_the_start_are_an_input_error():
    problem = _problem(tension_solver=FixedPoint(tolerance=1e-15, most=3))
    with pytest.raises(sf.InputError, match=r"did not reach.*krylov"):
        sf.simulate(problem, _initial(problem), until=0.1, record=sf.every(0.05))


def test_lattice_places_every_fiber_in_its_cell():
    problem = _problem(domain=Periodic((4.0, 0.0, 0.0)))
    lattice = Lattice(cells=(2, 2, 1), box=(4.0, 3.0, 2.0), orientation="aligned")
    curves = lattice.curves(problem.fibers, problem.domain.lengths)
    middles = [curve.at_fractions(np.array([0.5]))[0] for curve in curves]
    expected = [[1, 0.75, 1], [1, 2.25, 1], [3, 0.75, 1], [3, 2.25, 1]]
    assert_close(middles, expected, rtol=1e-12)
