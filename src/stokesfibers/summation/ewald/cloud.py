"""Sources and targets of an Ewald sum: checked, wrapped into the cell, with their filaments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array, Points, as_float
from stokesfibers.core.errors import InputError
from stokesfibers.domain.domains import AbstractDomain
from stokesfibers.domain.sheared import Sheared

Integers = NDArray[np.int64]

MOST_POINTS = 2**31 - 1
IMAGES = np.array([3, 1, 1])
"""How many periods apart a target and a near source may be along x, y, z."""


@dataclass(frozen=True, eq=False)
class Lattice:
    """Periods (3,), infinite where free, and the offset along x of the image one period up."""

    periods: Array
    offset: float

    @classmethod
    def of(cls, domain: AbstractDomain) -> Lattice:
        """Return the lattice of a domain."""
        lengths = np.asarray(domain.lengths, dtype=float)
        offset = domain.offset if isinstance(domain, Sheared) else 0.0
        return cls(np.where(lengths > 0.0, lengths, np.inf), offset)

    @property
    def periodic(self) -> NDArray[np.bool_]:
        return np.isfinite(self.periods)

    def wrapped(self, points: Points) -> tuple[Array, Integers]:
        """Return points (n, 3) in the cell and the lattice vectors taken off, (3, n) each."""
        inside = points.T.copy()  # a single point would be contiguous either way
        taken = np.zeros(inside.shape)
        for axis in (2, 1, 0):
            if np.isfinite(self.periods[axis]):
                taken[axis] = np.floor(inside[axis] / self.periods[axis])
                inside[axis] -= taken[axis] * self.periods[axis]
                if axis == 1:
                    inside[0] -= taken[1] * self.offset
        return inside, taken.astype(np.int64)

    def shift(self, images: Integers) -> Array:
        """Return lattice vectors (..., 3)."""
        periods = np.where(self.periodic, self.periods, 0.0)
        shift = as_float(images * periods)
        shift[..., 0] += images[..., 1] * self.offset
        return shift


@dataclass(frozen=True, eq=False)
class Cloud:
    """Sources and targets.

    Attributes
    ----------
    sources, targets
        As given, (n, 3) and (m, 3).
    inside, target_inside
        Wrapped into the cell, (3, n) and (3, m).
    filaments, target_filaments
        Numbers from 0 on; each source without a filament has one of its own; -1 for targets that
        leave nothing out.
    keys, target_keys
        The same for sources and targets of one filament in the same image, (n,) and (m,).
    jumps
        What a key loses by an image, per lattice vector, (3,).
    """

    lattice: Lattice
    sources: Points
    targets: Points
    inside: Array
    target_inside: Array
    filaments: Integers
    target_filaments: Integers
    keys: NDArray[np.int32]
    target_keys: NDArray[np.int32]
    jumps: Integers

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest wrapped coordinates of sources and targets, (3,) each."""
        both = (self.inside, self.target_inside)
        low = np.min([p.min(axis=1) for p in both], axis=0)
        high = np.max([p.max(axis=1) for p in both], axis=0)
        return low, high


def _points(where: str, points: object) -> Points:
    values = as_float(points)
    if values.ndim != 2 or values.shape[1] != 3:
        raise InputError(where, "an array of shape (n, 3)", f"shape {values.shape}")
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if bad.size:
        raise InputError(f"{where}[{bad[0]}]", "finite coordinates", values[bad[0]].tolist())
    return values


def _numbers(where: str, filaments: object, count: int) -> Integers:
    values = np.asarray(filaments)
    if values.shape != (count,) or (count and values.dtype.kind not in "iu"):
        raise InputError(where, f"{count} whole numbers", f"{values.dtype} of shape {values.shape}")
    return values.astype(np.int64)


def _renumbered(own: Integers, theirs: Integers) -> tuple[Integers, Integers]:
    """Return filament numbers from 0 on; sources with -1 get fresh ones, targets keep -1."""
    names = np.unique(own[own >= 0])
    fresh = np.searchsorted(names, np.maximum(own, 0))
    alone = own < 0
    fresh[alone] = names.size + np.arange(int(alone.sum()))
    at = np.searchsorted(names, np.maximum(theirs, 0))
    known = (theirs >= 0) & (at < names.size)
    if names.size:
        known &= names[np.minimum(at, names.size - 1)] == theirs
    return fresh, np.where(known, at, -1)


def _keys(
    filaments: Integers, taken: Integers, target_filaments: Integers, target_taken: Integers
) -> tuple[NDArray[np.int32], NDArray[np.int32], Integers]:
    """Return keys of sources and targets and the jumps of a key per lattice vector."""
    count = int(filaments.max(initial=-1)) + 1
    reference = np.zeros((3, count), dtype=np.int64)
    reference[:, filaments] = taken
    own = taken - reference[:, filaments]
    some = target_filaments >= 0
    theirs = target_taken[:, some] - reference[:, target_filaments[some]]
    both = np.concatenate([own, theirs], axis=1)
    low = both.min(axis=1, initial=0)
    spans = both.max(axis=1, initial=0) - low + 1 + 2 * IMAGES
    jumps = np.array([spans[1] * spans[2], spans[2], 1])
    if count * int(spans.prod()) > MOST_POINTS:
        raise InputError(
            "sources", f"filaments times images below {MOST_POINTS}", count * int(spans.prod())
        )
    start = (low - IMAGES)[:, None]
    keys = filaments * spans.prod() + jumps @ (own - start)
    target_keys = np.full(target_filaments.shape, -1, dtype=np.int64)
    target_keys[some] = target_filaments[some] * spans.prod() + jumps @ (theirs - start)
    return keys.astype(np.int32), target_keys.astype(np.int32), jumps


def gather(
    domain: AbstractDomain,
    sources: object,
    targets: object | None,
    *,
    filaments: object | None = None,
    target_filaments: object | None = None,
) -> Cloud:
    """Return the cloud of sources and targets; see `EwaldSum.plan`.

    Raises
    ------
    InputError
        If shapes are wrong or coordinates are not finite.
    """
    lattice = Lattice.of(domain)
    own = _points("sources", sources)
    count = len(own)
    names = np.full(count, -1) if filaments is None else _numbers("filaments", filaments, count)
    fresh, _ = _renumbered(names, names)
    inside, taken = lattice.wrapped(own)
    if targets is None:
        theirs, target_inside, target_taken, their_names = own, inside, taken, fresh
    else:
        theirs = _points("targets", targets)
        target_inside, target_taken = lattice.wrapped(theirs)
        given = np.full(len(theirs), -1) if target_filaments is None else target_filaments
        their_names = _renumbered(names, _numbers("target_filaments", given, len(theirs)))[1]
    keys, target_keys, jumps = _keys(fresh, taken, their_names, target_taken)
    return Cloud(
        lattice,
        own,
        theirs,
        inside,
        target_inside,
        fresh,
        their_names,
        keys,
        target_keys,
        jumps,
    )
