"""A triply periodic cell whose images slide over each other (Lees & Edwards 1972).

The lattice is spanned by ``(Lx, 0, 0)``, ``(offset, Ly, 0)`` and ``(0, 0, Lz)``: the image one
period up in y is displaced along x by the strain times Ly, as in a shear flow ``u_x = rate y``.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, hypot
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError
from stokesfibers.domain.domains import AbstractDomain


@dataclass(frozen=True)
class Sheared(AbstractDomain):
    """Periodic in three directions, sheared in x by y.

    Attributes
    ----------
    periods
        Period along x, y, z, in units of length.
    strain
        How far images one period up are displaced along x, over that period: the shear so far.
        Of a problem's domain: that at time 0, to which the flow adds.
    """

    periods: tuple[float, float, float]
    strain: float = 0.0
    kind: ClassVar[str] = "sheared"

    def __post_init__(self) -> None:
        periods = checks.vector3("periods", self.periods)
        if min(periods) <= 0.0:
            raise InputError("periods", "three lengths above 0", list(periods))
        object.__setattr__(self, "periods", periods)
        object.__setattr__(self, "strain", checks.finite("strain", self.strain))

    @property
    def lengths(self) -> Array:
        return np.array(self.periods)

    @property
    def offset(self) -> float:
        """Displacement along x of the image one period up, in [-Lx/2, Lx/2].

        Whole periods along x make no difference, so that after a strain of Lx / Ly all repeats.
        """
        lx, ly, _ = self.periods
        shift = self.strain * ly
        return shift - lx * round(shift / lx)

    @property
    def rows(self) -> int:
        # the nearest image is within half a diagonal of the cell's face, row k beyond (k - 1/2) Ly
        lx, ly, _ = self.periods
        return max(1, ceil(0.5 * hypot(lx, ly) / ly + 0.5) - 1)

    def slide_to(self, later: AbstractDomain) -> float:
        assert isinstance(later, Sheared)
        return (later.strain - self.strain) * self.periods[1]

    def lattice_vectors(self, numbers: Array) -> Array:
        vectors = np.asarray(numbers) * self.lengths
        vectors[..., 0] += np.asarray(numbers)[..., 1] * self.offset
        return vectors

    def at(self, strain: float) -> Sheared:
        """Return the same cell at another strain."""
        return Sheared(self.periods, strain)

    def wrap(self, points: Points) -> Points:
        """Return points (..., 3) moved into [0, Lx) x [0, Ly) x [0, Lz) by lattice vectors."""
        return self.wrapped(points)[0]

    def wrapped(self, points: Points) -> tuple[Points, Points]:
        """Return wrapped points (..., 3) and the whole numbers of lattice vectors taken off."""
        lengths = self.lengths
        inside = np.array(points, dtype=float)
        taken = np.zeros_like(inside)
        for axis in (2, 1, 0):
            taken[..., axis] = np.floor(inside[..., axis] / lengths[axis])
            inside[..., axis] -= taken[..., axis] * lengths[axis]
            if axis == 1:
                inside[..., 0] -= taken[..., 1] * self.offset
        return inside, taken

    def nearest_image(self, difference: Points) -> Points:
        """Return differences (..., 3) brought closest to zero by lattice vectors."""
        lx, ly, lz = self.periods
        plain = np.array(difference, dtype=float)
        plain[..., 2] -= lz * np.round(plain[..., 2] / lz)
        up = np.round(plain[..., 1] / ly)
        best = np.full(plain.shape[:-1], np.inf)
        nearest = plain.copy()
        # a row farther in y may be closer in x
        for step in sorted(range(-self.rows, self.rows + 1), key=abs):
            trial = plain.copy()
            trial[..., 1] -= (up + step) * ly
            trial[..., 0] -= (up + step) * self.offset
            trial[..., 0] -= lx * np.round(trial[..., 0] / lx)
            size = np.einsum("...i,...i->...", trial, trial)
            closer = size < best
            best = np.where(closer, size, best)
            nearest = np.where(closer[..., None], trial, nearest)
        return nearest
