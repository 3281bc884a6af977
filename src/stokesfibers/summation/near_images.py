"""Which images of which bodies may be near which others: balls in a lattice of any shape.

Bodies are balls around fibers or single points. The images that reach into the neighbourhood of the
cell are listed once, and a k-d tree finds near pairs: the cost grows like the number of bodies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array, Points
from stokesfibers.summation.ewald.cloud import Lattice

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Balls:
    """Centres, unwrapped, (body, 3), and radii (body,)."""

    centres: Points
    radii: Array

    @classmethod
    def around(cls, points: Array) -> Balls:
        """Return the balls around `points` of shape (body, 3, point)."""
        centres = 0.5 * (points.min(axis=2) + points.max(axis=2))
        apart = np.linalg.norm(points - centres[:, :, None], axis=1)
        return cls(centres, apart.max(axis=1))


@dataclass(frozen=True)
class NearImages:
    """Sources near each target, listed target by target.

    Attributes
    ----------
    start
        Where the list of each target starts, (target + 1,).
    source
        Indices of sources, (pair,).
    shift
        Lattice vectors that bring the target to the source, (pair, 3).
    """

    start: Indices
    source: Indices
    shift: Points


def near_images(
    targets: Balls, sources: Balls, reach: Array, lattice: Lattice, *, first: int | None = None
) -> NearImages:
    """Return the sources and images whose balls may be within `reach` (source,) of each target.

    With `first`, targets are the sources from that one on, and a body is not its own neighbour in
    the same image. The list of a target does not depend on the others.
    """
    inside, taken = lattice.wrapped(targets.centres)
    own, own_taken = lattice.wrapped(sources.centres)
    away = float(targets.radii.max() + sources.radii.max() + reach.max())
    images = _images(lattice, inside.T, own.T, away)
    target, second, which = _pairs(inside.T, own.T, images, away)
    # x_t + shift is to x_s as the wrapped target is to the image of the wrapped source
    at_targets, at_sources = lattice.shift(taken.T), lattice.shift(own_taken.T)
    shift = at_sources[second] - at_targets[target] - images[which]
    apart = np.linalg.norm(targets.centres[target] + shift - sources.centres[second], axis=1)
    near = apart < targets.radii[target] + sources.radii[second] + reach[second]
    if first is not None:
        near &= (target + first != second) | np.any(np.abs(shift) > 0.0, axis=1)
    target, second, shift = target[near], second[near], shift[near]
    order = np.lexsort((*shift.T, second, target))
    start = np.searchsorted(target[order], np.arange(len(inside.T) + 1))
    return NearImages(start, second[order], np.ascontiguousarray(shift[order]))


def _images(lattice: Lattice, inside: Points, own: Points, away: float) -> Points:
    """Return the lattice vectors whose images of the sources may be within `away`, (image, 3)."""
    periods = np.where(lattice.periodic, lattice.periods, np.inf)
    most = np.where(lattice.periodic, np.ceil(away / periods) + 1.0, 0.0).astype(int)
    if lattice.offset != 0.0:
        most[0] += int(np.ceil(abs(lattice.offset) * most[1] / periods[0]))
    steps = np.stack(
        np.meshgrid(*[np.arange(-n, n + 1) for n in most], indexing="ij"), axis=-1
    ).reshape(-1, 3)
    shifts = lattice.shift(steps)
    low, high = inside.min(axis=0) - away, inside.max(axis=0) + away
    meets = (own.max(axis=0) + shifts >= low) & (own.min(axis=0) + shifts <= high)
    return shifts[meets.all(axis=1)]


def _pairs(
    inside: Points, own: Points, images: Points, away: float
) -> tuple[Indices, Indices, Indices]:
    """Return targets, sources and images of all pairs of centres within `away`."""
    from scipy.spatial import KDTree  # slow to import

    low, high = inside.min(axis=0) - away, inside.max(axis=0) + away
    ghosts = own[None] + images[:, None]
    meets = np.all((ghosts >= low) & (ghosts <= high), axis=2)
    which, source = np.nonzero(meets)
    found = KDTree(inside).sparse_distance_matrix(
        KDTree(ghosts[which, source]), away, output_type="ndarray"
    )
    ghost = found["j"].astype(np.int64)
    return found["i"].astype(np.int64), source[ghost], which[ghost]
