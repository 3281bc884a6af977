"""Small geometry that figures need: whole fibers moved into the cell, curvature of polygons."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def wrapped(position: Floats, lengths: Floats) -> Floats:
    """Return whole fibers shifted by periods so that their middle nodes lie in the cell.

    Parameters
    ----------
    position : (fiber, node, 3)
    lengths : (3,)
        Periods, 0 in free directions; the cell is 0 <= x < period.
    """
    middle = position[:, position.shape[1] // 2]
    period = np.where(lengths > 0.0, lengths, 1.0)
    shift = np.where(lengths > 0.0, -np.floor(middle / period) * period, 0.0)
    return position + shift[:, None, :]


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
