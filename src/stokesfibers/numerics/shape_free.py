"""Product-integration weights on Gauss-Legendre nodes that do not know the fiber's shape.

With ``u = s - s'`` and ``|R|^2 = u^2 q``, q smooth and 1 at u = 0, the kernel of (15) is

    1 / sqrt(|R|^2 + delta^2) = q^(-1/2) sum_n binom(-1/2, n) (delta^2 h)^n  u^(2n) w^(2n+1),
    w = 1 / sqrt(u^2 + delta^2),      h = (1/q - 1) / u^2   (kappa^2 / 12 at u = 0).

q and h are smooth, and all that is nearly singular is free of the shape: its integrals against the
Lagrange polynomials of the nodes are constants of the grid. With ``u = delta sinh t`` the weight
functions become ``tanh(t)^(2n) dt``, which Gauss-Legendre panels of unit length in t integrate to
rounding. The series converges where its ratio ``z = delta^2 h u^2 w^2`` is below 1. How many terms
are kept follows from the largest delta, for curvatures up to `CURVATURE`; `remainder` says what is
left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.numerics.legendre import gauss_legendre, legendre_values

CURVATURE = 60.0
"""Curvature times length up to which the terms kept reach `PRECISION`."""
PRECISION = 1e-14
FEWEST_TERMS, MOST_TERMS = 2, 10
_SMOOTH_ORDER = 32  # resolves tanh^20 t on a panel of unit length to rounding


@lru_cache(maxsize=32)
def binomials(terms: int) -> Array:
    """Return binom(-1/2, n) for n = 0 ... terms."""
    n = np.arange(1, terms + 1)
    return np.concatenate([[1.0], np.cumprod(-(n - 0.5) / n)])


def terms_needed(delta: float) -> int:
    """Return the number of corrections for the largest delta of a fiber."""
    ratio = delta**2 * CURVATURE**2 / 12.0
    if ratio >= 0.5:
        return MOST_TERMS
    wanted = int(np.ceil(np.log(PRECISION) / np.log(max(ratio, PRECISION)))) - 1
    return min(MOST_TERMS, max(FEWEST_TERMS, wanted))


@dataclass(frozen=True)
class ShapeFreeWeights:
    """Weights of the finite-part operator for unit length.

    Attributes
    ----------
    delta
        Regularisation at the nodes, (node,).
    finite
        ``int (l_j(s') - l_j(s_i)) w(s_i, s') ds'``, (node, node).
    corrections
        ``binom(-1/2, n) delta_i^(2n) int l_j(s') u^(2n) w^(2n+1) ds'`` for n = 1, 2, ...,
        (n, node, node); to be multiplied by h^n.
    """

    delta: Array
    finite: Array
    corrections: Array

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return self.delta.size

    def remainder(self, ratio: float) -> float:
        """Return the relative error of the kernel where the series has the `ratio` z."""
        if not ratio < 1.0:
            return float("inf")
        kept = self.corrections.shape[0]
        return abs(float(binomials(kept + 1)[-1])) * ratio ** (kept + 1) / (1.0 - ratio)


def shape_free_weights(delta: Array) -> ShapeFreeWeights:
    """Return the weights for the regularisation `delta` (node,) at the Gauss-Legendre nodes.

    Where delta vanishes the finite part is that of 1 / |s - s'|, known in closed form: Legendre
    polynomials are its eigenfunctions, with eigenvalues -2 (1 + 1/2 + ... + 1/k), (B.5).
    """
    count = delta.size
    nodes, _ = gauss_legendre(count)
    values = legendre_values(nodes, count)
    factors = binomials(terms_needed(float(delta.max())))
    moments = np.zeros((factors.size, count, count))
    round_off = delta > 0.0
    if round_off.any():
        moments[:, round_off] = _moments(
            nodes[round_off], delta[round_off], shape=(factors.size, count)
        )
    for n, factor in enumerate(factors):
        moments[n] *= factor * delta[:, None] ** (2 * n)
    # Subtracting l_j(s_i), as moments, keeps the cancellation within one row.
    moments[0] -= moments[0, :, :1] * values
    bare = ~round_off
    harmonic = np.concatenate([[0.0], np.cumsum(1.0 / np.arange(1, count))])
    moments[0, bare] = -2.0 * harmonic * values[bare]
    # The inverse serves better than Gauss-Legendre weights: their errors of 1e-14 would add up.
    weights = moments @ np.linalg.inv(values)
    return ShapeFreeWeights(np.ascontiguousarray(delta), weights[0], weights[1:])


def no_weights(count: int) -> ShapeFreeWeights:
    """Return zero weights: the purely local model."""
    zero = np.zeros((FEWEST_TERMS, count, count))
    return ShapeFreeWeights(np.zeros(count), zero[0].copy(), zero)


def _moments(s: Array, delta: Array, *, shape: tuple[int, int]) -> Array:
    """Return ``int P_k(s') u^(2n) w^(2n+1) ds'``, for (n, k) of `shape`, (n, row, k)."""
    terms, count = shape
    low, high = -np.arcsinh(s / delta), np.arcsinh((1.0 - s) / delta)
    panels = max(1, int(np.ceil((high - low).max())))
    # P_k has degree below `count` in sinh t: a panel holds at most half of its oscillations.
    x, w = gauss_legendre(_SMOOTH_ORDER + count // 2)
    places = ((np.arange(panels)[:, None] + x) / panels).ravel()
    t = low[:, None] + (high - low)[:, None] * places
    weight = (high - low)[:, None] * np.tile(w / panels, panels)
    square = np.tanh(t) ** 2
    powers = np.stack([weight * square**n for n in range(terms)], axis=1)
    z = 2.0 * (s[:, None] + delta[:, None] * np.sinh(t)) - 1.0
    out = np.empty((terms, s.size, count))
    before, now = np.zeros_like(z), np.ones_like(z)
    for k in range(count):
        out[:, :, k] = (powers @ now[:, :, None])[:, :, 0].T
        before, now = now, ((2 * k + 1) * z * now - k * before) / (k + 1)
    return out
