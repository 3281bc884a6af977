"""Near neighbours among the nodes of all fibers, images included, by a k-d tree.

Two points are strangers if they lie on different fibers, or on one fiber but nearest through a
period.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from stokesfibers.core.arrays import Nodal, Points, Positions
from stokesfibers.core.segments import segment_distances
from stokesfibers.domain.domains import AbstractDomain

Indices = NDArray[np.intp]


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


def _tree(points: Points, domain: AbstractDomain) -> KDTree:
    lengths = domain.lengths
    wrapped = domain.wrap(points)
    # a point a rounding below zero wraps onto the period itself, which the tree refuses
    wrapped = np.where((lengths > 0.0) & (wrapped >= lengths), 0.0, wrapped)
    return KDTree(wrapped, boxsize=lengths)


def _strangers(
    points: Points, first: Indices, second: Indices, *, nodes: int, domain: AbstractDomain
) -> Neighbours:
    plain = points[first] - points[second]
    shift = domain.nearest_image(plain) - plain
    strange = (first // nodes != second // nodes) | np.any(np.abs(shift) > 1e-9, axis=1)
    return Neighbours(first[strange], second[strange], shift[strange])


def within(positions: Positions, radius: float, domain: AbstractDomain) -> Neighbours:
    """Return all pairs of strange nodes closer than `radius`; positions (fiber, node, 3)."""
    nodes = positions.shape[1]
    points = positions.reshape(-1, 3)
    pairs = _tree(points, domain).query_pairs(radius, output_type="ndarray")
    return _strangers(points, pairs[:, 0], pairs[:, 1], nodes=nodes, domain=domain)


def smallest_distance(positions: Positions, domain: AbstractDomain) -> tuple[float, int, int]:
    """Return the smallest distance between strange polygons, and the flat nodes it is at.

    Infinity and (-1, -1) if there are no strangers.
    """
    fibers, nodes, _ = positions.shape
    points = positions.reshape(-1, 3)
    if fibers == 1 and not np.any(domain.lengths > 0.0):
        return float("inf"), -1, -1
    tree = _tree(points, domain)
    count = min(16, len(points))
    while True:
        _, index = tree.query(tree.data, k=count)
        first = np.repeat(np.arange(len(points)), count)
        pairs = _strangers(points, first, index.ravel(), nodes=nodes, domain=domain)
        # own neighbours fill the list up to distances of about count / 2 spacings
        if pairs.first.size or count == len(points):
            break
        count = min(4 * count, len(points))
    if not pairs.first.size:
        return float("inf"), -1, -1
    gap = points[pairs.first] - points[pairs.second] + pairs.shift
    size = np.linalg.norm(gap, axis=1)
    near = np.argsort(size)[:8]
    best = min(
        (_segments(positions, pairs, k), int(pairs.first[k]), int(pairs.second[k])) for k in near
    )
    return best


def smallest_gap(positions: Positions, radii: Nodal, domain: AbstractDomain) -> float:
    """Return the smallest distance between surfaces of strange polygons; infinity if none.

    `radii` (fiber, node) are those of the nodes.
    """
    distance, _, _ = smallest_distance(positions, domain)
    if not np.isfinite(distance):
        return distance
    spacing = float(np.linalg.norm(np.diff(positions, axis=1), axis=-1).max())
    pairs = within(positions, distance + 2.0 * float(radii.max()) + spacing, domain)
    points, thick = positions.reshape(-1, 3), radii.ravel()
    apart = np.linalg.norm(points[pairs.first] - points[pairs.second] + pairs.shift, axis=1)
    own = thick[pairs.first] + thick[pairs.second]
    near = np.argsort(apart - own)[:8]
    return min(_segments(positions, pairs, k) - float(own[k]) for k in near)


def _segments(positions: Positions, pairs: Neighbours, k: int) -> float:
    """Return the least distance among the segments that meet at the two nodes of pair k."""
    nodes = positions.shape[1]
    one, other = divmod(int(pairs.first[k]), nodes), divmod(int(pairs.second[k]), nodes)
    found = np.inf
    for i in range(max(one[1] - 1, 0), min(one[1], nodes - 2) + 1):
        start = positions[one[0], i] + pairs.shift[k]
        along = positions[one[0], i + 1] - positions[one[0], i]
        low, high = max(other[1] - 1, 0), min(other[1], nodes - 2) + 1
        starts = positions[other[0], low:high]
        alongs = positions[other[0], low + 1 : high + 1] - starts
        found = min(found, float(segment_distances(start, along, starts, alongs).min()))
    return found
