"""Chebyshev points on [0, L], both ends included: quadrature and interpolation of any accuracy.

Where a spectral engine shows its fibers: weights of Clenshaw & Curtis (Trefethen 2008),
interpolation by the barycentric formula (Berrut & Trefethen 2004).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stokesfibers.core.arrays import Array, as_float


@dataclass(frozen=True)
class ChebyshevGrid:
    """Points s_j = L (1 - cos(pi j / n)) / 2, j = 0 ... n.

    Attributes
    ----------
    length
        L.
    intervals
        n, even.
    """

    length: float
    intervals: int

    @property
    def nodes(self) -> Array:
        """Arclength of the points, (node,)."""
        return self.length * _unit(self.intervals)[0]

    @property
    def weights(self) -> Array:
        """Quadrature weights in arclength, (node,)."""
        return self.length * _unit(self.intervals)[1]

    def interpolate(self, values: Array, s: Array) -> Array:
        """Return nodal values (node, ...) at arclengths s (point,), (point, ...)."""
        table = _table(self, np.asarray(s, dtype=float).tobytes())
        return as_float(np.tensordot(table, values, axes=1))


@lru_cache(maxsize=32)
def _table(grid: ChebyshevGrid, points: bytes) -> Array:
    """Return the interpolation from the nodes to arclengths given as bytes, (point, node)."""
    away = np.frombuffer(points)[:, None] - grid.nodes
    at_node = np.abs(away) <= 1e-15 * grid.length
    signs = (-1.0) ** np.arange(grid.intervals + 1)
    signs[[0, -1]] *= 0.5
    table = signs / np.where(at_node, 1.0, away)
    table /= table.sum(axis=1, keepdims=True)
    hit = at_node.any(axis=1)
    table[hit] = at_node[hit]
    return table


@lru_cache(maxsize=32)
def _unit(n: int) -> tuple[Array, Array]:
    """Return points and quadrature weights on [0, 1]."""
    angle = np.pi * np.arange(n + 1) / n
    k = np.arange(1, n // 2 + 1)
    share = np.where(k == n // 2, 1.0, 2.0) / (4.0 * k**2 - 1.0)
    weights = (1.0 - np.cos(2.0 * np.outer(angle, k)) @ share) / n
    weights[[0, -1]] *= 0.5
    return 0.5 * (1.0 - np.cos(angle)), weights
