"""Where a fiber nears itself: parts of it that its own nodes do not resolve.

Owns the criterion for the finite-part operator of (20): what multiplies its kernel has branch
points at the complex roots of ``|x(s) - x(s_i)|^2 = 0`` other than s = s_i. If one, with s taken to
[-1, 1], lies on the Bernstein ellipse rho, the operator on N nodes errs by at most about

    0.3 exp(-X) / (1 + X^(3/2)),    X = N log rho,

relative to the largest velocity: exp(-X) as for any interpolation, the rest fitted to coils. See
docs/theory/near.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array
from stokesfibers.kernels import spectral_pairs as kernels

_SHARE = 0.3
_PASSES = 60  # of a fixed point that is met to rounding


@dataclass(frozen=True)
class Approaches:
    """Nodes of one fiber that are near another part of it.

    Attributes
    ----------
    nodes
        Their numbers, rising, (row,).
    error
        Estimated error of the fiber's own velocity by the nodes alone, relative; 0 if there are
        none.
    """

    nodes: NDArray[np.int64]
    error: float


@dataclass(frozen=True)
class OwnTurns:
    """Finds where a fiber of one kind nears itself.

    Attributes
    ----------
    sigma, weights
        The nodes as fractions of the length, and their weights, (N,).
    tables
        Position modes and their derivatives 1, 2, 4 at the nodes, (4, N, N).
    series
        Position modes to Legendre coefficients of the positions, (N, N + 4).
    tolerance
        Error that is let pass, relative.
    """

    sigma: Array
    weights: Array
    tables: Array
    series: Array
    tolerance: float

    @cached_property
    def rho(self) -> float:
        """Bernstein ellipse from which on the nodes alone err by the tolerance."""
        return float(np.exp(_decay_for(self.tolerance) / self.sigma.size))

    def approaches(self, modes: Array) -> Approaches:
        """Return where the shape of position modes (3, N) nears itself."""
        nodes, nearest = kernels.own_approaches(
            modes, self.sigma, self.weights, self.tables, self.series, self.rho
        )
        error = nodes_error(self.sigma.size * float(np.log(nearest))) if nodes.size else 0.0
        return Approaches(nodes, error)


def nodes_error(decay: float) -> float:
    """Return the estimated error by the nodes alone for ``decay = N log rho``."""
    return _SHARE * float(np.exp(-decay)) / (1.0 + decay**1.5)


def _decay_for(tolerance: float) -> float:
    """Return the inverse of `nodes_error`, 0 where no decay is needed."""
    decay = 0.0
    for _ in range(_PASSES):
        wanted = float(np.log(_SHARE / (tolerance * (1.0 + decay**1.5))))
        decay = max(0.0, 0.5 * (decay + wanted))
    return decay
