"""The prolate spheroidal wave function of order zero, by its Legendre series.

``psi_c`` is the function on [-1, 1] whose Fourier transform over [-1, 1] is itself up to a factor,

    int_{-1}^{1} psi_c(x) exp(i c x t) dx = lambda psi_c(t),

and of all functions of band-width c the one with the least outside [-1, 1]. It is the eigenfunction
of least eigenvalue of ``-((1 - x^2) u')' + c^2 x^2 u``, a tridiagonal matrix in Legendre modes.
Source: Slepian & Pollak 1961; Osipov, Rokhlin & Xiao 2013.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from stokesfibers.core.arrays import Array

_LEAST_MODES = 20  # beyond c / 2 even modes, the coefficients fall faster than geometrically


@lru_cache(maxsize=64)
def prolate_series(bandwidth: float) -> tuple[float, ...]:
    """Return the Legendre coefficients of psi_c, scaled to ``psi_c(0) = 1``; odd ones are zero.

    Parameters
    ----------
    bandwidth
        c, above zero.
    """
    count = _LEAST_MODES + int(bandwidth)
    k = np.arange(0, 2 * count, 2, dtype=float)
    c2 = bandwidth * bandwidth
    diagonal = k * (k + 1) + (2 * k * (k + 1) - 1) / ((2 * k + 3) * (2 * k - 1)) * c2
    j = k[:-1]
    beside = (j + 2) * (j + 1) / ((2 * j + 3) * np.sqrt((2 * j + 1) * (2 * j + 5))) * c2
    matrix = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
    _, vectors = np.linalg.eigh(matrix)
    series = np.zeros(2 * count)
    series[::2] = vectors[:, 0] * np.sqrt(k + 0.5)
    series /= np.polynomial.legendre.legval(0.0, series)
    last = int(np.flatnonzero(np.abs(series) > 1e-18).max())
    return tuple(map(float, series[: last + 1]))


def prolate_values(series: tuple[float, ...], x: Array, order: int = 0) -> Array:
    """Return psi_c or its derivative of `order` at x in [-1, 1]; any shape."""
    coefficients = np.array(series)
    if order:
        coefficients = np.polynomial.legendre.legder(coefficients, order)
    return np.asarray(np.polynomial.legendre.legval(x, coefficients), dtype=np.float64)
