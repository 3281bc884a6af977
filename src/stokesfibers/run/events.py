"""Conditions that end a run: an observable beyond a bound, or a function of the user's.

A condition counts when it comes true; one that is true from the start does not end the run. Where
an engine knows its state between steps, the time is found within the step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import lookup, registered
from stokesfibers.observe.observables import recorded
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.run.moment import snapshot
from stokesfibers.stepping.base import AbstractStepper, C

Event = Callable[[Snapshot], float]
"""A number that turns positive where the run is to stop."""
_BISECTIONS = 40


@dataclass(frozen=True)
class StopWhen:
    """Stop when an observable leaves its bounds; of a value per fiber, when any fiber's does.

    Attributes
    ----------
    observable
        Name of a recorded observable, a scalar or one value per fiber.
    above
        Stop when it exceeds this; in its own units. Give this, 'below' or both.
    below
        Stop when it falls below this.
    """

    observable: str
    above: float | None = None
    below: float | None = None

    def __post_init__(self) -> None:
        scalars = [v.name for v in registered("observables") if set(v.dims) <= {"time", "fiber"}]
        if self.observable not in scalars:
            raise InputError("observable", f"one of {', '.join(scalars)}", repr(self.observable))
        if (self.above is None) == (self.below is None):
            came = "neither" if self.above is None else "both"
            raise InputError("above", "either above or below", came)
        name = "below" if self.above is None else "above"
        checks.finite(name, getattr(self, name))

    def __call__(self, moment: Snapshot) -> float:
        """Return how far the observable is beyond its bound.

        Raises
        ------
        InputError
            If the run has no such observable.
        """
        chosen = recorded(moment)
        if self.observable not in chosen:
            raise InputError("observable", f"one of {', '.join(chosen)}", repr(self.observable))
        values = chosen[self.observable](moment)
        if self.above is not None:
            return float(np.max(values)) - self.above
        assert self.below is not None
        return self.below - float(np.min(values))

    def __str__(self) -> str:
        meaning = lookup("observables", self.observable).meaning
        side = f"above {self.above:g}" if self.above is not None else f"below {self.below:g}"
        return f"{meaning} {side}"


class Watchman(Generic[C]):
    """Looks at the conditions after each step.

    Parameters
    ----------
    events
        The conditions.
    stepper
        Shows the fibers.
    carry
        Where the run starts.
    """

    def __init__(self, events: tuple[Event, ...], stepper: AbstractStepper[C], carry: C) -> None:
        self._events = events
        self._stepper = stepper
        self._met = [self._value(event, carry) > 0.0 for event in events]

    def look(self, before: float, carry: C) -> tuple[float, str] | None:
        """Return when a condition came true in the step from `before` to `carry`, and which."""
        first: tuple[float, str] | None = None
        for k, event in enumerate(self._events):
            met, was = self._value(event, carry) > 0.0, self._met[k]
            self._met[k] = met
            if met and not was:
                when = self._when(event, before, carry)
                if first is None or when < first[0]:
                    name = getattr(event, "__name__", "a condition")
                    first = when, str(event) if isinstance(event, StopWhen) else name
        return first

    def _value(self, event: Event, carry: C, t: float | None = None) -> float:
        return float(event(snapshot(self._stepper, carry, t)))

    def _when(self, event: Event, before: float, carry: C) -> float:
        low, high = before, self._stepper.time(carry)
        for _ in range(_BISECTIONS if self._stepper.dense else 0):
            middle = 0.5 * (low + high)
            if self._value(event, carry, middle) > 0.0:
                high = middle
            else:
                low = middle
        return high
