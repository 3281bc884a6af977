"""A fiber that nears itself: where its nodes do not resolve that, and its operator there.

Owns the criterion for the finite-part operator of (20): what multiplies its kernel has branch
points at the complex roots of ``|x(s) - x(s_i)|^2 = 0`` other than s = s_i. If one, with s taken to
[-1, 1], lies on the Bernstein ellipse rho, the operator on N nodes errs by at most about

    exp(-X) / (1 + X^(3/2)),    X = N log rho,

relative to the largest velocity: exp(-X) as for any interpolation, the rest as coils have it. The
velocity as a function of s has the same branch points, so that N of its values tell no more. Where
the error exceeds the tolerance, the operator is therefore found on as many nodes as the criterion
asks for, from the polynomial of degree N - 1 through the force to the projection of the velocity on
such polynomials. See docs/theory/near.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.kernels import spectral as kernels
from stokesfibers.kernels import spectral_pairs
from stokesfibers.numerics.legendre import FreeEndBasis, gauss_legendre, legendre_values
from stokesfibers.numerics.shape_free import ShapeFreeWeights

MOST_NODES = 256
"""Of an operator where a fiber nears itself."""
_SIZES = (48, 64, 96, 128, 192, MOST_NODES)
_POINTS = 128  # that the least distance is looked for at
_PASSES = 60  # of a fixed point that is met to rounding


@dataclass(frozen=True)
class FineNodes:
    """More nodes than modes, for the operator where a fiber nears itself.

    Attributes
    ----------
    sigma
        The nodes as fractions of the length, (M,).
    tables
        Position modes and their derivatives 1 and 2 there, (3, M, N).
    weights
        Shape-free weights of the finite-part operator on these nodes.
    spread
        Values at the N nodes to those of the polynomial through them, (M, N).
    project
        Values to those of their projection on polynomials of degree N - 1 at the N nodes, (N, M).
    """

    sigma: Array
    tables: Array
    weights: ShapeFreeWeights
    spread: Array
    project: Array

    @classmethod
    def build(cls, basis: FreeEndBasis, weights: ShapeFreeWeights) -> FineNodes:
        """Prepare the nodes that `weights` are for."""
        sigma, quadrature = gauss_legendre(weights.nodes)
        own = legendre_values(gauss_legendre(basis.count)[0], basis.count)
        values = legendre_values(sigma, basis.count)
        norms = 2.0 * np.arange(basis.count) + 1.0
        return cls(
            sigma,
            np.stack([basis.positions(sigma, order) for order in range(3)]),
            weights,
            values @ np.linalg.inv(own),
            (own * norms) @ (values * quadrature[:, None]).T,
        )

    def operator(self, modes: Array) -> tuple[Array, float]:
        """Return K_delta on forces at the N nodes, (6, N, N), and the ratio of its series."""
        stacked = self.weights.stacked
        fine, ratio = kernels.finite_part(
            modes, self.sigma, self.tables, stacked, self.weights.delta
        )
        return np.ascontiguousarray(self.project @ fine @ self.spread), ratio


@dataclass(frozen=True)
class OwnOperator:
    """The finite-part operator of a fiber that nears itself.

    Attributes
    ----------
    given
        K_delta, (6, N, N); empty, (6, 0, 0), where the nodes are enough.
    ratio
        Of the kernel's series, where it has no limit; else 0.
    error
        Estimated error of the fiber's own velocity, through lack of nodes and terms, if it is
        beyond the tolerance; else 0.
    """

    given: Array
    ratio: float = 0.0
    error: float = 0.0


@dataclass(frozen=True)
class OwnTurns:
    """Finds where a fiber of one kind nears itself, and its operator there.

    Attributes
    ----------
    basis
        Position and tension modes; `basis.count` is N.
    tables
        Position modes and their derivatives 1, 2, 4 at the nodes, (4, N, N).
    series
        Position modes to Legendre coefficients of the positions, (N, N + 4).
    weights
        Returns the shape-free weights on more nodes.
    tolerance
        Error that is let pass, relative to the fiber's own velocity; 1 and more for any.
    """

    basis: FreeEndBasis
    tables: Array
    series: Array
    weights: Callable[[int], ShapeFreeWeights]
    tolerance: float

    @cached_property
    def rho(self) -> float:
        """Bernstein ellipse from which on the nodes alone err by the tolerance."""
        return float(np.exp(self._decay / self.basis.count))

    def nearest(self, modes: Array) -> float:
        """Return the ellipse nearest to the fiber on which the shape of modes (3, N) nears itself.

        It is infinite where none is within `rho`. What the nodes find is looked at from more
        points, since the least distance may lie between nodes.
        """
        found = spectral_pairs.own_approaches(modes, *self._on_nodes)
        if found == np.inf or self.basis.count >= _POINTS:
            return found
        closer = spectral_pairs.own_approaches(modes, *self._closely, self.series, found)
        return min(found, closer)

    def operator(self, modes: Array) -> OwnOperator:
        """Return the operator where the shape of position modes (3, N) nears itself."""
        nearest = self.nearest(modes)
        if nearest == np.inf:
            return _NOWHERE
        decay = float(np.log(nearest))
        sizes = [size for size in _SIZES if size > self.basis.count] or [self.basis.count]
        size = next((m for m in sizes if m * decay >= self._decay), sizes[-1])
        fine = self._fine(size)
        given, ratio = fine.operator(modes)
        if not ratio < 1.0:
            return OwnOperator(given, ratio)
        left = max(nodes_error(size * decay), float(fine.weights.remainder(ratio)))
        return OwnOperator(given, 0.0, left if left > self.tolerance else 0.0)

    @cached_property
    def _on_nodes(self) -> tuple[Array, Array, Array, Array, float]:
        """What the kernel takes beside the modes; looked up once, since it is called each step."""
        return (*gauss_legendre(self.basis.count), self.tables, self.series, self.rho)

    @cached_property
    def _closely(self) -> tuple[Array, Array, Array]:
        sigma, weights = gauss_legendre(_POINTS)
        tables = np.stack([self.basis.positions(sigma, order) for order in range(3)])
        return sigma, weights, tables

    def _fine(self, size: int) -> FineNodes:
        if size not in self._kept:
            self._kept[size] = FineNodes.build(self.basis, self.weights(size))
        return self._kept[size]

    @cached_property
    def _kept(self) -> dict[int, FineNodes]:
        return {}

    @cached_property
    def _decay(self) -> float:
        return _decay_for(self.tolerance)


_NOWHERE = OwnOperator(np.empty((6, 0, 0)))


def nodes_error(decay: float) -> float:
    """Return the estimated error by the nodes alone for ``decay = N log rho``."""
    return float(np.exp(-decay)) / (1.0 + decay**1.5)


def _decay_for(tolerance: float) -> float:
    """Return the inverse of `nodes_error`, 0 where no decay is needed."""
    decay = 0.0
    for _ in range(_PASSES):
        wanted = -float(np.log(tolerance * (1.0 + decay**1.5)))
        decay = max(0.0, 0.5 * (decay + wanted))
    return decay
