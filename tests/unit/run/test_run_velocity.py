"""The fluid's velocity during a run and from a stored one."""

from __future__ import annotations

import numpy as np
import pytest

import stokesfibers as sf
from support import assert_close

POINTS = np.array([[0.3, 0.4, 0.1], [-0.2, 0.6, -0.3], [5.0, 1.0, 0.0]])


def _run(**options):
    fiber = sf.Fiber(slenderness=1e-2)
    problem = sf.Problem(
        fiber, mu_bar=100.0, flow=sf.Shear(2.0), engine=sf.PaperEngine(intervals=20, dt=0.01)
    )
    initial = sf.shapes.nearly_straight(fiber, angle=2.3, amplitude=-0.5)
    return problem, sf.simulate(problem, initial, until=0.1, record=sf.every(0.05), **options)


def test_velocity_from_a_stored_run_equals_that_during_it(tmp_path):
    seen = {}

    def watch(moment):
        seen[round(moment.time, 6)] = sf.fluid_velocity(problem_of(), moment.snapshot(), POINTS)

    def problem_of():
        return sf.Problem(
            sf.Fiber(slenderness=1e-2),
            mu_bar=100.0,
            flow=sf.Shear(2.0),
            engine=sf.PaperEngine(intervals=20, dt=0.01),
        )

    _, result = _run(watch=watch, out=tmp_path / "run.zarr")
    for time in (0.05, 0.1):
        stored = sf.velocity_from_run(result.data, POINTS, time=time)
        assert_close(stored, seen[time], rtol=1e-14)
        undisturbed = np.stack([2.0 * POINTS[:, 1], 0 * POINTS[:, 1], 0 * POINTS[:, 1]], axis=-1)
        disturbance = np.abs(stored - undisturbed).max(axis=1)
        assert disturbance[0] > 5e-3  # beside the fiber
        assert disturbance[2] < 1e-3  # far away


def test_a_time_that_is_not_recorded_is_refused():
    _, result = _run()
    for time in (-0.1, 0.2, np.nan):
        with pytest.raises(sf.InputError, match="time"):
            sf.velocity_from_run(result.data, POINTS, time=time)
