"""The suspension by both engines, in its quick tier; rows fail where they should."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.experiments import oscillating, two_engines
from stokesfibers.experiments.two_engines_runs import HighOrderRun, Nudged

PERIODS = np.array([2.0, 0.0, 0.0])
CASE = oscillating.SuspensionRun(oscillating.QUICK, 1)


@pytest.fixture(scope="module")
def reproduced(quick):
    return quick("two_engines").data()


def test_quick(reproduced):
    data = reproduced
    assert data["time"][-1] == pytest.approx(51.2)
    loose, tight = (data[name].to_numpy() for name in ("distance", "nudged_distance"))
    assert 1e-6 < loose[-1].max() < 1e-3, "they differ, and by less than the tolerance"
    assert tight[0].max() == pytest.approx(1e-6, rel=0.5)
    assert tight[-1].max() < loose[-1].max()
    # Energies of both engines peak together; their models differ by a few per cent.
    paper, (one, other) = data["paper_energy"].to_numpy(), data["energy"].to_numpy()
    assert np.abs(one - other).max() < 1e-2 * one.max()
    assert 1e-3 < np.abs(paper - other).max() / paper.max() < 0.3
    assert data["paper_processor_seconds"] > 2.0 * data["processor_seconds"][0] > 0.0
    assert (data["steps"] < 0.5 * data["paper_steps"]).all()
    assert data["steps"][1] > data["steps"][0]


def _verdicts(data):
    return {row.quantity: row.verdict for row in two_engines.check(data)}


def test_shapes_that_differ_by_more_than_the_tolerance_are_told(reproduced):
    data = reproduced.copy(deep=True)
    data["distance"][-1, 0] = 1.1e-3
    wrong = [name for name, verdict in _verdicts(data).items() if verdict == "differs"]
    assert wrong == ["distance of shapes at t = 51.2, rtol = 0.001 and 0.0001, over 0.001"]


def test_a_run_that_is_not_twenty_times_faster_is_told(reproduced):
    data = reproduced.copy(deep=True)
    data.attrs["quick"] = 0
    name = "processor time of the paper's steps over that of the high order, rtol = 0.001"
    for factor, expected in ((21.0, "agrees"), (19.0, "differs")):
        data["paper_processor_seconds"] = factor * data["processor_seconds"][0]
        assert _verdicts(data)[name] == expected


def test_a_nudge_moves_every_fiber_by_as_much_and_keeps_its_length():
    fibers = CASE.problem.fibers
    straight, moved = CASE.initial, Nudged(CASE.initial, 1e-3)
    sigma = np.linspace(0.0, 1.0, 41)
    pairs = zip(straight.curves(fibers, PERIODS), moved.curves(fibers, PERIODS), strict=True)
    for one, other in pairs:
        assert np.isfinite(other.at_fractions(sigma)).all(), "not along the fiber"
        apart = np.linalg.norm(other.at_fractions(sigma) - one.at_fractions(sigma), axis=-1)
        assert 0.3e-3 < apart.max() < 1.01e-3
        assert np.ptp(apart) > 3e-5, "bent, not only moved"
        assert other.length() == pytest.approx(one.length(), rel=1e-5)
        alpha, h = np.linspace(0.05, 0.95, 7), 1e-5
        slope = (other.position(alpha + h) - other.position(alpha - h)) / (2.0 * h)
        np.testing.assert_allclose(other.tangent(alpha), slope, atol=1e-8)


def test_runs_have_names_of_their_own_and_the_papers_problem_but_for_the_engine():
    one, other = HighOrderRun(CASE, 1e-3), HighOrderRun(CASE, 1e-3, nudge=1e-6)
    assert len({CASE.name, one.name, other.name}) == 3
    assert one.problem.engine.kind == "spectral"
    assert one.problem.engine.rtol == 1e-3
    for field in ("kinds", "drag", "flow", "domain", "load"):
        assert getattr(one.problem, field) == getattr(CASE.problem, field), field
    assert one.schedule.observables_interval == CASE.schedule.observables_interval


@pytest.mark.slow
@pytest.mark.timeout(14400)
def test_full(full):
    found = full("two_engines")
    assert found.ours("distance of shapes at t = 128") < 1.0
    assert found.ours("processor time of the paper's steps over") > two_engines.GOAL
