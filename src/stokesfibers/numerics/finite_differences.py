"""Second-order divided differences on a uniform grid: (A.1)-(A.4) of Appendix A.

The last row of the printed (A.1) is inconsistent (2 f_{j-2}); the consistent f_{j-2} stands here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stokesfibers.core.arrays import Array

LEAST_INTERVALS = 8
"""Below this the one-sided stencils of the two ends overlap."""

# Stencils at the first nodes (offsets from node 0) and in the interior (offsets from the node),
# times h**p. The rows at the far end follow by reversal with the sign (-1)**p.
_FIRST: dict[int, tuple[tuple[float, ...], ...]] = {
    1: ((-1.5, 2.0, -0.5),),
    2: ((2.0, -5.0, 4.0, -1.0),),
    3: ((-2.5, 9.0, -12.0, 7.0, -1.5), (-1.5, 5.0, -6.0, 3.0, -0.5)),
    4: ((3.0, -14.0, 26.0, -24.0, 11.0, -2.0), (2.0, -9.0, 16.0, -14.0, 6.0, -1.0)),
}
_INTERIOR: dict[int, tuple[float, ...]] = {
    1: (-0.5, 0.0, 0.5),
    2: (1.0, -2.0, 1.0),
    3: (-0.5, 1.0, 0.0, -1.0, 0.5),
    4: (1.0, -4.0, 6.0, -4.0, 1.0),
}


def difference_matrix(order: int, intervals: int, spacing: float) -> Array:
    """Return D_p of (A.1)-(A.4) as a dense matrix of shape (node, node).

    Parameters
    ----------
    order
        p, 1 to 4.
    intervals
        N; there are N + 1 nodes.
    spacing
        h, in units of length.
    """
    n = intervals + 1
    matrix = np.zeros((n, n))
    first, interior = _FIRST[order], _INTERIOR[order]
    half = len(interior) // 2
    for j in range(half, n - half):
        matrix[j, j - half : j + half + 1] = interior
    for j, row in enumerate(first):
        matrix[j, : len(row)] = row
        matrix[n - 1 - j, n - len(row) :] = (-1) ** order * np.array(row[::-1])
    return matrix / spacing**order


@dataclass(frozen=True)
class UniformGrid:
    """Uniform grid s_j = j h on [0, L] with its difference operators.

    Attributes
    ----------
    length
        L.
    intervals
        N.
    """

    length: float
    intervals: int

    @property
    def spacing(self) -> float:
        """h = L / N."""
        return self.length / self.intervals

    @property
    def nodes(self) -> Array:
        """Arclength of the nodes, shape (node,)."""
        return np.linspace(0.0, self.length, self.intervals + 1)

    @property
    def half_points(self) -> Array:
        """Arclength of the mid-points of the intervals, shape (interval,)."""
        return self.spacing * (np.arange(self.intervals, dtype=np.float64) + 0.5)

    @property
    def weights(self) -> Array:
        """Weights of the trapezoidal rule, shape (node,)."""
        weights = np.full(self.intervals + 1, self.spacing)
        weights[[0, -1]] *= 0.5
        return weights

    def interpolate(self, values: Array, s: Array) -> Array:
        """Return nodal values (node, ...) at arclengths s (point,), by quintic splines."""
        from scipy.interpolate import make_interp_spline  # slow to import, and rarely needed

        return make_interp_spline(self.nodes, values, k=5)(s)

    def stacked_differences(self) -> Array:
        """D_1 ... D_4 stacked, shape (4, node, node)."""
        return np.stack([difference_matrix(p, self.intervals, self.spacing) for p in range(1, 5)])
