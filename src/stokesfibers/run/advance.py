"""The loop of a run: step, judge, record, and stop at the end, on request or on failure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import Any

import numpy as np

from stokesfibers.constraint.coupled import TensionError
from stokesfibers.core.arrays import Positions
from stokesfibers.core.errors import InputError, StoreError
from stokesfibers.core.status import Status
from stokesfibers.domain.crossings import Crossing, displacements, find_crossings
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.problem.problem import Problem
from stokesfibers.run.events import Event, Watchman
from stokesfibers.run.interrupt import Wish
from stokesfibers.run.moment import snapshot
from stokesfibers.run.recorder import Recorder
from stokesfibers.stepping.base import AbstractStepper, C, StepError

LARGEST_LENGTH_ERROR = 0.2
"""A fiber whose length is off by more than this fraction is no longer a solution."""
_ROUNDING = 1e-9
_PART_OF_A_STEP = 0.05  # of a length: how far a fiber may move between two looks at crossings


@dataclass(frozen=True)
class Moment:
    """What somebody watching a run is told after each step.

    Attributes
    ----------
    time, until
        Simulated time now and at the end.
    step_size
        Length of the step just taken.
    length_error
        Largest relative length error of a fiber, from its chords.
    snapshot
        Call it for shapes and tensions, for instance as the argument of ``fluid_velocity``.
    """

    time: float
    until: float
    step_size: float
    length_error: float
    snapshot: Callable[[], Snapshot]


Watch = Callable[[Moment], None]


@dataclass(frozen=True)
class Goal:
    """How far to go, who watches, and who may ask to stop.

    Attributes
    ----------
    until
        Time to stop; the run ends with the first step that reaches it.
    wish
        Looked at after each step.
    watch
        Called after each step, or None.
    stop
        Conditions that end the run before.
    """

    until: float
    wish: Wish
    watch: Watch | None = None
    stop: tuple[Event, ...] = ()


def advance(
    recorder: Recorder[C], stepper: AbstractStepper[C], carry: C, goal: Goal, *, fresh: bool = False
) -> Status:
    """Step until the end, a wish to stop, or failure; commit what there is; return the status.

    A fresh run, without records, gets its initial state recorded first.

    A store that can no longer be written ends the run as a failure: what was committed before is
    intact, but the stored status stays that of the last commit.
    """
    try:
        if fresh:
            recorder.start(carry)
        status, last = _advance(recorder, stepper, carry, goal)
        return recorder.commit(last, status)
    except StoreError as error:
        return Status(
            "failed",
            recorder.committed,
            f"The run can no longer be written: {error.got}. What was stored until this time is "
            "kept",
            error.hint,
        )


def _advance(
    recorder: Recorder[C], stepper: AbstractStepper[C], carry: C, goal: Goal
) -> tuple[Status, C | None]:
    """Return the final status and the carry to store with it, if a new one is wanted."""
    recorder.catch_up(carry, goal.until)
    watchman = Watchman(goal.stop, stepper, carry)
    while not stepper.reached(carry, goal.until):
        now = stepper.time(carry)
        if goal.wish.stop:
            return Status("interrupted", now, "Stopped on request", "Continue with resume"), carry
        try:
            ahead, report = stepper.step(carry)
            error = stepper.length_error(ahead)
        except TensionError as fault:
            return _tension_failed(now, fault), None
        except StepError as fault:
            return _step_failed(now, fault), None
        except np.linalg.LinAlgError:
            return _blown_up(now), None
        except InputError as fault:
            return _flow_failed(now, fault), None
        recorder.note_length(error, report)
        if not error < LARGEST_LENGTH_ERROR:
            return _blown_up(now), None
        recorder.note_crossings(_crossings(stepper, carry, ahead), report)
        carry = ahead
        came = watchman.look(now, carry)
        recorder.step(carry, report, goal.until if came is None else min(goal.until, came[0]))
        if goal.watch is not None:
            look = partial(snapshot, stepper, carry)
            goal.watch(Moment(report.time, goal.until, report.step_size, error, look))
        if came is not None and came[0] <= goal.until:
            return _stopped(*came), carry
    end = stepper.time(carry)
    if stepper.dense:
        end = min(end, goal.until)
    note = stepper.note(recorder.spatial_error)
    return _done(end, goal.until, recorder.crossings, note), carry


def _crossings(stepper: AbstractStepper[C], carry: C, ahead: C) -> tuple[Crossing, ...]:
    """Return the crossings of a step; a long one is looked at in parts, where it is known."""
    problem = stepper.problem
    if len(problem.fibers) == 1 and not problem.domain.lengths.any():
        return ()
    first, last = stepper.time(carry), stepper.time(ahead)
    after, parts = stepper.view(ahead, last).positions, 1
    # where it is known between steps, at the nodes of the step's end, which may be more
    before = stepper.view(ahead if stepper.dense else carry, first).positions
    if stepper.dense:
        parts = _parts(problem, before, after, (first, last))
    if parts <= 1:
        return find_crossings(before, after, problem.domain_at(first), problem.domain_at(last))
    found: list[Crossing] = []
    since = first
    for part in range(1, parts + 1):
        middle, then = after, first + (last - first) * part / parts
        if part < parts:
            middle = stepper.view(ahead, then).positions
        domains = problem.domain_at(since), problem.domain_at(then)
        found += [
            replace(c, fraction=(part - 1 + c.fraction) / parts)
            for c in find_crossings(before, middle, *domains)
        ]
        before, since = middle, then
    return tuple(found)


def _parts(
    problem: Problem, before: Positions, after: Positions, times: tuple[float, float]
) -> int:
    """Return in how many parts a step is looked at, so that none moves far past others in one."""
    domains = problem.domain_at(times[0]), problem.domain_at(times[1])
    moved = np.linalg.norm(displacements(before, after, *domains), axis=-1).max(axis=1)
    lengths = np.array([kind.length for kind in problem.fibers])
    return ceil(float(np.max(moved / lengths)) / _PART_OF_A_STEP)


def _done(end: float, until: float, crossings: list[dict[str, Any]], note: str) -> Status:
    notes, hint = [note] if note else [], ""
    if end - until > _ROUNDING * until:
        notes.append(
            f"The step does not divide until = {until:g}; the run ended with the next step"
        )
    if crossings:
        first = crossings[0]
        one, other = first["fibers"]
        notes.append(
            f"Fibers {one} and {other} passed through each other at t = {first['time']:.6g}"
            f"; crossings in all: {len(crossings)}, listed in the attribute 'crossings'"
        )
        hint = "What follows a crossing is not physical; add a steric load or take a smaller step"
    return Status("done", end, ". ".join(notes), hint)


def _stopped(when: float, what: str) -> Status:
    return Status(
        "done", when, f"Stopped by a condition: {what}", "Continue with resume and a later until"
    )


def _blown_up(now: float) -> Status:
    return Status(
        "failed",
        now,
        "The solution blew up in the next step: a fiber's length is off by more than "
        f"{LARGEST_LENGTH_ERROR:.0%} or not finite. What came before is kept",
        "Take a smaller stepping.dt or more discretization.intervals; 'stokesfibers check' "
        "shows doubtful choices",
    )


def _step_failed(now: float, fault: StepError) -> Status:
    return Status("failed", now, f"{fault}. What came before is kept", fault.hint)


def _tension_failed(now: float, fault: TensionError) -> Status:
    return Status(
        "failed",
        now,
        f"The tensions of the next step cannot be found: {fault}. What came before is kept",
        "Set constraint.solver = 'krylov', a larger constraint.tolerance, or a steric load that "
        "keeps fibers apart",
    )


def _flow_failed(now: float, fault: InputError) -> Status:
    what = "load" if fault.where.startswith("density function") else "background flow"
    return Status(
        "failed",
        now,
        f"The {what} cannot be used in the next step. {fault} What came before is kept",
        "Mend the function and start a new run",
    )
