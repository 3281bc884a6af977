"""Where a stored run goes on: its case, its last checkpoint, and what is noted about it."""

from __future__ import annotations

import json

from stokesfibers.core.errors import StoreError
from stokesfibers.core.status import Status
from stokesfibers.core.tables import Table, choose
from stokesfibers.fiber.initials import INITIALS
from stokesfibers.io.checkpoint import Checkpoint
from stokesfibers.io.provenance import provenance
from stokesfibers.io.store import RunStore
from stokesfibers.run.start import first_carry
from stokesfibers.stepping.base import AbstractStepper, C


def stored_case(store: RunStore) -> Table:
    """Return the resolved case of a run as tables."""
    try:
        return json.loads(store.attributes["case"])
    except (KeyError, TypeError, ValueError):
        raise StoreError(
            str(store.path), "a run with its case", "one without", "It cannot be resumed."
        ) from None


def continued(store: RunStore, stepper: AbstractStepper[C], checkpoint: Checkpoint) -> C:
    """Return the carry of a checkpoint; records behind it are dropped."""
    carry = stepper.restored(int(checkpoint.meta["step"]), checkpoint.arrays)
    store.truncate(checkpoint.lengths, Status("running", stepper.time(carry)).to_dict())
    return carry


def restarted(store: RunStore, stepper: AbstractStepper[C], case: Table) -> C:
    """Return the initial carry for a run that was killed before its first checkpoint."""
    if "initial" not in case:
        raise StoreError(
            str(store.path),
            "a run with a checkpoint",
            "one that was killed before its first",
            "Start it again, with overwrite.",
        )
    initial = choose(INITIALS, case["initial"], "initial")
    store.truncate(dict.fromkeys(store.lengths, 0), Status("running", 0.0).to_dict())
    problem = stepper.problem
    return first_carry(stepper, initial.curves(problem.fibers, problem.domain.lengths))


def note_resumption(store: RunStore, case: Table, until: float, now: float) -> None:
    """Write who resumed, and the new end, into the attributes; valid with the next commit."""
    before = json.loads(store.attributes.get("resumed", "[]"))
    case["stepping"]["until"] = until
    store.set_attributes(
        {
            "case": json.dumps(case),
            "resumed": json.dumps([*before, {"from_time": now, **provenance()}]),
        }
    )
