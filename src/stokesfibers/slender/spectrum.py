"""Spectrum of the straight filament's operator -c + S_delta: Appendix B.

Along a straight filament ``(Lambda + K_delta)[g] = 2 (-c g + S_delta[g])``, with S_delta the
integral of (B.3), ``S_delta[g](s) = int (g(s') - g(s)) / sqrt((s' - s)^2 + delta(s)^2) ds'``.
Legendre polynomials are the eigenfunctions of S_0, with eigenvalues ``-lambda_n`` of (B.5). The
model is well posed as long as every eigenvalue of ``-c + S_delta`` is positive: for delta = 0, as
long as ``c + lambda_n < 0``.
"""

from __future__ import annotations

from math import exp

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.numerics.product_integration import FinitePartWeights
from stokesfibers.slender.mobility import slenderness_constant


def legendre_eigenvalue(n: int | Array) -> Array:
    """Return lambda_n = 2 sum_{i=1}^n 1/i of (B.4), (B.5).

    Parameters
    ----------
    n
        Degree of the Legendre polynomial, 0 or more; any shape.
    """
    from scipy.special import digamma  # slow to import, and a run needs it only to check its case

    return 2.0 * (digamma(np.asarray(n) + 1.0) + np.euler_gamma)


def crossing(eps: float) -> int:
    """Return the last n with c + lambda_n < 0, (B.6): the finest scale the bare theory allows.

    33, 340 and 3404 for slenderness 1e-2, 1e-3 and 1e-4.

    Parameters
    ----------
    eps
        Slenderness, above 0 and small enough for c < 0.

    Raises
    ------
    InputError
        If `eps` is not a positive number below exp(-1/2).
    """
    c = slenderness_constant(checks.positive("eps", eps))
    if c >= 0.0:
        raise InputError("eps", "a slenderness below exp(-1/2) = 0.6065", eps)
    n = max(0, int(exp(-0.5 * c - np.euler_gamma)) - 1)  # from lambda_n ~ 2 (log n + gamma)
    while c + legendre_eigenvalue(n + 1) < 0.0:
        n += 1
    while n > 0 and c + legendre_eigenvalue(n) >= 0.0:
        n -= 1
    return n


def straight_operator(weights: FinitePartWeights, eps: float) -> Array:
    """Return -c + S_delta, (B.3), on nodal values of a piecewise linear density, (node, node).

    Parameters
    ----------
    weights
        Finite-part weights of the grid and regularisation.
    eps
        Slenderness; gives c.
    """
    local = weights.phi + slenderness_constant(eps)
    return weights.hat - np.diag(local)


def smallest_eigenvalue(weights: FinitePartWeights, eps: float) -> float:
    """Return the smallest real part of the eigenvalues of `straight_operator`.

    Above zero the discrete operator is elliptic. With (16) it turns negative as the grid is
    refined (errata, B.2). With a constant delta = m eps it stays above log(m^2 / e), with the
    spheroidal one above the smaller of that and log(2 m / e), the value at the very ends.
    """
    return float(np.linalg.eigvals(straight_operator(weights, eps)).real.min())
