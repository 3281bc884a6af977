"""Where the fibers are: free space, or space with periodic directions (Section 2.6).

Positions are stored unwrapped: a fiber crosses the border of the cell as if it were not there.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from math import prod
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError


class AbstractDomain(abc.ABC):
    """A domain with zero to three periodic directions along the axes."""

    kind: ClassVar[str]

    @property
    @abc.abstractmethod
    def lengths(self) -> Array:
        """Period along x, y, z, (3,); zero for a free direction."""

    @property
    def offset(self) -> float:
        """Displacement along x of the image one period up in y; zero unless sheared."""
        return 0.0

    @property
    def rows(self) -> int:
        """How many rows of images up and down in y the nearest one may lie in, beyond its own."""
        return 0

    def slide_to(self, later: AbstractDomain) -> float:  # noqa: ARG002
        """Return how far images one period up in y move along x until the domain is `later`."""
        return 0.0

    def lattice_vectors(self, numbers: Array) -> Array:
        """Return lattice vectors (..., 3) of whole `numbers` (..., 3)."""
        return np.asarray(numbers) * self.lengths

    @property
    def volume(self) -> float:
        """Volume of the cell; infinite if a direction is free."""
        return prod(self.lengths) if np.all(self.lengths > 0.0) else float("inf")

    def wrap(self, points: Points) -> Points:
        """Return points (..., 3) moved into the cell [0, period) of each periodic direction."""
        lengths = self.lengths
        periodic = lengths > 0.0
        wrapped = np.array(points, dtype=float)
        wrapped[..., periodic] %= lengths[periodic]
        return wrapped

    def nearest_image(self, difference: Points) -> Points:
        """Return differences (..., 3) brought closest to zero by whole periods."""
        lengths = self.lengths
        periodic = lengths > 0.0
        nearest = np.array(difference, dtype=float)
        part = nearest[..., periodic]
        nearest[..., periodic] = part - lengths[periodic] * np.round(part / lengths[periodic])
        return nearest


@dataclass(frozen=True)
class Free(AbstractDomain):
    """Unbounded fluid."""

    kind: ClassVar[str] = "free"

    @property
    def lengths(self) -> Array:
        return np.zeros(3)


@dataclass(frozen=True)
class Periodic(AbstractDomain):
    """Periodic in the directions with a period above zero.

    Attributes
    ----------
    periods
        Period along x, y, z, in units of length; 0 for a free direction.
    """

    periods: tuple[float, float, float]
    kind: ClassVar[str] = "periodic"

    def __post_init__(self) -> None:
        periods = checks.vector3("periods", self.periods)
        if min(periods) < 0.0 or max(periods) == 0.0:
            raise InputError(
                "periods",
                "three lengths, 0 for a free direction, at least one above 0",
                list(periods),
            )
        object.__setattr__(self, "periods", periods)

    @property
    def lengths(self) -> Array:
        return np.array(self.periods)
