"""What every engine's stepper offers to the loop of a run."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar, Generic, Protocol, TypeVar

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import StokesFibersError
from stokesfibers.fiber.curves import Curve
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.sampled import View
from stokesfibers.stepping.report import StepReport


class StepError(StokesFibersError):
    """The next step cannot be taken; the message says why, `hint` what to try.

    Parameters
    ----------
    message
        What went wrong.
    hint
        What to try.
    """

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(message)
        self.hint = hint


class Carry(Protocol):
    """Everything the next step needs."""

    @property
    def step(self) -> int:
        """Number of steps taken."""
        ...

    def arrays(self) -> dict[str, Array]:
        """Return all arrays by name, for a checkpoint."""
        ...


C = TypeVar("C", bound=Carry)


class AbstractStepper(abc.ABC, Generic[C]):
    """Advances a problem; a step depends on the carry alone.

    Attributes
    ----------
    problem
        What is solved.
    dense
        Whether the state is known between steps: records then fall on their exact times.
    stages
        Names of the two parts of a step whose wall time is reported.
    """

    problem: Problem
    dense: ClassVar[bool]
    stages: ClassVar[tuple[str, str]]

    @abc.abstractmethod
    def start(self, curves: tuple[Curve, ...]) -> C:
        """Return the carry at time 0, one curve per fiber."""

    @abc.abstractmethod
    def step(self, carry: C) -> tuple[C, StepReport]:
        """Return the carry one step later and a report.

        Raises
        ------
        StepError, TensionError, numpy.linalg.LinAlgError
            If it cannot be taken.
        """

    def stored(self, carry: C) -> dict[str, Array]:
        """Return the arrays of a checkpoint; their shapes stay the same over a run."""
        return carry.arrays()

    @abc.abstractmethod
    def restored(self, step: int, arrays: Mapping[str, Array]) -> C:
        """Return the carry of `step` from the arrays of a checkpoint.

        Raises
        ------
        InputError
            If they are of another problem.
        """

    @abc.abstractmethod
    def time(self, carry: C) -> float:
        """Return the time of `carry`."""

    @abc.abstractmethod
    def reached(self, carry: C, until: float) -> bool:
        """Return whether `carry` is at `until` or behind it, to rounding."""

    @abc.abstractmethod
    def view(self, carry: C, t: float) -> View:
        """Return the fibers at a time `t` of the last step; its end unless `dense`.

        Chords between the points shown resolve the shapes.
        """

    def note(self, spatial_error: float) -> str:  # noqa: ARG002
        """Return what a run should say about its largest estimated error through lack of nodes."""
        return ""

    @abc.abstractmethod
    def length_error(self, carry: C) -> float:
        """Return the largest relative length error of a fiber; infinite if not finite."""
