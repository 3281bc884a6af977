"""Whether two centrelines passed through each other during a step.

Slender body theory does not stop fibers from crossing. Between two times each node is taken to
move straight. Two segments cross if their four ends become coplanar, that is if the volume
``(x_1' x x_2') . (x_1 - x_2)`` changes sign, at a time at which the segments meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stokesfibers.core.arrays import Array, Positions
from stokesfibers.domain.domains import AbstractDomain
from stokesfibers.domain.neighbours import within

_BISECTIONS = 60


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
    before: Positions, after: Positions, domain: AbstractDomain
) -> tuple[Crossing, ...]:
    """Return the crossings between positions `before` and `after`, (fiber, node, 3) each.

    One entry per pair of fibers, the earliest; ordered by time.
    """
    fibers, nodes, _ = before.shape
    if fibers == 1 and not np.any(domain.lengths > 0.0):
        return ()
    middle = 0.5 * (before[:, 1:] + before[:, :-1])
    moved = float(np.linalg.norm(after - before, axis=-1).max())
    spacing = float(np.linalg.norm(np.diff(before, axis=1), axis=-1).max())
    pairs = within(middle, spacing + 2.0 * moved, domain)
    if not pairs.first.size:
        return ()
    one, other = (np.divmod(k, nodes - 1) for k in (pairs.first, pairs.second))
    ends = [_ends(positions, one, other, pairs.shift) for positions in (before, after)]
    sign = [_volume(e) > 0.0 for e in ends]
    suspect = np.flatnonzero(sign[0] != sign[1])
    found: dict[tuple[int, int], float] = {}
    start, stop = (e[:, suspect] for e in ends)
    when = _coplanar(start, stop)
    for k in np.flatnonzero(_meet(start + when[:, None] * (stop - start))):
        key = (int(one[0][suspect[k]]), int(other[0][suspect[k]]))
        found[key] = min(found.get(key, 1.0), float(when[k]))
    return tuple(
        Crossing(*pair, fraction) for pair, fraction in sorted(found.items(), key=lambda i: i[1])
    )


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
