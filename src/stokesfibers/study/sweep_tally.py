"""How far a sweep is: counts, share done, time left, reasons of failures."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from stokesfibers.study.sweep_folder import State, SweepFolder
from stokesfibers.study.sweep_plan import Plan, SweepCase


@dataclass(frozen=True)
class Tally:
    """Where a sweep stands.

    Attributes
    ----------
    active
        Whether it runs now.
    states
        Each case and how it stands.
    seconds_left
        Estimate from how fast this session has been so far; None where nothing tells.
    """

    active: bool
    states: tuple[tuple[SweepCase, State], ...]
    seconds_left: float | None = None

    def count(self, code: str) -> int:
        """Return how many cases stand so."""
        return sum(state.code == code for _, state in self.states)

    @property
    def total(self) -> int:
        """Number of cases."""
        return len(self.states)

    @property
    def share(self) -> float:
        """Share of all simulated time that is behind; a failed case counts whole."""
        parts = (
            1.0 if state.code in ("done", "failed") else min(state.time / case.until, 1.0)
            for case, state in self.states
        )
        return sum(parts) / self.total

    def doubtful(self) -> Iterator[tuple[SweepCase, State]]:
        """Yield the cases that ended well with results that cannot be trusted."""
        return ((c, state) for c, state in self.states if state.code == "done" and state.doubt)

    def failures(self) -> Iterator[tuple[SweepCase, State]]:
        """Yield the cases that failed."""
        return ((case, state) for case, state in self.states if state.code == "failed")


def tally(
    folder: SweepFolder,
    plan: Plan,
    *,
    active: bool | None = None,
    known: Mapping[str, State] | None = None,
) -> Tally:
    """Return where the sweep in `folder` stands.

    Parameters
    ----------
    folder, plan
        The sweep.
    active
        Whether it runs; None to find out.
    known
        States by key of cases that have ended, which are not looked up again.
    """
    runs = folder.active() if active is None else active
    held_states = known or {}
    states = tuple(
        (case, held_states.get(case.key) or folder.state(case, active=runs)) for case in plan.cases
    )
    found = Tally(runs, states)
    held = folder.session()
    if not runs or held is None:
        return found
    gained, spent = found.share - held["share"], time.time() - held["started"]
    if not gained > 0.0:
        return found
    return Tally(runs, states, spent * (1.0 - found.share) / gained)
