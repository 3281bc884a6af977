"""What a run will cost: a few steps taken in memory and thrown away, and simple counting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, floor
from time import perf_counter
from typing import Any

import numpy as np

from stokesfibers.core.arrays import Positions
from stokesfibers.problem.problem import Problem
from stokesfibers.run.layout import OutputPoints, observable_records, trajectory_records
from stokesfibers.run.moment import snapshot
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import reproducible
from stokesfibers.stepping.paper import PaperStepper

_STEP_BYTES = 56  # the numerics of a step
_WARM_UP = 1  # compilation, and the first step, which is another formula
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
    """

    steps: int
    positions: int
    observables: int
    step_seconds: float
    seconds: float
    store_bytes: int


def estimate(problem: Problem, initial: Positions, *, until: float, record: Schedule) -> Cost:
    """Return the cost of a run, from steps with this problem on this machine.

    Parameters
    ----------
    problem
        The case.
    initial
        Positions at the nodes, (fiber, node, space).
    until
        Time to stop.
    record
        What is recorded when.

    Raises
    ------
    InputError
        If the flow cannot be evaluated at the start.
    numpy.linalg.LinAlgError
        If the first steps have no solution.
    """
    with reproducible():
        stepper = PaperStepper(problem)
        carry = stepper.init(initial)
        for _ in range(_WARM_UP):
            carry, _ = stepper.step(carry)
        step_seconds = _fastest(lambda: stepper.step(carry))
        points = OutputPoints(record.points)

        def look() -> tuple[Any, Any]:
            moment = snapshot(stepper, carry)
            return observable_records(moment), trajectory_records(moment, points)

        observed, placed = look()
        look_seconds = _fastest(look)
    dt = stepper.time(1)
    steps = ceil(until / dt - 1e-9)
    end = steps * dt
    positions = 1 + min(steps, floor(end / record.positions_every + 1e-9))
    observables = 1 + min(steps, floor(end / record.observables_interval + 1e-9))
    return Cost(
        steps=steps,
        positions=positions,
        observables=observables,
        step_seconds=step_seconds,
        seconds=steps * step_seconds + max(positions, observables) * look_seconds,
        store_bytes=positions * _size(placed) + observables * _size(observed) + steps * _STEP_BYTES,
    )


def _fastest(work: Callable[[], Any]) -> float:
    """Return the shortest wall time of a few calls: the rest is the machine's other business."""
    times = []
    for _ in range(_TRIES):
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return min(times)


def _size(records: dict[str, np.ndarray]) -> int:
    return sum(values.nbytes for values in records.values())
