"""Slow, obvious twins of the compiled kernels, written from the paper's formulas.

Nothing here is shared with the package: difference stencils are written out from Appendix A, and
each integral of Section 3.1 is taken by adaptive quadrature of the piecewise polynomials, interval
by interval. Lengths are divided by the fiber's. Arrays are (node, space).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss
from scipy.integrate import quad_vec


def differences(order: int, intervals: int) -> np.ndarray:
    """Return D_p of (A.1)-(A.4), with the last row of (A.1) corrected, row by row."""
    n = intervals
    d = np.zeros((n + 1, n + 1))

    def put(row, **terms):
        for offset, value in terms.items():
            shift = int(offset[1:]) * (1 if offset[0] == "p" else -1)
            d[row, row + shift] = value

    for j in range(n + 1):
        if order == 1 and j == 0:
            put(j, p2=-1 / 2, p1=4 / 2, p0=-3 / 2)
        elif order == 1 and j == n:
            put(j, p0=3 / 2, m1=-4 / 2, m2=1 / 2)
        elif order == 1:
            put(j, p1=1 / 2, m1=-1 / 2)
        elif order == 2 and j == 0:
            put(j, p3=-1, p2=4, p1=-5, p0=2)
        elif order == 2 and j == n:
            put(j, p0=2, m1=-5, m2=4, m3=-1)
        elif order == 2:
            put(j, p1=1, p0=-2, m1=1)
        elif order == 3 and j == 0:
            put(j, p4=-3 / 2, p3=7, p2=-12, p1=9, p0=-5 / 2)
        elif order == 3 and j == 1:
            put(j, p3=-1 / 2, p2=3, p1=-6, p0=5, m1=-3 / 2)
        elif order == 3 and j == n - 1:
            put(j, p1=3 / 2, p0=-5, m1=6, m2=-3, m3=1 / 2)
        elif order == 3 and j == n:
            put(j, p0=5 / 2, m1=-9, m2=12, m3=-7, m4=3 / 2)
        elif order == 3:
            put(j, p2=1 / 2, p1=-2 / 2, m1=2 / 2, m2=-1 / 2)
        elif j == 0:
            put(j, p5=-2, p4=11, p3=-24, p2=26, p1=-14, p0=3)
        elif j == 1:
            put(j, p4=-1, p3=6, p2=-14, p1=16, p0=-9, m1=2)
        elif j == n - 1:
            put(j, p1=2, p0=-9, m1=16, m2=-14, m3=6, m4=-1)
        elif j == n:
            put(j, p0=3, m1=-14, m2=26, m3=-24, m4=11, m5=-2)
        else:
            put(j, p2=1, p1=-4, p0=6, m1=-4, m2=1)
    return d * float(intervals) ** order


def smooth_kernel(x_s, t_s, s, x_other, s_other, delta) -> np.ndarray:
    """Return G(s, s') of (32), 3 x 3; zero where both points coincide."""
    if s == s_other:
        return np.zeros((3, 3))
    r = x_s - x_other
    size = np.linalg.norm(r)
    r_hat = r / size
    ratio = np.sqrt(((s - s_other) ** 2 + delta**2) / (size**2 + delta**2))
    return ratio * (np.eye(3) + np.outer(r_hat, r_hat)) - (np.eye(3) + np.outer(t_s, t_s))


def linear(values: np.ndarray, j: int, xi: float) -> np.ndarray:
    """Return the piecewise linear interpolant at s_j + xi h."""
    return (1.0 - xi) * values[j] + xi * values[j + 1]


@dataclass(frozen=True)
class Tensile:
    """(T x_s)_s with T piecewise quadratic (Q_2), x_s and x_ss piecewise linear.

    With `tension` of shape (node, case) every case is carried at once.
    """

    tension: np.ndarray
    xs: np.ndarray
    xss: np.ndarray

    def __call__(self, j: int, xi: float) -> np.ndarray:
        """Return the value at s_j + xi h, of shape (3, case)."""
        h = 1.0 / (len(self.xs) - 1)
        t = self.tension
        left = max(j - 1, 0)  # on [0, h] the nodes are 0, 1, 2
        bend = t[left + 2] - 2.0 * t[left + 1] + t[left]
        # Newton's form through s_j, s_{j+1} and the third node, with the errata's factor 1/2.
        value = t[j] + xi * (t[j + 1] - t[j]) + 0.5 * xi * (xi - 1.0) * bend
        slope = (t[j + 1] - t[j]) / h + 0.5 * (2.0 * xi - 1.0) * bend / h
        return np.outer(linear(self.xs, j, xi), slope) + np.outer(linear(self.xss, j, xi), value)


def integrate(
    f: Callable[[int, float], np.ndarray], intervals: int, split: float, *, smooth: bool
) -> np.ndarray:
    """Return the integral over [0, 1] of f(j, xi), interval by interval and cut at `split`.

    Adaptively; for `smooth` integrands (delta = 0, the singularity divided out) by a fixed rule,
    which keeps away from the 0/0 at `split`.
    """
    y, w = leggauss(40)
    total = np.zeros(())
    for j in range(intervals):
        at = split * intervals - j
        cuts = [0.0, at, 1.0] if 1e-9 < at < 1.0 - 1e-9 else [0.0, 1.0]
        for a, b in pairwise(cuts):

            def g(xi: float, j: int = j) -> np.ndarray:
                return np.asarray(f(j, xi))

            if smooth:
                places = a + 0.5 * (b - a) * (y + 1.0)
                value = sum(0.5 * (b - a) * wk * g(xi) for xi, wk in zip(places, w, strict=True))
            else:
                value, _ = quad_vec(g, a, b, epsabs=1e-14, epsrel=1e-13, limit=400)
            total = total + value / intervals
    return total


def finite_part(x: np.ndarray, delta: np.ndarray, g: np.ndarray) -> np.ndarray:
    """Return K_delta[g] of (30) at the nodes: G and g piecewise linear, (31) and I_2 by quad.

    `g` is (node, space) or (node, space, case).
    """
    n = len(x) - 1
    s = np.arange(n + 1) / n
    xs = differences(1, n) @ x
    out = np.empty_like(g)
    for i in range(n + 1):
        nodes = np.array(
            [smooth_kernel(x[i], xs[i], s[i], x[k], s[k], delta[i]) for k in range(n + 1)]
        )
        dyad = np.eye(3) + np.outer(xs[i], xs[i])

        def integrand(j, xi, i=i, nodes=nodes, dyad=dyad):
            distance = np.hypot((j + xi) / n - s[i], delta[i])
            here = linear(g, j, xi)
            return (linear(nodes, j, xi) @ here + dyad @ (here - g[i])) / distance

        out[i] = integrate(integrand, n, s[i], smooth=delta[i] == 0.0)
    return out


def evolution_matrix(
    x: np.ndarray, delta: np.ndarray, *, a: float, b: float, factor: float
) -> np.ndarray:
    """Return I + factor (Lambda + K_delta) D_4, applied to every unit vector; (space, node) twice.

    Rows of nodes 0, 1, N - 1, N: D_2 x_0, D_3 x_0, D_3 x_N, D_2 x_N, times h^2 or h^3.
    """
    n = len(x) - 1
    h = 1.0 / n
    d1, d2, d3, d4 = (differences(p, n) for p in range(1, 5))
    xs = d1 @ x
    unit = np.zeros((n + 1, 3, 3, n + 1))  # node, space; space and node of the unknown
    for c in range(3):
        unit[:, c, c, :] = np.eye(n + 1)
    unit = unit.reshape(n + 1, 3, -1)
    g = np.einsum("jk,kcu->jcu", d4, unit)
    along = np.einsum("jc,jcu->ju", xs, g)
    rows = unit + factor * (a * g + b * xs[:, :, None] * along[:, None] + finite_part(x, delta, g))
    for row, order, scale, at in ((0, d2, h**2, 0), (1, d3, h**3, 0), (-2, d3, h**3, n)):
        rows[row] = scale * np.einsum("k,kcu->cu", order[at], unit)
    rows[-1] = h**2 * np.einsum("k,kcu->cu", d2[n], unit)
    return rows.transpose(1, 0, 2).reshape(3 * (n + 1), 3 * (n + 1))


def tension_matrix(x: np.ndarray, delta_half: np.ndarray, phi_0: float) -> np.ndarray:
    """Return - x_s . d/ds of I_1 and of the bracket of (37), at the inner nodes: (N - 1, N + 1).

    Half points as in (33): everything depending on s is the mean of the two nodes' values.
    """
    n = len(x) - 1
    h, s = 1.0 / n, np.arange(n + 1) / n
    xs, xss = differences(1, n) @ x, differences(2, n) @ x
    g = Tensile(np.eye(n + 1), xs, xss)
    half = []
    for p in range(n):
        middle, tangent, place = (v[p] + 0.5 * (v[p + 1] - v[p]) for v in (x, xs, s))
        delta = delta_half[p]
        nodes = np.array(
            [smooth_kernel(middle, tangent, place, x[k], s[k], delta) for k in range(n + 1)]
        )
        dyad = np.eye(3) + np.outer(tangent, tangent)
        own = 0.5 * (g(p, 0.0) + g(p, 1.0))

        def integrand(
            j, xi, place=place, delta=delta, nodes=nodes, dyad=dyad, own=own
        ) -> np.ndarray:
            distance = np.hypot((j + xi) / n - place, delta)
            here = g(j, xi)
            return (linear(nodes, j, xi) @ here + dyad @ (here - own)) / distance

        value = integrate(integrand, n, place, smooth=delta == 0.0)
        half.append(value + phi_0 * dyad @ own)
    return np.array([-(xs[j] @ (half[j] - half[j - 1])) / h for j in range(1, n)])


def bending_term(
    x: np.ndarray, delta: np.ndarray, delta_half: np.ndarray, phi_0: float
) -> np.ndarray:
    """Return x_s . d/ds K_delta[x_ssss] at the inner nodes, (38) with the errata's sign."""
    n = len(x) - 1
    h, s = 1.0 / n, np.arange(n + 1) / n
    xs, xss, xsss, xssss = (differences(p, n) @ x for p in range(1, 5))
    product = np.sum(xss * xsss, axis=1)
    first, second, third = [], [], []
    for p in range(n):
        middle, tangent, place = (v[p] + 0.5 * (v[p + 1] - v[p]) for v in (x, xs, s))
        delta_p = delta_half[p]
        nodes = np.array(
            [smooth_kernel(middle, tangent, place, x[k], s[k], delta_p) for k in range(n + 1)]
        )
        own = 0.5 * (product[p] + product[p + 1])

        def integrand(
            j, xi, place=place, delta_p=delta_p, nodes=nodes, own=own, tangent=tangent
        ) -> np.ndarray:
            here = linear(xssss, j, xi)
            values = [
                *(linear(nodes, j, xi) @ here),
                linear(product, j, xi) - own,
                here @ (linear(xs, j, xi) - tangent),
            ]
            return np.array(values) / np.hypot((j + xi) / n - place, delta_p)

        value = integrate(integrand, n, place, smooth=delta_p == 0.0)
        first.append(value[:3])
        second.append(value[3] + phi_0 * own)
        third.append(value[4])
    out = np.empty(n - 1)
    for j in range(1, n):

        def rest(i, xi, j=j) -> np.ndarray:
            return (linear(xssss, i, xi) - xssss[j]) / np.hypot((i + xi) / n - s[j], delta[j])

        out[j - 1] = (
            xs[j] @ (first[j] - first[j - 1]) / h
            - 6.0 * (second[j] - second[j - 1]) / h
            - 2.0 * (third[j] - third[j - 1]) / h
            - xss[j] @ integrate(rest, n, s[j], smooth=delta[j] == 0.0)
            + 6.0 * phi_0 * (xss[j] @ xssss[j] + xsss[j] @ xsss[j])
        )
    return out


def graded_nodes(s: float, width: float, order: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Return quadrature nodes and weights on [0, 1] graded towards `s` down to `width`."""
    reach = [0.0]
    step = width
    while step < 1.0:
        reach.append(step)
        step *= 2.0
    edges = np.unique(np.clip([s - r for r in reach] + [s + r for r in reach] + [0, 1], 0, 1))
    y, w = leggauss(order)
    left, size = edges[:-1, None], np.diff(edges)[:, None]
    return (left + 0.5 * size * (y + 1.0)).ravel(), (0.5 * size * w).ravel()


def continuous_finite_part(position, force, s: float, delta: float) -> np.ndarray:
    """Return K_delta[force](s) of (24) by graded quadrature of smooth functions of arclength.

    `position(s, order)` and `force(s)` give (3, ...) arrays.
    """
    other, weight = graded_nodes(s, 0.25 * delta)
    here, tangent, own = position(s, 0), position(s, 1), force(s)
    r = here[:, None] - position(other, 0)
    r2 = np.sum(r**2, axis=0)
    f = force(other)
    along = np.sum(r * f, axis=0) / np.where(r2 > 0.0, r2, 1.0)
    first = (f + r * along) / np.sqrt(r2 + delta**2)
    local = own + tangent * (tangent @ own)
    return (first - local[:, None] / np.hypot(s - other, delta)) @ weight


def continuous_stretching(position, force, s: float, delta: Callable) -> float:
    """Return x_s . d/ds K_delta[force] at s, by an interpolant of degree 8 around s.

    delta(s) must be smooth within 0.005 of s.
    """
    window = 0.005
    y = np.cos(np.pi * (np.arange(9) + 0.5) / 9)
    values = [
        continuous_finite_part(position, force, place, float(delta(np.array(place))))
        for place in s + window * y
    ]
    slopes = chebyshev.chebder(chebyshev.chebfit(y, np.array(values), 8)) / window
    return float(position(s, 1) @ chebyshev.chebval(0.0, slopes))
