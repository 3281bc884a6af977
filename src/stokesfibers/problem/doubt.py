"""What a doubt about a case is, and what of a plan it may depend on."""

from __future__ import annotations

from dataclasses import dataclass

from stokesfibers.core.arrays import Positions


@dataclass(frozen=True)
class Doubt:
    """A doubtful choice.

    Attributes
    ----------
    where
        Path in the case file.
    what
        What is doubtful.
    compared
        The numbers that say so.
    remedy
        What to try.
    """

    where: str
    what: str
    compared: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what} ({self.compared}). {self.remedy}"


@dataclass(frozen=True)
class Plan:
    """What is to be done with a problem, as far as doubts need it.

    Attributes
    ----------
    until
        Time to stop.
    positions_every, observables_every
        Recording intervals.
    positions
        Initial positions at the nodes, (fiber, node, space).
    angle, tilt
        The initial angles, radians; 0 where the shapes have none.
    across
        Share of the initial bend that is across the fiber.
    """

    until: float
    positions_every: float
    observables_every: float
    positions: Positions
    angle: float = 0.0
    tilt: float = 0.0
    across: float = 1.0
