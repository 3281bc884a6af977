"""How solutions at several resolutions compare: the paper's norm and order (Section 4.1.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stokesfibers.core.arrays import Array


def distance(coarse: Array, fine: Array) -> float:
    """Return the mean over the coarse nodes of the distance to the same material points.

    Parameters
    ----------
    coarse : (n + 1, 3)
    fine : (m n + 1, 3)
        On a grid that holds the nodes of the coarse one.
    """
    return float(np.linalg.norm(coarse - fine[:: _ratio(coarse, fine)], axis=1).mean())


def centred(points: Array) -> Array:
    """Return points (n, 3) of a uniform grid with their centre of mass moved to the origin."""
    weights = np.ones(len(points))
    weights[[0, -1]] = 0.5
    return points - weights @ points / weights.sum()


def order(solutions: Sequence[Array]) -> float:
    """Return p = log2(|x_1 - x_2| / |x_2 - x_3|) of three solutions, each grid twice the last.

    Both means are over the nodes that all three share; so measured, the two orders that the
    paper prints with Fig. 8 come out to all digits.
    """
    first, second, third = solutions
    shared = second[:: _ratio(first, second)], third[:: _ratio(first, third)]
    return float(np.log2(distance(first, shared[0]) / distance(*shared)))


def order_by_pairs(solutions: Sequence[Array]) -> float:
    """As `order`, but the second mean is over all nodes of the middle grid."""
    first, second, third = solutions
    return float(np.log2(distance(first, second) / distance(second, third)))


def extrapolated(coarse: float, fine: float) -> float:
    """Return Richardson's value of a second-order quantity from two resolutions, one doubled."""
    return fine + (fine - coarse) / 3.0


def _ratio(coarse: Array, fine: Array) -> int:
    ratio, rest = divmod(len(fine) - 1, len(coarse) - 1)
    if rest:
        raise ValueError("the fine grid does not hold the nodes of the coarse one")
    return ratio
