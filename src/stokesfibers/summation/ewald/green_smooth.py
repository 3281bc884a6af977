"""Smooth parts of biharmonic Green's functions in one, two and three free directions.

B_q, in D free directions and for the wavenumber q of the periodic ones, obeys
``(laplacian - q^2)^2 B_q = -8 pi delta``. It is a sum of Gaussians, from
``1/k^4 = int_0^inf t exp(-k^2 t) dt``:

    B_q(x) = -8 pi int_0^inf t (4 pi t)^(-D/2) exp(-q^2 t - |x|^2 / 4t) dt.

The smooth part is that of t >= t0; its transform is ``-8 pi / k^4`` times
``(1 + k^2 t0) exp(-k^2 t0)``: Hasimoto's split. For q = 0 the integral is taken in closed form, up
to what ``(I laplacian - grad grad)`` makes a constant: r, ``-r^2 log r`` and ``-(2 pi / 3) |z|^3``
for D = 3, 2, 1, less the part of t < t0.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.special import erf, erfc, exp1

from stokesfibers.core.arrays import Array

_RULE = 16
_LAST = 45.0  # exp(-45) of the Gaussians' weights is left out


def _sum_of_squares(axes: list[Array]) -> Array:
    """Return the sum of the squares of coordinates on the tensor grid of `axes`."""
    total = np.zeros(())
    for axis in axes:
        total = total[..., None] + axis**2
    return total


def smooth_unbounded(axes: list[Array], t0: float) -> Array:
    """Return the smooth part for q = 0 on the tensor grid of one to three axes, none at 0."""
    x = 0.25 * _sum_of_squares(axes)
    y = x / t0
    if len(axes) == 3:
        return 2.0 * np.sqrt(x) * erf(np.sqrt(y)) + 2.0 * np.sqrt(t0 / np.pi) * np.exp(-y)
    if len(axes) == 2:
        return 2.0 * t0 * np.exp(-y) - 2.0 * x * (np.log(4.0 * x) + exp1(y))
    root = np.sqrt(np.pi) * x**1.5
    gaussian = np.sqrt(t0) * np.exp(-y) * (t0 - 2.0 * x)
    return -(8.0 / 3.0) * np.sqrt(np.pi) * (2.0 * root * erf(np.sqrt(y)) - gaussian)


def smooth_sheet(q: Array, axis: Array, t0: float) -> Array:
    """Return the smooth part for wavenumbers q > 0 on one free axis, (q, axis).

    ``int t^(1/2) exp(-q^2 t - z^2/4t) dt`` by error functions; q z is to stay below some hundreds.
    """
    q, z = q[:, None], np.abs(axis)
    root = np.sqrt(t0)
    zeta = 0.5 * z / root
    falling = np.exp(-q * z) * erfc(q * root - zeta)
    rising = np.exp(q * z) * erfc(q * root + zeta)
    gaussian = 4.0 / np.sqrt(np.pi) * q * root * np.exp(-((q * root) ** 2) - zeta**2)
    bracket = falling + rising + q * z * (falling - rising) + gaussian
    return -np.pi / q**3 * bracket


def smooth_line(q: float, axes: list[Array], t0: float) -> Array:
    """Return the smooth part for one wavenumber q > 0 on the grid of two free axes.

    By a rule for log t; each Gaussian is a product.
    """
    first, last = np.log(t0), np.log(t0 + _LAST / q**2)
    panels = int(last - first) + 1
    z, w = leggauss(_RULE)
    half = 0.5 * (last - first) / panels
    t = np.exp(first + half * (2.0 * np.arange(panels)[:, None] + 1.0 + z).ravel())
    weights = -2.0 * np.tile(half * w, panels) * t * np.exp(-(q**2) * t)
    gaussians = [np.exp(-(axis[:, None] ** 2) / (4.0 * t)) for axis in axes]
    return (gaussians[0] * weights) @ gaussians[1].T
