"""Whether two centrelines passed through each other during a step.

Slender body theory does not stop fibers from crossing. Between two times each node is taken to
move straight. Two segments cross if their four ends become coplanar, that is if the volume
``(x_1' x x_2') . (x_1 - x_2)`` changes sign, at a time at which the segments meet.

In a sheared cell images slide meanwhile. All is looked at in the frame that is sheared with the
cell: there images rest, fibers that are near each other move slowly wherever they are, and volumes
are the same. What all have in common, as where they settle together, is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stokesfibers.core.arrays import Array, Positions
from stokesfibers.domain.domains import AbstractDomain
from stokesfibers.domain.neighbours import near_fibers
from stokesfibers.kernels import proximity

_BISECTIONS = 60
_ROOM = 4096  # suspects looked for at first


@dataclass(frozen=True)
class Crossing:
    """Two fibers that passed through each other.

    Attributes
    ----------
    first, second
        Their numbers.
    fraction
        When, as a fraction of the step.
    """

    first: int
    second: int
    fraction: float


def find_crossings(
    before: Positions, after: Positions, domain: AbstractDomain, later: AbstractDomain | None = None
) -> tuple[Crossing, ...]:
    """Return the crossings between positions `before` and `after`, (fiber, node, 3) each.

    `domain` is that of the first and `later`, if another, of the second positions. One entry per
    pair of fibers, the earliest; ordered by time.
    """
    if len(before) == 1 and not np.any(domain.lengths > 0.0):
        return ()
    after = before + displacements(before, after, domain, later or domain)
    one, other, shift = _suspects(before, after, domain)
    if not len(shift):
        return ()
    start, stop = _ends(before, one, other, shift), _ends(after, one, other, shift)
    when = _coplanar(start, stop)
    found: dict[tuple[int, int], float] = {}
    for k in np.flatnonzero(_meet(start + when[:, None] * (stop - start))):
        key = (int(one[0][k]), int(other[0][k]))
        found[key] = min(found.get(key, 1.0), float(when[k]))
    return tuple(
        Crossing(*pair, fraction) for pair, fraction in sorted(found.items(), key=lambda i: i[1])
    )


def displacements(
    before: Positions, after: Positions, domain: AbstractDomain, later: AbstractDomain
) -> Positions:
    """Return `after` less `before` in the frame of `domain`, less the mean of all nodes."""
    moved = after - before
    slide = domain.slide_to(later)
    if slide != 0.0:
        moved[..., 0] -= slide / domain.lengths[1] * after[..., 1]
    return moved - moved.mean(axis=(0, 1))


def _suspects(
    before: Positions, after: Positions, domain: AbstractDomain
) -> tuple[tuple[Array, Array], tuple[Array, Array], Array]:
    """Return pairs of segments that turn over and may meet: fiber and segment of each, shifts."""
    before, after = np.ascontiguousarray(before), np.ascontiguousarray(after)
    lattice = proximity.lattice(domain.lengths, domain.offset, domain.rows)
    blocks = proximity.balls(before, after, proximity.BLOCK)
    whole = proximity.balls(before, after, before.shape[1] - 1)[:, 0]
    pairs = near_fibers(whole, 0.0, domain)
    if np.any(domain.lengths > 0.0):
        own = np.repeat(np.arange(len(before)), 2).reshape(-1, 2)
        pairs = np.concatenate([pairs, own])
    room = _ROOM
    while True:
        found, shifts = np.empty((room, 4), dtype=np.intp), np.empty((room, 3))
        count = proximity.turned_over(
            pairs, before, after, whole, blocks, proximity.BLOCK, lattice, found, shifts
        )
        if count <= room:
            break
        room = count
    k, i, m, j = found[:count].T
    return (k, i), (m, j), shifts[:count]


def _ends(positions: Positions, one: tuple, other: tuple, shift: Array) -> Array:
    """Return the four ends of each pair of segments, (4, pair, 3)."""
    return np.stack(
        [
            positions[one[0], one[1]] + shift,
            positions[one[0], one[1] + 1] + shift,
            positions[other[0], other[1]],
            positions[other[0], other[1] + 1],
        ]
    )


def _volume(ends: Array) -> Array:
    a, b, c, d = ends
    return np.einsum("ni,ni->n", np.cross(b - a, d - c), a - c)


def _coplanar(start: Array, stop: Array) -> Array:
    """Return the fraction at which the volume vanishes, by bisection, (pair,)."""
    low, high = np.zeros(start.shape[1]), np.ones(start.shape[1])
    sign = _volume(start) > 0.0
    for _ in range(_BISECTIONS):
        mid = 0.5 * (low + high)
        same = (_volume(start + mid[:, None] * (stop - start)) > 0.0) == sign
        low, high = np.where(same, mid, low), np.where(same, high, mid)
    return high


def _meet(ends: Array) -> Array:
    """Return whether coplanar segments share a point, to a rounding of their length."""
    a, b, c, d = ends
    u, v, w = b - a, d - c, a - c
    uu, uv, vv = (np.einsum("ni,ni->n", p, q) for p, q in ((u, u), (u, v), (v, v)))
    uw, vw = (np.einsum("ni,ni->n", p, w) for p in (u, v))
    determinant = uu * vv - uv * uv
    parallel = determinant <= 1e-14 * uu * vv
    safe = np.where(parallel, 1.0, determinant)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    slack = 1e-9
    inside = (s >= -slack) & (s <= 1 + slack) & (t >= -slack) & (t <= 1 + slack)
    return inside & ~parallel
