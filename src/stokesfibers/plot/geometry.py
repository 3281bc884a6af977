"""Small geometry that figures need: whole fibers moved into the cell, curvature of polygons."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def wrapped(position: Floats, lengths: Floats, offset: float = 0.0) -> Floats:
    """Return whole fibers shifted by lattice vectors so that their middle nodes lie in the cell.

    Parameters
    ----------
    position : (fiber, node, 3)
    lengths : (3,)
        Periods, 0 in free directions; the cell is 0 <= x < period.
    offset
        Displacement along x of the image one period up in y; the cell is slanted as much.
    """
    middle = position[:, position.shape[1] // 2].copy()
    period = np.where(lengths > 0.0, lengths, 1.0)
    middle[:, 0] -= offset * middle[:, 1] / period[1]
    taken = np.where(lengths > 0.0, -np.floor(middle / period), 0.0)
    shift = taken * period
    shift[:, 0] += taken[:, 1] * offset
    return position + shift[:, None, :]


def slanted(points: Floats, slant: float) -> Floats:
    """Return points (..., 3) of an upright box where the sheared cell has them."""
    moved = points.copy()
    moved[..., 0] += slant * points[..., 1]
    return moved


def curvature(position: Floats) -> Floats:
    """Return the curvature at the nodes, (fiber, node), of centrelines (fiber, node, 3).

    It is one over the radius of the circle through a node and its neighbours, which is second
    order in the spacing, and zero at the ends: a free end carries no moment.
    """
    back, ahead = np.diff(position, axis=1)[:, :-1], np.diff(position, axis=1)[:, 1:]
    area = np.linalg.norm(np.cross(back, ahead), axis=-1)
    sides = np.prod([np.linalg.norm(v, axis=-1) for v in (back, ahead, back + ahead)], axis=0)
    inner = 2.0 * area / np.where(sides > 0.0, sides, np.inf)
    return np.pad(inner, ((0, 0), (1, 1)))
