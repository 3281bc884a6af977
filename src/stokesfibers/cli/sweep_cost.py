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


def say_cost(plan: Plan, workers: int | None, *, here: bool, allow_python: bool) -> None:
    """Print what the first and the last case will take, and all if they cost alike.

    How long all take on a cluster, not `here`, cannot be told.
    """
    from stokesfibers.study.sweep_workers import workers_of

    ends = {case.key: case for case in (plan.cases[0], plan.cases[-1])}.values()
    with patience("taking some steps of the first and the last case"):
        found = {case.name: _cost(plan, case, allow_python=allow_python) for case in ends}
    heading("Cost")
    processes = workers_of(workers, len(plan.cases)) if here else None
    lines(_rows(found, len(plan.cases), processes))


def _cost(plan: Plan, case: SweepCase, *, allow_python: bool) -> Cost | None:
    """Return the cost of a case; None if its first steps cannot be taken here."""
    import numpy as np

    from stokesfibers.constraint.coupled import TensionError
    from stokesfibers.core.errors import MissingExtraError
    from stokesfibers.problem.checks import large_memory
    from stokesfibers.run.estimate import estimate
    from stokesfibers.stepping.base import StepError
    from stokesfibers.study.sweep_plan import load_case

    held = load_case(case, Path(plan.folder), allow_python=allow_python)
    if any(True for _ in large_memory(held.problem)):
        return None
    try:
        return estimate(
            held.problem, held.curves(), until=held.until, record=held.record, threads=1
        )
    except (np.linalg.LinAlgError, StepError, TensionError, MissingExtraError):
        return None


def _rows(ends: _Ends, cases: int, processes: int | None) -> Iterator[tuple[str, ...]]:
    for name, cost in ends.items():
        if cost is None:
            yield name, "unknown: the first steps cannot be taken here"
        elif not cost.settled:
            yield name, "cannot be told: its steps still grow from the start's short ones"
        else:
            yield name, f"about {duration(cost.seconds)}, store {size(cost.store_bytes)}"
    known = [cost for cost in ends.values() if cost is not None and cost.settled]
    if processes is not None and len(known) == len(ends):
        whole = sum(c.seconds for c in known) / len(known) * cases / processes
        store = sum(c.store_bytes for c in known) / len(known) * cases
        on = "one process" if processes == 1 else f"{processes} processes"
        yield f"all {cases}, if alike", f"about {duration(whole)} of steps on {on}, {size(store)}"
        yield "", "and a few tenths of a second for each, to begin and to store"
