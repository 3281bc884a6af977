"""When to record: intervals of simulated time, never of steps."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError

MOST_RECORDS = 1e9
_ROUNDING = 1e-9  # of an interval: a step that ends on a recording time must count as on it


@dataclass(frozen=True)
class Schedule:
    """Recording intervals, in units of time.

    Attributes
    ----------
    positions_every
        Positions and tension; in a case until / 200 if left out.
    observables_every
        Observables; if None, a tenth of `positions_every`.
    checkpoint_every
        Restart points, written with the next positions; if None, with each of them.
    points
        Output points per fiber, equally spaced in arclength; if None, the nodes where they are so
        spaced, else 101.
    """

    positions_every: float
    observables_every: float | None = None
    checkpoint_every: float | None = None
    points: int | None = None

    def __post_init__(self) -> None:
        checks.positive("positions_every", self.positions_every)
        for name in ("observables_every", "checkpoint_every"):
            if getattr(self, name) is not None:
                checks.positive(name, getattr(self, name))
        if self.points is not None:
            checks.whole("points", self.points, 6)

    @property
    def observables_interval(self) -> float:
        """Interval of the observables."""
        return self.observables_every or self.positions_every / 10.0

    @property
    def checkpoint_interval(self) -> float:
        """Interval of the checkpoints."""
        return self.checkpoint_every or self.positions_every


def every(
    positions: float,
    *,
    observables: float | None = None,
    checkpoint: float | None = None,
    points: int | None = None,
) -> Schedule:
    """Return the schedule that records positions each `positions` units of time.

    Parameters
    ----------
    positions, observables, checkpoint, points
        See `Schedule`.
    """
    return Schedule(positions, observables, checkpoint, points)


def refuse_endless(record: Schedule, until: float) -> None:
    """Raise InputError if a run to `until` would have more records than any disk holds."""
    for name in ("positions_every", "observables_every"):
        interval = getattr(record, name)
        if interval is not None and until / interval > MOST_RECORDS:
            expected = f"an interval that gives at most {MOST_RECORDS:.0e} records"
            raise InputError(f"record.{name}", expected, f"{interval:g} until t = {until:g}")


def due_until(interval: float, t: float) -> int:
    """Return how many multiples of `interval` lie in (0, t], to rounding."""
    return floor(t / interval + _ROUNDING)


def due_times(interval: float, before: float, now: float) -> list[float]:
    """Return the multiples of `interval` in (before, now], to rounding.

    One that is a rounding behind `now` counts as it is: another end of the run must not change it.
    """
    first, last = due_until(interval, before) + 1, due_until(interval, now)
    return [k * interval for k in range(first, last + 1)]


def is_due(interval: float, before: float, now: float) -> bool:
    """Return whether a multiple of `interval` lies in (before, now], to rounding."""
    return due_until(interval, now) > due_until(interval, before)
