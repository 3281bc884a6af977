"""Runs a problem: start, advance, stop cleanly, resume."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from threadpoolctl import threadpool_limits

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.core.status import Status
from stokesfibers.core.tables import Table, build, to_table
from stokesfibers.core.team import ALONE, AbstractTeam
from stokesfibers.fiber.parameters import RADIUS_PROFILE
from stokesfibers.io.layout import ArrayLayout
from stokesfibers.io.provenance import provenance
from stokesfibers.io.reader import open_run
from stokesfibers.io.store import RunStore
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.tables import problem_from_tables, problem_to_tables
from stokesfibers.run.advance import Goal, Moment, Watch, advance
from stokesfibers.run.continued import continued, note_resumption, restarted, stored_case
from stokesfibers.run.events import Event, StopWhen
from stokesfibers.run.health import Health, health_layout
from stokesfibers.run.interrupt import stop_on_signal
from stokesfibers.run.layout import OutputPoints, layout
from stokesfibers.run.memory import MemorySink
from stokesfibers.run.moment import snapshot
from stokesfibers.run.recorder import Recorder, Sink
from stokesfibers.run.schedule import Schedule, refuse_endless
from stokesfibers.run.start import Initial, first_carry, nodal_positions
from stokesfibers.stepping.base import AbstractStepper, C
from stokesfibers.stepping.engines import stepper_of

if TYPE_CHECKING:
    import xarray as xr

OUTPUT_POINTS = 101
"""Output points per fiber where neither the case nor the engine's nodes say how many."""


@dataclass(frozen=True)
class Result:
    """A finished, stopped or failed run.

    Attributes
    ----------
    status
        How it ended.
    problem
        What was solved.
    path
        The store, if the run has one.
    opened
        Returns `data`.
    """

    status: Status
    problem: Problem
    path: Path | None = None
    opened: Callable[[], xr.DataTree] = field(kw_only=True, repr=False)

    @cached_property
    def data(self) -> xr.DataTree:
        """Everything recorded, as in the interface: ``trajectory``, ``observables``, ``numerics``.

        A store is opened when this is first asked for.
        """
        return self.opened()


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
    stop: tuple[Event, ...] = (),
    threads: int | None = None,
    team: AbstractTeam = ALONE,
) -> Result:
    """Run `problem` from time 0 to `until`.

    Parameters
    ----------
    problem
        The case.
    initial
        A curve, one per fiber, or points (fiber, point, 3) or (point, 3), resampled by arclength.
    until
        Time to stop; the run ends with the first step that reaches it.
    record
        What to record when.
    out, overwrite
        Folder of the store, ``RUN.zarr``, and whether a run there is replaced; None for memory.
    case
        Tables to store as the resolved case; by default those of `problem`.
    watch, stop
        Called after each step; conditions that end the run, `StopWhen` or functions of a snapshot.
    threads, team
        Threads, None for all cores, and ranks (this is 0, the others `assist`). Neither matters.

    Returns
    -------
    Result
        Also when the run blows up or is interrupted: what it has, with a status that says so.

    Raises
    ------
    InputError, StoreError
        If something given cannot be used or the store cannot be written.
    """
    refuse_endless(record, checks.positive("until", until))
    with reproducible(), stop_on_signal() as wish:
        stepper = stepper_of(problem, threads, team)
        record, carry = resolved(record, stepper), first_carry(stepper, initial)
        arrays = _arrays(_first_look(stepper, carry, stop), record)
        attributes = _attributes(problem, until, record, case, stop=stop)
        goal, labels = Goal(until, wish, watch, stop), {"stage": stepper.stages}
        begin = partial(_begun, stepper, record, Health(stepper, threads))
        if out is None:
            memory = MemorySink(arrays, attributes, labels)
            status = begin(memory, carry=carry, goal=goal)
            return Result(status, problem, opened=memory.tree().copy)
        path = Path(out)
        with RunStore.create(path, arrays, attributes, labels=labels, overwrite=overwrite) as store:
            return _stored(begin(store, carry=carry, goal=goal), problem, path)


def resume(
    path: str | PathLike[str],
    *,
    until: float | None = None,
    problem: Problem | None = None,
    allow_python: bool = False,
    watch: Watch | None = None,
    stop: tuple[Event, ...] = (),
    threads: int | None = None,
    team: AbstractTeam = ALONE,
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
    watch, stop
        Called after each step; conditions that end the run, beside those stored with it.
    threads, team
        Threads, None for all cores, and ranks (this is 0, the others `assist`). Neither matters.

    Raises
    ------
    InputError
        If `until` lies before the checkpoint, or the store's case cannot be used any more.
    StoreError
        If there is no usable run at `path`, or another process is writing it.
    """
    where = Path(path)
    with reproducible(), stop_on_signal() as wish, RunStore.open(where, mode="a") as store:
        case = stored_case(store)
        end = float(case["stepping"]["until"]) if until is None else checks.positive("until", until)
        if problem is None:
            problem = problem_from_tables(case, allow_python=allow_python)
        stepper = stepper_of(problem, threads, team)
        checkpoint = store.checkpoint()
        now, carry = 0.0, None
        if checkpoint is not None:
            now, carry = float(checkpoint.meta["recorded"]), continued(store, stepper, checkpoint)
        if until is not None and end < now * (1.0 - 1e-9):
            raise InputError("until", f"a time after t = {now:g}, where the run is", end)
        carry = carry or restarted(store, stepper, case)
        if end > now:
            note_resumption(store, case, end, now)
        record, health = Schedule(**case["record"]), Health(stepper, threads)
        recorder = Recorder(store, stepper, record, health=health, recorded=now)
        recorder.recall(store.attributes.get("crossings", "[]"), until=now)
        recorder.recall_errors(checkpoint)
        held = tuple(build(StopWhen, table, "stop") for table in case.get("stop", []))
        goal = Goal(end, wish, watch, (*held, *stop))
        fresh = not store.lengths["observables"]
        status = advance(recorder, stepper, carry, goal, fresh=fresh)
    return _stored(status, problem, where)


def _begun(
    stepper: AbstractStepper[C],
    record: Schedule,
    health: Health[C],
    sink: Sink,
    *,
    carry: C,
    goal: Goal,
) -> Status:
    recorder = Recorder(sink, stepper, record, health=health)
    return advance(recorder, stepper, carry, goal, fresh=True)


def _stored(status: Status, problem: Problem, path: Path) -> Result:
    return Result(status, problem, path, opened=partial(open_run, path.absolute()))


def _first_look(stepper: AbstractStepper[C], carry: C, stop: tuple[Event, ...]) -> Snapshot:
    """Return the initial state; InputError if a condition needs what the run does not record."""
    moment = snapshot(stepper, carry)
    for event in stop:
        event(moment)
    return moment


def _arrays(first: Snapshot, record: Schedule) -> dict[str, ArrayLayout]:
    return layout(first, OutputPoints(record.points)) | health_layout()


def resolved(record: Schedule, stepper: AbstractStepper[C]) -> Schedule:
    """Return the schedule with output points where the engine's nodes are not equally spaced."""
    if record.points is None and stepper.dense:
        return replace(record, points=OUTPUT_POINTS)
    return record


@contextmanager
def reproducible() -> Iterator[None]:
    """Keep BLAS on one thread: bitwise reproducible, and no slower at these sizes."""
    with threadpool_limits(1, user_api="blas"), np.errstate(all="ignore"):
        yield


def _attributes(
    problem: Problem, until: float, record: Schedule, case: Table | None, *, stop: tuple[Event, ...]
) -> Mapping[str, Any]:
    tables = dict(case or problem_to_tables(problem))
    held = [to_table(event) for event in stop if isinstance(event, StopWhen)]
    if held:
        tables["stop"] = held
    tables["stepping"] = {**tables.get("stepping", {}), "until": until}
    tables["record"] = to_table(record)
    return {
        "case": json.dumps(tables),
        "radius_profile": RADIUS_PROFILE,
        "units": "consistent units of the case; dimensionless where mu_bar, length 1, rigidity 1",
        "provenance": json.dumps(provenance()),
    }


__all__ = ["Moment", "Result", "nodal_positions", "resume", "simulate", "stored_case"]
