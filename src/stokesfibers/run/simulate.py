"""Runs a problem: start, advance, stop cleanly, resume."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from stokesfibers.core import checks
from stokesfibers.core.arrays import Positions
from stokesfibers.core.errors import InputError, StoreError
from stokesfibers.core.status import Status
from stokesfibers.core.tables import Table, to_table
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.initial import given
from stokesfibers.fiber.parameters import RADIUS_PROFILE
from stokesfibers.io.provenance import provenance
from stokesfibers.io.store import RunStore, open_run
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.tables import problem_from_tables, problem_to_tables
from stokesfibers.run.interrupt import stop_on_signal
from stokesfibers.run.layout import LABELS, OutputPoints, layout
from stokesfibers.run.memory import MemorySink
from stokesfibers.run.recorder import Recorder, Sink
from stokesfibers.run.schedule import Schedule
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.stepping.paper import Carry, PaperStepper

Initial = Curve | tuple[Curve, ...] | np.ndarray
LARGEST_LENGTH_ERROR = 0.2
"""A fiber whose length is off by more than this fraction is no longer a solution."""


@dataclass(frozen=True)
class Moment:
    """What somebody watching a run is told after each step."""

    time: float
    until: float
    step_size: float
    length_error: float


Watch = Callable[[Moment], None]


@dataclass(frozen=True)
class Result:
    """A finished, stopped or failed run.

    Attributes
    ----------
    data
        Everything recorded, as described in the interface: ``trajectory``, ``observables``,
        ``numerics``.
    status
        How it ended.
    problem
        What was solved.
    path
        The store, if the run has one.
    """

    data: xr.DataTree
    status: Status
    problem: Problem
    path: Path | None = None


def simulate(
    problem: Problem,
    initial: Initial,
    *,
    until: float,
    record: Schedule,
    out: str | PathLike[str] | None = None,
    overwrite: bool = False,
    case: Table | None = None,
    watch: Watch | None = None,
) -> Result:
    """Run `problem` from time 0 to `until`.

    Parameters
    ----------
    problem
        The case.
    initial
        A curve, one curve per fiber, or points of shape (fiber, point, 3) or (point, 3), which
        are resampled by arclength.
    until
        Time to stop; the run ends with the first step that reaches it.
    record
        What to record when.
    out
        Folder of the store, ``RUN.zarr``; None keeps the run in memory.
    overwrite
        Replace an existing run at `out`.
    case
        Tables to store as the resolved case; by default those of `problem`.
    watch
        Called after each step.

    Returns
    -------
    Result
        Also when the run blows up or is interrupted: what it has, with a status that says so.

    Raises
    ------
    InputError, StoreError
        If something given cannot be used or the store cannot be written.
    """
    checks.positive("until", until)
    stepper = PaperStepper(problem)
    carry = _unthreaded(lambda: stepper.init(nodal_positions(initial, problem)))
    first = Snapshot.take(0.0, stepper.fibers, carry.positions, carry.tension)
    arrays = layout(first, OutputPoints(record.points))
    attributes = _attributes(problem, until, record, case)
    if out is None:
        memory = MemorySink(arrays, attributes, LABELS)
        status = _start(memory, stepper, record, carry, until, watch)
        return Result(memory.tree(), status, problem)
    with RunStore.create(out, arrays, attributes, labels=LABELS, overwrite=overwrite) as store:
        status = _start(store, stepper, record, carry, until, watch)
    return Result(open_run(out), status, problem, Path(out))


def resume(
    path: str | PathLike[str],
    *,
    until: float | None = None,
    problem: Problem | None = None,
    allow_python: bool = False,
    watch: Watch | None = None,
) -> Result:
    """Continue a stored run from its last checkpoint; the result is bitwise that of no stop.

    Parameters
    ----------
    path
        The store.
    until
        New time to stop; by default the run's own.
    problem
        The problem, if the store cannot tell it (a flow typed in Python).
    allow_python
        Whether a flow from a user's file may run.
    watch
        Called after each step.
    """
    with RunStore.open(path, mode="a") as store:
        case = json.loads(store.attributes["case"])
        end = float(case["stepping"]["until"]) if until is None else checks.positive("until", until)
        if problem is None:
            problem = problem_from_tables(case, allow_python=allow_python)
        arrays, meta = store.checkpoint()
        stepper = PaperStepper(problem)
        carry = Carry.restored(int(meta["step"]), arrays)
        if stepper.time(carry.step) >= end:
            status = Status(**store.status)
        else:
            store.truncate(meta["lengths"])
            recorder = Recorder(store, stepper, Schedule(**case["record"]))
            status = _unthreaded(lambda: _advance(recorder, stepper, carry, end, watch))
    return Result(open_run(path), status, problem, Path(path))


def nodal_positions(initial: Initial, problem: Problem) -> Positions:
    """Return the initial positions at the engine's nodes, (fiber, node, space)."""
    if isinstance(initial, np.ndarray):
        initial = given(initial, problem.fibers, where="initial")
    curves = initial if isinstance(initial, tuple) else (initial,)
    if len(curves) != len(problem.fibers):
        raise InputError("initial", f"{len(problem.fibers)} curves, one per fiber", len(curves))
    sigma = np.linspace(0.0, 1.0, problem.engine.intervals + 1)
    return np.stack([curve.at_fractions(sigma) for curve in curves])


def _unthreaded(work: Callable[[], Any]) -> Any:
    """Do `work` with BLAS on one thread: bitwise reproducible, and no slower at these sizes."""
    with threadpool_limits(1, user_api="blas"), np.errstate(all="ignore"):
        return work()


def _attributes(
    problem: Problem, until: float, record: Schedule, case: Table | None
) -> Mapping[str, Any]:
    tables = dict(case or problem_to_tables(problem))
    tables["stepping"] = {**tables.get("stepping", {}), "until": until}
    tables["record"] = to_table(record)
    return {
        "case": json.dumps(tables),
        "radius_profile": RADIUS_PROFILE,
        "units": "consistent units of the case; dimensionless where mu_bar, length 1, rigidity 1",
        "provenance": json.dumps(provenance()),
    }


def _start(
    sink: Sink,
    stepper: PaperStepper,
    record: Schedule,
    carry: Carry,
    until: float,
    watch: Watch | None,
) -> Status:
    recorder = Recorder(sink, stepper, record)
    recorder.start(carry)
    return _unthreaded(lambda: _advance(recorder, stepper, carry, until, watch))


def _advance(
    recorder: Recorder, stepper: PaperStepper, carry: Carry, until: float, watch: Watch | None
) -> Status:
    """Step until the end, a wish to stop, or failure; commit what there is; return the status."""
    steps = ceil(until / stepper.time(1) - 1e-9)
    with stop_on_signal() as wish:
        while carry.step < steps:
            try:
                ahead, report = stepper.step(carry)
                error = _length_error(ahead, stepper)
            except np.linalg.LinAlgError:
                error = np.inf
            if not error < LARGEST_LENGTH_ERROR:
                status = _failed(stepper, carry)
                recorder.commit(None, status)
                return status
            carry = ahead
            recorder.step(carry, report)
            if watch is not None:
                watch(Moment(report.time, until, report.step_size, error))
            if wish.stop and carry.step < steps:
                status = Status(
                    "interrupted", report.time, "Stopped on request", "Continue with resume"
                )
                recorder.commit(carry, status)
                return status
    end = stepper.time(carry.step)
    note = ""
    if abs(end - until) > 1e-9 * until:
        note = f"The step does not divide until = {until:g}; stopped at the next one"
    status = Status("done", end, note)
    recorder.commit(carry, status)
    return status


def _length_error(carry: Carry, stepper: PaperStepper) -> float:
    """Return the largest relative error of the polygons' lengths; infinite if not finite."""
    chords = np.linalg.norm(np.diff(carry.x, axis=2), axis=1).sum(axis=1)
    lengths = np.array([f.grid.length for f in stepper.fibers])
    error = float(np.max(np.abs(chords - lengths) / lengths))
    return error if np.isfinite(error) and np.isfinite(carry.slow).all() else np.inf


def _failed(stepper: PaperStepper, carry: Carry) -> Status:
    return Status(
        "failed",
        stepper.time(carry.step),
        "The solution blew up in the next step: a fiber's length is off by more than "
        f"{LARGEST_LENGTH_ERROR:.0%} or not finite. What came before is kept",
        "Take a smaller stepping.dt or more discretization.intervals; 'stokesfibers check' "
        "shows doubtful choices",
    )


__all__ = ["Moment", "Result", "StoreError", "nodal_positions", "resume", "simulate"]
