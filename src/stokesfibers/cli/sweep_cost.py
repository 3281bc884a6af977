"""What a sweep will cost, from some steps of its first and its last case."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from stokesfibers.cli.bars import patience
from stokesfibers.cli.words import duration, heading, lines, size

if TYPE_CHECKING:
    from stokesfibers.run.estimate import Cost
    from stokesfibers.study.sweep_plan import Plan, SweepCase

_Ends = dict[str, "Cost | None"]


def say_cost(plan: Plan, workers: int | None, *, allow_python: bool) -> None:
    """Print what the first and the last case will take, and all if they cost alike."""
    from stokesfibers.study.sweep_workers import workers_of

    ends = {case.key: case for case in (plan.cases[0], plan.cases[-1])}.values()
    with patience("taking some steps of the first and the last case"):
        found = {case.name: _cost(plan, case, allow_python=allow_python) for case in ends}
    heading("Cost")
    lines(_rows(found, len(plan.cases), workers_of(workers, len(plan.cases))))


def _cost(plan: Plan, case: SweepCase, *, allow_python: bool) -> Cost | None:
    """Return the cost of a case; None if its first steps have no solution."""
    import numpy as np

    from stokesfibers.constraint.coupled import TensionError
    from stokesfibers.run.estimate import estimate
    from stokesfibers.stepping.base import StepError
    from stokesfibers.study.sweep_plan import load_case

    held = load_case(case, Path(plan.folder), allow_python=allow_python)
    try:
        return estimate(held.problem, held.curves(), until=held.until, record=held.record)
    except (np.linalg.LinAlgError, StepError, TensionError):
        return None


def _rows(ends: _Ends, cases: int, processes: int) -> Iterator[tuple[str, ...]]:
    for name, cost in ends.items():
        if cost is None:
            yield name, "unknown: the first step has no solution"
        elif not cost.settled:
            yield name, "cannot be told: its steps still grow from the start's short ones"
        else:
            yield name, f"about {duration(cost.seconds)}, store {size(cost.store_bytes)}"
    known = [cost for cost in ends.values() if cost is not None and cost.settled]
    if len(known) == len(ends):
        whole = sum(c.seconds for c in known) / len(known) * cases / processes
        store = sum(c.store_bytes for c in known) / len(known) * cases
        on = "one process" if processes == 1 else f"{processes} processes"
        yield f"all {cases}, if alike", f"about {duration(whole)} on {on}, {size(store)}"
