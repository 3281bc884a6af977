"""Near neighbours among the nodes and segments of all fibers, images included.

Two points are strangers if they lie on different fibers, or on one fiber but nearest through a
period. A k-d tree finds near points, or near fibers whose segments are then compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array, Nodal, Points, Positions
from stokesfibers.domain.domains import AbstractDomain
from stokesfibers.kernels import proximity

if TYPE_CHECKING:
    from scipy.spatial import KDTree

Indices = NDArray[np.intp]
_NONE = np.empty((0, 2), dtype=np.intp)


@dataclass(frozen=True)
class Neighbours:
    """Pairs of strange nodes (flat index: fiber * nodes + node), with first < second.

    Attributes
    ----------
    first, second
        Flat indices, (pair,).
    shift
        What to add to ``x[first] - x[second]`` to get the nearest image's difference, (pair, 3).
    """

    first: Indices
    second: Indices
    shift: Points


@dataclass(frozen=True)
class Closest:
    """Where strange fibers, as polygons, come nearest.

    Attributes
    ----------
    distance
        Smallest distance between centrelines; infinite if there are no strangers.
    fibers
        The two it is between; (-1, -1) if there are no strangers.
    gap
        Smallest distance between surfaces; negative where they overlap. A segment is as thick as
        its thicker end.
    """

    distance: float
    fibers: tuple[int, int]
    gap: float


def _tree(points: Points, domain: AbstractDomain) -> KDTree:
    """Return the tree of wrapped points; it takes the cell for one that is not sheared."""
    from scipy.spatial import KDTree  # slow to import, and a single fiber needs none

    lengths = domain.lengths
    wrapped = domain.wrap(points)
    # a point a rounding below zero wraps onto the period itself, which the tree refuses
    wrapped = np.where((lengths > 0.0) & (wrapped >= lengths), 0.0, wrapped)
    return KDTree(wrapped, boxsize=lengths)


def _pairs(points: Points, radius: float, domain: AbstractDomain) -> Indices:
    """Return pairs (pair, 2), each once, first < second, with any images closer than `radius`."""
    if not domain.rows:
        return _tree(points, domain).query_pairs(radius, output_type="ndarray")
    from scipy.spatial import KDTree

    inside = domain.wrap(points)
    ghosts, which = _ghosts(inside, radius, domain)
    found = KDTree(inside).sparse_distance_matrix(KDTree(ghosts), radius, output_type="ndarray")
    first, second = found["i"].astype(np.intp), which[found["j"]]
    keep = first < second
    once = np.unique(first[keep] * len(points) + second[keep])
    return np.stack(np.divmod(once, len(points)), axis=1)


def _ghosts(inside: Points, radius: float, domain: AbstractDomain) -> tuple[Points, Indices]:
    """Return images of wrapped points within `radius` of the box of all, and whose they are."""
    low, high = inside.min(axis=0) - radius, inside.max(axis=0) + radius
    most = np.ceil((high - low) / domain.lengths)
    most[0] += np.ceil(abs(domain.offset) * most[1] / domain.lengths[0])
    steps = (np.arange(-n, n + 1) for n in most)
    numbers = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    vectors = domain.lattice_vectors(numbers)
    reaching = (inside.max(axis=0) + vectors >= low) & (inside.min(axis=0) + vectors <= high)
    shifts = [np.unique(vectors[:, i], return_inverse=True) for i in range(3)]
    # moved by each shift that there is along an axis, which points lie between the ends of the box
    between = [
        (x + shift[:, None] >= bottom) & (x + shift[:, None] <= top)
        for x, (shift, _), bottom, top in zip(inside.T, shifts, low, high, strict=True)
    ]
    found = []
    for k in np.flatnonzero(reaching.all(axis=1)):
        x, y, z = (own[which[k]] for own, (_, which) in zip(between, shifts, strict=True))
        which = np.flatnonzero(x & y & z)
        found.append((inside[which] + vectors[k], which))
    points, which = zip(*found, strict=True)
    return np.concatenate(points), np.concatenate(which)


def _strangers(
    points: Points, first: Indices, second: Indices, *, nodes: int, domain: AbstractDomain
) -> Neighbours:
    plain = points[first] - points[second]
    shift = domain.nearest_image(plain) - plain
    strange = (first // nodes != second // nodes) | np.any(shift != 0.0, axis=1)
    return Neighbours(first[strange], second[strange], shift[strange])


def within(positions: Positions, radius: float, domain: AbstractDomain) -> Neighbours:
    """Return all pairs of strange nodes closer than `radius`; positions (fiber, node, 3)."""
    nodes = positions.shape[1]
    points = positions.reshape(-1, 3)
    pairs = _pairs(points, radius, domain)
    return _strangers(points, pairs[:, 0], pairs[:, 1], nodes=nodes, domain=domain)


def closest(positions: Positions, radii: Nodal, domain: AbstractDomain) -> Closest:
    """Return where strange polygons come nearest; `radii` (fiber, node) are those of the nodes."""
    x = np.ascontiguousarray(positions)
    best, where = np.full(2, np.inf), np.full((2, 4), -1)
    periodic = bool(np.any(domain.lengths > 0.0))
    if len(x) > 1 or periodic:
        thick = np.maximum(radii[:, 1:], radii[:, :-1])
        lattice = proximity.lattice(domain.lengths, domain.offset, domain.rows)
        blocks = proximity.balls(x, x, proximity.BLOCK)
        whole = proximity.balls(x, x, x.shape[1] - 1)[:, 0]

        def look(pairs: Indices) -> None:
            proximity.closest(pairs, x, thick, whole, blocks, proximity.BLOCK, lattice, best, where)

        own = np.repeat(np.arange(len(x)), 2).reshape(-1, 2) if periodic else _NONE
        look(np.concatenate([_nearest(whole, domain), own]))
        # what is nearer than that, or less apart by the surfaces
        look(near_fibers(whole, best[1] + 2.0 * float(thick.max()), domain))
    return Closest(float(best[0]), (int(where[0, 0]), int(where[0, 2])), float(best[1]))


def near_fibers(whole: Array, reach: float, domain: AbstractDomain) -> Indices:
    """Return the pairs of different fibers whose balls (fiber, 4) may be within `reach`."""
    if len(whole) < 2:
        return _NONE
    away = 2.0 * float(whole[:, 3].max()) + reach
    return _pairs(whole[:, :3], away, domain)


def _nearest(whole: Array, domain: AbstractDomain) -> Indices:
    """Return each fiber with one whose ball's centre is near, mostly the nearest, (fiber, 2)."""
    if len(whole) < 2:
        return _NONE
    tree = _tree(whole[:, :3], domain)
    index = np.asarray(tree.query(tree.data, k=2)[1])
    me = np.arange(len(whole))
    return np.stack([me, np.where(index[:, 0] == me, index[:, 1], index[:, 0])], axis=1)
