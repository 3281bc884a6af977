r"""Product integration against the shape-free kernel 1/sqrt((s - s')^2 + delta(s)^2).

The weights of Section 3.1 depend on the grid and on delta only, never on the shape. They are
computed once per grid. In units of the interval the moments are

.. math:: m_p(a, d) = \int_0^1 \frac{\xi^p}{\sqrt{(\xi - a)^2 + d^2}} d\xi ,

with a the target's place and d the regularisation. The closed forms lose all digits for intervals
far from the target, so those (and strongly regularised ones) use Gauss-Legendre quadrature.
For d = 0 and a target inside the interval the moments are Hadamard finite parts; they enter only
in differences in which the divergent part cancels.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from stokesfibers.core.arrays import Array

DEGREE = 4
"""Highest power: piecewise linear G times piecewise cubic (T x_s)_s."""
_FAR = 2.0  # distance of the complex singularity a + i d from the interval's middle
_GAUSS = 16  # error below 7.8**-32 at that distance


def kernel_moments(a: Array, d: Array) -> Array:
    """Return m_0 ... m_4 for each pair (a, d).

    Parameters
    ----------
    a, d
        Place of the target and regularisation in units of the interval; same shape, d >= 0.

    Returns
    -------
    Array of shape (*a.shape, 5).
    """
    a, d = np.broadcast_arrays(np.asarray(a, dtype=float), np.asarray(d, dtype=float))
    out = np.empty((*a.shape, DEGREE + 1))
    far = np.hypot(a - 0.5, d) >= _FAR
    singular = ~far & (d == 0.0) & (a >= 0.0) & (a <= 1.0)
    near = ~far & ~singular
    out[far] = _gauss(a[far], d[far])
    out[near] = _closed_form(a[near], d[near])
    out[singular] = _finite_part(a[singular])
    return out


def _gauss(a: Array, d: Array) -> Array:
    x, w = np.polynomial.legendre.leggauss(_GAUSS)
    xi, w = 0.5 * (x + 1.0), 0.5 * w
    kernel = w / np.hypot(xi - a[..., None], d[..., None])
    return kernel @ np.vander(xi, DEGREE + 1, increasing=True)


def _closed_form(a: Array, d: Array) -> Array:
    """Integrate powers of t = xi - a by recursion, then expand xi^p = (t + a)^p."""
    low, high = -a, 1.0 - a
    r_low, r_high = np.hypot(low, d), np.hypot(high, d)
    powers = np.empty((*a.shape, DEGREE + 1))
    with np.errstate(divide="ignore"):
        safe = np.where(d > 0.0, d, 1.0)
        regular = np.arcsinh(high / safe) - np.arcsinh(low / safe)
        outside = np.abs(np.log(np.abs(high)) - np.log(np.abs(low)))
    powers[..., 0] = np.where(d > 0.0, regular, outside)
    powers[..., 1] = r_high - r_low
    for p in range(2, DEGREE + 1):
        edge = high ** (p - 1) * r_high - low ** (p - 1) * r_low
        powers[..., p] = (edge - (p - 1) * d**2 * powers[..., p - 2]) / p
    return np.stack(
        [
            sum(comb(p, k) * a ** (p - k) * powers[..., k] for k in range(p + 1))
            for p in range(DEGREE + 1)
        ],
        axis=-1,
    )


def _finite_part(a: Array) -> Array:
    """Hadamard finite part for d = 0 and 0 <= a <= 1."""
    out = np.empty((*a.shape, DEGREE + 1))
    inner = np.where(a > 0.0, a, 1.0)
    outer = np.where(a < 1.0, 1.0 - a, 1.0)
    out[..., 0] = np.log(inner) + np.log(outer)
    for p in range(1, DEGREE + 1):
        rest = sum(a ** (p - 1 - k) * (1.0 - 2.0 * a ** (k + 1)) / (k + 1) for k in range(p))
        out[..., p] = out[..., 0] * a**p + rest
    return out


@dataclass(frozen=True)
class FinitePartWeights:
    """All shape-free weights of the finite-part operator on one uniform grid of unit length.

    Attributes
    ----------
    delta
        Regularisation at the nodes divided by the fiber's length, shape (node,).
    delta_half
        The same at the half points, shape (interval,).
    hat
        Integral of kernel times hat function, at the nodes: (node, node).
    hat_square
        Integral of kernel times hat function squared: (node, node).
    hat_product
        Integral of kernel times hat_k times hat_{k+1}: (node, node), last column zero.
    phi
        Integral of the kernel over the fiber at the nodes, (35): (node,).
    moments_half
        Moments at the half points, (half point, power, interval).
    phi_half
        Integral of the kernel at the half points: (interval,).
    phi_0
        The constant of (37) and (38).
    """

    delta: Array
    delta_half: Array
    hat: Array
    hat_square: Array
    hat_product: Array
    phi: Array
    moments_half: Array
    phi_half: Array
    phi_0: float


def finite_part_weights(delta: Array, delta_half: Array) -> FinitePartWeights:
    """Compute the weights for regularisation `delta` at nodes and `delta_half` at half points.

    Both are divided by the fiber's length. phi_0 is phi(1/2) of (35); for an unregularised
    kernel, where that is infinite, it is zero: the splitting then has nothing to improve.
    """
    n = delta.size
    count = n - 1
    edges = np.arange(count, dtype=np.float64)
    place = np.arange(n, dtype=np.float64)[:, None] - edges
    node = kernel_moments(place, np.broadcast_to(delta[:, None] * count, place.shape))
    place_half = edges[:, None] + 0.5 - edges
    half = kernel_moments(
        place_half, np.broadcast_to(delta_half[:, None] * count, place_half.shape)
    )
    m0, m1, m2 = node[..., 0], node[..., 1], node[..., 2]
    hat, square, product = np.zeros((3, n, n))
    hat[:, :-1] += m0 - m1
    hat[:, 1:] += m1
    square[:, :-1] += m0 - 2.0 * m1 + m2
    square[:, 1:] += m2
    product[:, :-1] = m1 - m2
    middle = np.interp(0.5, np.linspace(0.0, 1.0, n), delta)
    return FinitePartWeights(
        delta=delta,
        delta_half=delta_half,
        hat=hat,
        hat_square=square,
        hat_product=product,
        phi=m0.sum(axis=1),
        moments_half=np.ascontiguousarray(half.transpose(0, 2, 1)),
        phi_half=half[..., 0].sum(axis=1),
        phi_0=float(kernel_integral(0.5, middle)) if middle > 0.0 else 0.0,
    )


def no_finite_part(intervals: int) -> FinitePartWeights:
    """Return zero weights: a purely local mobility."""
    n = intervals + 1
    zero, square = np.zeros(n), np.zeros((n, n))
    half = np.zeros(intervals)
    return FinitePartWeights(
        delta=zero,
        delta_half=half,
        hat=square,
        hat_square=square,
        hat_product=square,
        phi=zero,
        moments_half=np.zeros((intervals, DEGREE + 1, intervals)),
        phi_half=half,
        phi_0=0.0,
    )


def kernel_integral(s: float | Array, delta: float | Array) -> Array:
    """Return phi(s) of (35), the integral of the kernel over [0, 1]; delta > 0."""
    return np.arcsinh((1.0 - s) / delta) + np.arcsinh(s / delta)
