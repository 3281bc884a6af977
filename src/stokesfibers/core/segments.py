"""Distances between straight segments, for placement and neighbour search."""

from __future__ import annotations

import numpy as np

from stokesfibers.core.arrays import Array, Points


def segment_distances(start: Array, along: Array, starts: Points, alongs: Points) -> Array:
    """Return distances from segments start + [0, 1] along to each of (n, 3) segments, (n,).

    `start` is of one segment, (3,), or one for each of them; `along` (3,) is the same for all.
    """
    offset = start - starts
    a, e = along @ along, np.sum(alongs**2, axis=1)
    b, c, f = alongs @ along, offset @ along, np.sum(alongs * offset, axis=1)
    determinant = a * e - b * b
    parallel = determinant <= 1e-14 * a * e
    s = np.where(parallel, 0.0, (b * f - c * e) / np.where(parallel, 1.0, determinant))
    s = np.clip(s, 0.0, 1.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    # one more alternation settles the cases in which both parameters were clipped
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    gap = offset + s[:, None] * along - t[:, None] * alongs
    return np.linalg.norm(gap, axis=1)
