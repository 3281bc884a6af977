"""The fluid's velocity from a stored run: (5) at any points and any recorded time."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from stokesfibers.core.arrays import Points
from stokesfibers.core.errors import InputError
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.observe.velocity import fluid_velocity
from stokesfibers.problem.discretised import discrete_fibers
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.tables import problem_from_tables
from stokesfibers.run.moment import surroundings

if TYPE_CHECKING:
    import xarray as xr


def snapshot_of(data: xr.DataTree, problem: Problem, time: float) -> Snapshot:
    """Return the recorded moment nearest to `time` as a snapshot on the recorded points.

    Raises
    ------
    InputError
        If `time` lies outside what is recorded.
    """
    trajectory = data["trajectory"].to_dataset()
    times = trajectory["time"].to_numpy()
    if not times.size or not times[0] - 1e-9 <= time <= times[-1] * (1.0 + 1e-9):
        shown = f"{times[0]:g} to {times[-1]:g}" if times.size else "none recorded"
        raise InputError("time", f"a recorded time, {shown}", time)
    record = int(np.argmin(np.abs(times - time)))
    positions = trajectory["position"][record].to_numpy()
    tension = trajectory["tension"][record].to_numpy()
    fibers = discrete_fibers(problem, positions.shape[1] - 1)
    return Snapshot.take(
        float(times[record]),
        fibers,
        positions,
        tension,
        surroundings=surroundings(problem, float(times[record])),
    )


def velocity_from_run(
    data: xr.DataTree,
    points: Points,
    *,
    time: float,
    problem: Problem | None = None,
    allow_python: bool = False,
) -> Points:
    """Return the fluid's velocity (5) at `points`, at the recorded time nearest to `time`.

    Parameters
    ----------
    data
        A run, from `simulate` or `open_run`.
    points
        Where, (..., 3).
    time
        When; within the recorded times.
    problem
        The problem, if the run cannot tell it (a flow typed in Python).
    allow_python
        Whether a flow from a user's file may run.

    Returns
    -------
    Velocities (..., 3), in units of length / time; NaN inside a fiber.

    Raises
    ------
    InputError
        If the time is not recorded or the points have another shape.
    """
    if problem is None:
        problem = problem_from_tables(json.loads(data.attrs["case"]), allow_python=allow_python)
    return fluid_velocity(problem, snapshot_of(data, problem, time), points)
