"""What a run will cost: a few steps taken in memory and thrown away, and simple counting."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

from stokesfibers.problem.problem import Problem
from stokesfibers.run.layout import OutputPoints, observable_records, trajectory_records
from stokesfibers.run.moment import snapshot
from stokesfibers.run.schedule import Schedule, due_until
from stokesfibers.run.simulate import reproducible
from stokesfibers.run.start import Initial, first_carry
from stokesfibers.stepping.base import AbstractStepper, C
from stokesfibers.stepping.engines import stepper_of

_STEP_BYTES = 72  # the numerics of a step
_TRIAL_SECONDS = 1.0
_LONGEST = 8.0  # seconds, where steps are still those of a start
_START_STEPS = 50  # a run starts with low order and short steps; after so many they are typical
_LATEST = 30  # steps of the trial whose median stands for all
_TRIES = 3


@dataclass(frozen=True)
class Cost:
    """What a run will cost.

    Attributes
    ----------
    steps
        Number of steps.
    positions, observables
        Number of records.
    step_seconds
        Wall time of one step, measured.
    seconds
        Wall time of the run.
    store_bytes
        Size of the store.
    settled
        Whether the trial got beyond the short steps of a start; else `steps` is far too many.
    """

    steps: int
    positions: int
    observables: int
    step_seconds: float
    seconds: float
    store_bytes: int
    settled: bool


def estimate(
    problem: Problem,
    initial: Initial,
    *,
    until: float,
    record: Schedule,
    threads: int | None = None,
) -> Cost:
    """Return the cost of a run, from steps with this problem on this machine.

    Where the steps vary, their number is that of a short trial, taken to go on alike.

    Parameters
    ----------
    problem
        The case.
    initial
        Shapes at time 0.
    until
        Time to stop.
    record
        What is recorded when.
    threads
        Threads of a step; None for all cores.

    Raises
    ------
    InputError
        If the flow cannot be evaluated at the start.
    numpy.linalg.LinAlgError, StepError
        If the first steps have no solution.
    """
    with reproducible():
        stepper = stepper_of(problem, threads)
        carry, _ = stepper.step(first_carry(stepper, initial))  # compiles what is not
        points = OutputPoints(record.points)

        def look() -> tuple[Any, Any]:
            moment = snapshot(stepper, carry)
            return observable_records(moment), trajectory_records(moment, points)

        observed, placed = look()
        look_seconds = _fastest(look)
        step_seconds, steps, end, settled = _steps(stepper, carry, until)
    most = None if stepper.dense else steps
    positions = _records(record.positions_every, end, most)
    observables = _records(record.observables_interval, end, most)
    return Cost(
        steps=steps,
        positions=positions,
        observables=observables,
        step_seconds=step_seconds,
        seconds=steps * step_seconds + max(positions, observables) * look_seconds,
        store_bytes=positions * _size(placed)
        + observables * _size(observed)
        + settled * steps * _STEP_BYTES,
        settled=settled,
    )


def _steps(stepper: AbstractStepper[C], carry: C, until: float) -> tuple[float, int, float, bool]:
    """Return what a step takes, how many there will be, where they end, and if that can be told."""
    if not stepper.dense:
        dt = stepper.time(carry) / carry.step
        steps = ceil(until / dt - 1e-9)
        return _fastest(lambda: stepper.step(carry)), steps, steps * dt, True
    started, taken, size = perf_counter(), deque[float](maxlen=_LATEST), until
    while True:
        begun = perf_counter()
        carry, report = stepper.step(carry)
        taken.append(perf_counter() - begun)
        trial = perf_counter() - started
        size = report.step_size  # the first steps of a run are short
        typical = carry.step > _START_STEPS
        if stepper.reached(carry, until) or trial > (_TRIAL_SECONDS if typical else _LONGEST):
            break
    left = max(0.0, until - stepper.time(carry))
    return median(taken), carry.step + ceil(left / size), until, left == 0.0 or typical


def _records(interval: float, end: float, most: int | None) -> int:
    count = due_until(interval, end)
    return 1 + (count if most is None else min(most, count))


def _fastest(work: Callable[[], Any]) -> float:
    """Return the shortest wall time of a few calls: the rest is the machine's other business."""
    times: list[float] = []
    while len(times) < _TRIES and sum(times) < _TRIAL_SECONDS:
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return min(times)


def _size(records: dict[str, np.ndarray]) -> int:
    return sum(values.nbytes for values in records.values())
