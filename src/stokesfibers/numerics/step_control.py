"""How long the next step is and of what order: from estimated errors, or fixed by the user.

An error estimate is the local error of one step divided by what one step may commit, so that 1 is
the limit. Local errors of order k add up to h^k, one power of h less than each, hence the
allowance ``rtol^(6/5)`` of a single step: global errors then follow `rtol` itself at order 5.
"""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.numerics.bdf import GROWTH, HIGHEST_ORDER

SAFETY = 0.8
"""Fraction of the step that the estimate would allow."""
_EXPONENT = 1.2
_GAIN = 1.05  # a change of order must allow a step longer by this factor
_SMALLEST = 1e-30
_SHRINK = (0.25, 0.9)  # least and greatest ratio after a rejected step


@dataclass(frozen=True)
class Verdict:
    """What follows from the errors of a try.

    Attributes
    ----------
    accepted
        Whether the step stands.
    size
        Length of the next try.
    order
        Its order.
    """

    accepted: bool
    size: float
    order: int


class AbstractStepControl(abc.ABC):
    """A choice of step lengths and orders."""

    kind: ClassVar[str]

    @property
    @abc.abstractmethod
    def step_tolerance(self) -> float:
        """Relative error of the curvature that one step may commit."""

    @abc.abstractmethod
    def first(self, rate: float) -> float:
        """Return the length of the first step, where things change at `rate` [1/time]."""

    @abc.abstractmethod
    def orders(self, order: int, known: int) -> tuple[int, ...]:
        """Return the orders whose error is wanted, with `known` states in the history."""

    @abc.abstractmethod
    def judge(self, errors: Mapping[int, float], size: float, order: int, settled: int) -> Verdict:
        """Return what follows from a try of length `size` and `order`.

        Parameters
        ----------
        errors
            Error by order, for all `orders`; empty where none can be estimated, NaN or infinite
            where the step failed.
        size, order
            Of the try.
        settled
            Steps taken at this order before the try.
        """


@dataclass(frozen=True)
class AdaptiveSteps(AbstractStepControl):
    """Steps and orders from one tolerance.

    Attributes
    ----------
    rtol
        Wanted error of the shapes, relative to the fiber's length.
    highest_order
        1 ... 5.
    """

    rtol: float = 1e-4
    highest_order: int = HIGHEST_ORDER
    kind: ClassVar[str] = "adaptive"

    def __post_init__(self) -> None:
        if not 1e-12 <= checks.positive("rtol", self.rtol) <= 0.1:
            raise InputError("rtol", "a number from 1e-12 to 0.1", self.rtol)
        _check_order("highest_order", self.highest_order)

    @property
    def step_tolerance(self) -> float:
        return 0.25 * self.rtol**_EXPONENT

    def first(self, rate: float) -> float:
        return 1e-2 * self.step_tolerance**0.5 / rate

    def orders(self, order: int, known: int) -> tuple[int, ...]:
        near = (order - 1, order, order + 1)
        return tuple(q for q in near if 1 <= q <= self.highest_order and q < known)

    def judge(self, errors: Mapping[int, float], size: float, order: int, settled: int) -> Verdict:
        if not errors:  # the first step: short, and nothing to compare it with
            return Verdict(True, size, order)
        ratio = {q: SAFETY * max(e, _SMALLEST) ** (-1.0 / (q + 1)) for q, e in errors.items()}
        if not errors[order] <= 1.0:
            least, most = _SHRINK
            shrink = ratio[order] if errors[order] < float("inf") else least
            return Verdict(False, size * min(most, max(least, shrink)), order)
        if settled >= order:
            best = max(ratio, key=lambda q: ratio[q])
            free = min(ratio[best], ratio[order])  # both limited by growth: prefer the higher order
            if ratio[best] > _GAIN * ratio[order] or (best > order and free > max(GROWTH)):
                order = best
        return Verdict(True, size * min(GROWTH[order], ratio[order]), order)


@dataclass(frozen=True)
class FixedSteps(AbstractStepControl):
    """Steps of one length and order, after a start that raises both.

    The start takes steps from dt / 10^4 upwards, each longer by what the order's stability allows:
    otherwise its first steps of low order would spoil the order of the whole.

    Attributes
    ----------
    dt
        Step length [time].
    order
        1 ... 5.
    """

    dt: float
    order: int = 4
    kind: ClassVar[str] = "fixed"

    def __post_init__(self) -> None:
        checks.positive("dt", self.dt)
        _check_order("order", self.order)

    @property
    def step_tolerance(self) -> float:
        return 1.0

    def first(self, rate: float) -> float:  # noqa: ARG002
        return 1e-4 * self.dt

    def orders(self, order: int, known: int) -> tuple[int, ...]:
        return (order,) if order < known else ()

    def judge(self, errors: Mapping[int, float], size: float, order: int, settled: int) -> Verdict:  # noqa: ARG002
        if any(not e < float("inf") for e in errors.values()):
            return Verdict(False, 0.0, order)
        growth = GROWTH[self.order]
        raised = bool(errors) and order < self.order
        return Verdict(True, min(self.dt, growth * size), order + raised)


def _check_order(where: str, order: int) -> None:
    if not 1 <= checks.whole(where, order, 1) <= HIGHEST_ORDER:
        raise InputError(where, f"a whole number from 1 to {HIGHEST_ORDER}", order)
