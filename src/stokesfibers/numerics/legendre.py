"""Legendre polynomials on [0, 1] in modal form, and the bases of a fiber with free ends.

A centreline is given by the Legendre coefficients of its fourth derivative, integrated analytically

    x_ssss = sum_{k >= 2} c_k P_k(2 s - 1),        x_ss = x_sss = 0 at both ends,

since P_k with k >= 2 has neither mean nor first moment. Two constants per component remain: the
mean position and the mean tangent. Likewise ``T_s = sum_{k >= 1} t_k P_k`` gives T = 0 at both
ends. No differentiation matrix appears: each derivative of a basis function is an integral of P_k,
a combination of at most five Legendre polynomials, and is accurate to rounding for any degree.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array

LEAST_NODES = 6
"""Fewest nodes of a fiber: four bending modes besides translation and rotation."""
_NOISE = 1e-15  # of coefficients that act on positions, relative to the largest


def legendre_values(sigma: Array, count: int) -> Array:
    """Return P_0 ... P_{count - 1} at ``2 sigma - 1``, shape (*sigma.shape, count)."""
    z = 2.0 * np.asarray(sigma, dtype=float) - 1.0
    rows = np.empty((count, *z.shape))
    rows[0] = 1.0
    if count > 1:
        rows[1] = z
    for k in range(1, count - 1):
        rows[k + 1] = ((2 * k + 1) * z * rows[k] - k * rows[k - 1]) / (k + 1)
    return np.ascontiguousarray(np.moveaxis(rows, 0, -1))


def gauss_legendre(count: int) -> tuple[Array, Array]:
    """Return the Gauss-Legendre nodes on [0, 1] and their weights, each (count,).

    The nodes are symmetric about 1/2 to the last bit, so that a reversed fiber is treated alike.
    """
    z, w = np.polynomial.legendre.leggauss(count)
    z, w = 0.5 * (z - z[::-1]), 0.5 * (w + w[::-1])
    return 0.5 + 0.5 * z, 0.5 * w


def integrated(coefficients: Array) -> Array:
    """Return the Legendre coefficients of an antiderivative by s.

    It vanishes at both ends if the integrand has mean zero, and at s = 1/2 if that is constant.

    Parameters
    ----------
    coefficients
        Of the integrand, (degree + 1, case).

    Returns
    -------
    Array
        (degree + 2, case), from ``int P_k dz = (P_{k+1} - P_{k-1}) / (2 k + 1)`` and z = 2 s - 1.
    """
    count = coefficients.shape[0]
    out = np.zeros((count + 1, *coefficients.shape[1:]))
    share = 0.5 * coefficients / (2.0 * np.arange(count) + 1.0)[:, None]
    out[1:] += share
    out[: count - 1] -= share[1:]
    return out


@dataclass(frozen=True)
class FreeEndBasis:
    """Basis functions of positions and tension of one fiber on [0, 1] with free ends.

    Position mode 0 is 1, mode 1 is s - 1/2, and mode k >= 2 has the fourth derivative P_k. Tension
    mode m = 0 ... count - 2 has the first derivative P_{m+1}.

    Attributes
    ----------
    count
        Modes per component of the position, N; one less for the tension.
    """

    count: int

    def __post_init__(self) -> None:
        checks.whole("nodes", self.count, LEAST_NODES)

    @cached_property
    def _position_series(self) -> tuple[Array, ...]:
        """Legendre coefficients of the derivatives 4, 3, 2, 1, 0 of every mode, (degree, N)."""
        fourth = np.zeros((self.count, self.count))
        bending = np.arange(2, self.count)
        fourth[bending, bending] = 1.0
        third = integrated(fourth)
        second = integrated(third)
        first = integrated(second)
        first[0] = 0.0  # mode 1 alone carries the mean tangent, mode 0 the mean position
        first[0, 1] = 1.0
        zeroth = integrated(first)
        zeroth[0] = 0.0
        zeroth[0, 0] = 1.0
        return zeroth, first, second, third, fourth

    @cached_property
    def _tension_series(self) -> tuple[Array, Array]:
        slope = np.zeros((self.count, self.count - 1))
        slope[1:] = np.eye(self.count - 1)
        return integrated(slope), slope

    def positions(self, sigma: Array, order: int = 0) -> Array:
        """Return the derivative of `order` 0 ... 4 of every position mode, (*sigma.shape, N)."""
        series = self._position_series[order]
        return legendre_values(sigma, series.shape[0]) @ series

    def tensions(self, sigma: Array, order: int = 0) -> Array:
        """Return the tension modes, or their first derivative, (*sigma.shape, N - 1)."""
        series = self._tension_series[order]
        return legendre_values(sigma, series.shape[0]) @ series

    def fit(self, values: Array, sigma: Array, weight: Array) -> Array:
        """Return the coefficients (N, case) closest to `values` (point, case) in least squares.

        Coefficients that move the curve by rounding only are set to zero: their fourth derivatives
        would be N^4 times larger.

        Parameters
        ----------
        values
            Of the position at the points.
        sigma
            The points, more than N.
        weight
            Quadrature weight of each point.
        """
        matrix = self.positions(sigma)
        scale = np.linalg.norm(matrix, axis=0)
        root = np.sqrt(weight)[:, None]
        found, *_ = np.linalg.lstsq(root * matrix / scale, root * values, rcond=None)
        found[np.abs(found) < _NOISE * np.abs(found).max()] = 0.0
        return found / scale[:, None]
