"""Conditions that end a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.fiber import curves
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.problem.engine import PaperEngine, SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.events import StopWhen
from stokesfibers.run.schedule import every
from stokesfibers.run.simulate import resume, simulate

SPECTRAL = Problem(
    Fiber(slenderness=1e-2), mu_bar=10.0, flow=Shear(1.0), engine=SpectralEngine(nodes=10)
)
PAPER = replace(SPECTRAL, engine=PaperEngine(16, 0.0125, 20.0))


def start(problem, stop, out=None, until=2.0):
    shape = curves.straight(problem.fibers[0], angle=2.5)
    return simulate(problem, shape, until=until, record=every(0.1), out=out, stop=stop)


def upright(moment: Snapshot) -> float:
    """Turn positive when the fiber has passed the vertical."""
    ends = moment.shapes[0].x
    return float(ends[0, -1] - ends[0, 0])


def test_the_time_is_found_within_the_step():
    """A straight fiber stands upright after cot(angle) of the rate's time (45)."""
    result = start(SPECTRAL, (upright,))
    exact = -1.0 / np.tan(2.5)
    assert result.status.code == "done"
    assert result.status.time == pytest.approx(exact, rel=1e-3)
    assert "upright" in result.status.explanation
    assert result.data["trajectory"]["time"].to_numpy()[-1] <= result.status.time
    assert result.data["numerics"]["time"].to_numpy()[-1] > result.status.time


def test_fixed_steps_stop_at_their_end():
    result = start(PAPER, (upright,))
    assert result.status.time == pytest.approx(-1.0 / np.tan(2.5), abs=0.014)
    assert result.status.time == result.data["numerics"]["time"].to_numpy()[-1]


@pytest.mark.parametrize("problem", [SPECTRAL, PAPER], ids=["spectral", "paper"])
def test_a_bound_on_an_observable_ends_the_run_and_resume_goes_past_it(problem, tmp_path):
    stop = (StopWhen("first_normal_stress_difference", above=0.0),)
    out = tmp_path / "run.zarr"
    first = start(problem, stop, out)
    # the fiber leaves the axis of compression, theta = 3 pi / 4, where N_1 ~ sin(4 theta) is zero
    assert first.status.time == pytest.approx(-1.0 / np.tan(2.5) - 1.0, abs=0.014)
    assert "first normal stress difference above 0" in first.status.explanation
    n1 = first.data["observables"]["first_normal_stress_difference"].to_numpy()
    assert np.all(n1[:-1] <= 0.0)
    second = resume(out)
    assert second.status.time == pytest.approx(2.0, rel=1e-9)
    assert "condition" not in second.status.explanation


def test_what_is_true_from_the_start_does_not_stop():
    result = start(SPECTRAL, (StopWhen("largest_curvature", below=1.0),), until=0.2)
    assert result.status.time == 0.2


@pytest.mark.parametrize(
    ("arguments", "where"),
    [
        ({"observable": "curvature", "above": 1.0}, "observable"),
        ({"observable": "fiber_stress", "above": 1.0}, "observable"),
        ({"observable": "largest_curvature"}, "above"),
        ({"observable": "largest_curvature", "above": 1.0, "below": 0.0}, "above"),
        ({"observable": "largest_curvature", "above": float("nan")}, "above"),
    ],
)
def test_bad_conditions_are_refused(arguments, where):
    with pytest.raises(InputError) as caught:
        StopWhen(**arguments)
    assert caught.value.where == where


def test_an_observable_that_the_run_has_not_is_refused_before_there_is_a_store(tmp_path):
    with pytest.raises(InputError, match="smallest_gap"):
        start(SPECTRAL, (StopWhen("smallest_gap", below=0.1),), tmp_path / "run.zarr")
    assert not list(tmp_path.iterdir())
