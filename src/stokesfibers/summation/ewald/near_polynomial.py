"""The far part within rc as polynomials in the square of the distance.

With t = (r / rc)^2 and E = Phi / r all is derivatives of one function, without a division:

    S_far = P_a I + P_b rr^T,          P_a = 2 E + 2 t E',      P_b = -2 E' / rc^2,
    (a^2/4) laplacian S_far = a^2 (Q_a I + Q_b rr^T),
    Q_a = (H' + t H'') / rc^2,         Q_b = -H'' / rc^4,       H = 3 E + 2 t E'.

The kernels work with ``y = 2 t - 1`` in [-1, 1] and with lengths in units of ``rc / sqrt 2``, so
that ``y = r^2 - 1``. Degrees are fixed, so that a few compiled kernels serve all tolerances.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.summation.ewald.split import Split

KERNELS = (("single", 13), ("double", 20), ("double", 27), ("double", 34))
"""Precision and degree of the kernels, cheapest first; each is compiled when first used."""
BLOCK = 7
"""Coefficients the kernels take at a time; divides each degree plus one."""
SINGLE_TOLERANCE = 9e-7
"""Tolerances from here on are met by the single precision kernel."""
FIT_SHARE = 0.1
"""Of the tolerance, how far a polynomial may be off, relative to its largest value."""
ROUNDING = 2.0
"""Misfit that is put down to rounding, in units of the precision."""
_SAMPLES = 60
_CHECKS = 301


@dataclass(frozen=True, eq=False)
class NearPolynomials:
    """Coefficients in y, ascending, in units of length ``rc / sqrt 2``.

    Attributes
    ----------
    precision
        ``"single"`` or ``"double"``.
    scale
        sqrt 2 / rc: what lengths are multiplied with.
    stokeslet
        P_a and P_b, (2, degree + 1).
    doublet
        Q_a and Q_b, (2, degree + 1), to be multiplied with ``(a scale)^2``.
    misfit
        Largest error of a polynomial as the kernel evaluates it, relative to its largest value.
    """

    precision: str
    scale: float
    stokeslet: Array
    doublet: Array
    misfit: float

    @property
    def degree(self) -> int:
        return self.stokeslet.shape[1] - 1

    def folded(self, radius: float) -> Array:
        """Return P_a and P_b with the doublets of one radius a added, (2, degree + 1)."""
        return self.stokeslet + (radius * self.scale) ** 2 * self.doublet


def _exact(split: Split, y: Array) -> tuple[Array, ...]:
    """Return P_a, P_b, Q_a, Q_b at y in units of rc / sqrt 2, each of the shape of y."""
    length = split.rc / np.sqrt(2.0)
    # in these units r^2 = y + 1, so a derivative by r^2 is one by y
    r = length * np.sqrt(1.0 + y)
    e0, e1, e2, e3 = (split.mean_slope(r, n) * length ** (2 * n + 1) for n in range(4))
    square = 1.0 + y
    h1, h2 = 5.0 * e1 + 2.0 * square * e2, 7.0 * e2 + 2.0 * square * e3
    return 2.0 * e0 + 2.0 * square * e1, -2.0 * e1, h1 + square * h2, -h2


def _evaluated(coefficients: Array, y: Array, kind: type) -> Array:
    """Return the polynomial by Horner's rule in the arithmetic of `kind`."""
    c, x = coefficients.astype(kind), y.astype(kind)
    value = np.full_like(x, c[-1])
    for k in range(c.size - 2, -1, -1):
        value = value * x + c[k]
    return value.astype(float)


def fit(split: Split, degree: int | None = None) -> NearPolynomials:
    """Return the polynomials of a split, in the lowest precision and degree that will do.

    Parameters
    ----------
    split
        What to fit.
    degree
        Highest degree to use; the kernels' own unless given.

    Raises
    ------
    InputError
        If they miss the tolerance.
    """
    coefficients, misfit, precision = _unit_fit(
        split.kind, split.tolerance, round(split.bandwidth, 9), degree
    )
    scale = np.sqrt(2.0) / split.rc
    return NearPolynomials(precision, scale, coefficients[:2], coefficients[2:], misfit)


@lru_cache(maxsize=64)
def _unit_fit(
    kind: str, tolerance: float, bandwidth: float, degree: int | None
) -> tuple[Array, float, str]:
    split = Split(kind, tolerance, 1.0, bandwidth)
    nodes = np.cos(np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
    y = np.linspace(-1.0, 1.0, _CHECKS)[1:]  # at r = 0 the formulas are 0/0
    exact = _exact(split, y)
    series = [chebyshev.chebfit(nodes, v, _SAMPLES - 1) for v in _exact(split, nodes)]
    misfit, used = np.inf, 0
    for precision, most in KERNELS:
        arithmetic = np.float32 if precision == "single" else np.float64
        if precision == "single" and tolerance < SINGLE_TOLERANCE:
            continue
        used = most if degree is None else min(degree, most)
        found = np.zeros((4, most + 1))
        misfit = 0.0
        for row, terms, values in zip(found, series, exact, strict=True):
            powers = chebyshev.cheb2poly(terms[: used + 1])
            row[: powers.size] = powers
            error = np.abs(_evaluated(row, y, arithmetic) - values).max() / np.abs(values).max()
            misfit = max(misfit, float(error))
        if misfit <= FIT_SHARE * tolerance + ROUNDING * float(np.finfo(arithmetic).eps):
            return found, misfit, precision
    raise InputError(
        "split",
        f"one that polynomials of degree {used} meet to {FIT_SHARE * tolerance:.1e}",
        f"a misfit of {misfit:.1e} at band-width {bandwidth:.1f}",
        "Use the prolate split, a smaller band-width or a larger tolerance.",
    )


def evaluate(coefficients: Array, r2: Array) -> Array:
    """Return a polynomial at squared distances in units of ``rc / sqrt 2``, any shape."""
    return np.asarray(polynomial.polyval(np.asarray(r2) - 1.0, coefficients), dtype=np.float64)
