"""Compiled line integrals of Stokeslets and doublets, (5): velocity at points off the centreline.

The slow twin is in ``tests/reference``. Centrelines are cubic Hermite pieces, the force is linear
on each interval; an interval is cut into panels no longer than its distance from the point, each
integrated with four Gauss-Legendre nodes.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"reassoc", "contract", "arcp", "nsz"},
}
# Parts are inlined and not cached by themselves; see `kernels`.
_PART = {**_OPTIONS, "cache": False, "forceinline": True}


@njit(**_PART)
def _centreline(x, xs, h, j, xi, out):
    """Set out to the cubic Hermite point at fraction xi of interval j."""
    back = 1.0 - xi
    w0, w1 = back * back * (1.0 + 2.0 * xi), xi * xi * (3.0 - 2.0 * xi)
    t0, t1 = h * xi * back * back, -h * xi * xi * back
    for d in range(3):
        out[d] = w0 * x[d, j] + w1 * x[d, j + 1] + t0 * xs[d, j] + t1 * xs[d, j + 1]


@njit(**_PART)
def _panels(point, x, h, j, most):
    """Return how many panels interval j needs, seen from the point."""
    near = 1e300
    for fraction in (0.0, 0.5, 1.0):
        d2 = 0.0
        for d in range(3):
            r = point[d] - (1.0 - fraction) * x[d, j] - fraction * x[d, j + 1]
            d2 += r * r
        near = min(near, d2)
    distance = max(np.sqrt(near) - 0.25 * h, h / most)
    return min(most, int(np.ceil(h / distance)))


@njit(**_OPTIONS)
def line_velocity(points, x, xs, f, h, doublet, gauss_x, gauss_w, most):
    """Return int [(I + RR)/|R| + doublet (I - 3 RR)/|R|^3] f ds at `points` (point, 3).

    x, xs and f have shape (3, node); `doublet` is r(L/2)^2 / 2, that is (eps L)^2 / 2; gauss_x and
    gauss_w are a rule on [0, 1]; `most` bounds the panels of an interval.
    """
    out = np.zeros(points.shape)
    at = np.empty(3)
    for i in range(points.shape[0]):
        for j in range(x.shape[1] - 1):
            count = _panels(points[i], x, h, j, most)
            for panel in range(count):
                for q in range(gauss_x.size):
                    xi = (panel + gauss_x[q]) / count
                    _centreline(x, xs, h, j, xi, at)
                    rx, ry, rz = points[i, 0] - at[0], points[i, 1] - at[1], points[i, 2] - at[2]
                    fx = (1.0 - xi) * f[0, j] + xi * f[0, j + 1]
                    fy = (1.0 - xi) * f[1, j] + xi * f[1, j + 1]
                    fz = (1.0 - xi) * f[2, j] + xi * f[2, j + 1]
                    inverse2 = 1.0 / (rx * rx + ry * ry + rz * rz)
                    weight = gauss_w[q] * h / count * np.sqrt(inverse2)
                    rf = (rx * fx + ry * fy + rz * fz) * inverse2
                    plain = weight * (1.0 + doublet * inverse2)
                    along = weight * rf * (1.0 - 3.0 * doublet * inverse2)
                    out[i, 0] += plain * fx + along * rx
                    out[i, 1] += plain * fy + along * ry
                    out[i, 2] += plain * fz + along * rz
    return out


@njit(**_OPTIONS)
def nearest_on_centreline(points, x, xs, h, samples):
    """Return distance and arclength of the nearest of `samples` points per interval, (point, 2)."""
    out = np.empty((points.shape[0], 2))
    at = np.empty(3)
    for i in range(points.shape[0]):
        best, where = 1e300, 0.0
        for j in range(x.shape[1] - 1):
            for q in range(samples + 1):
                xi = q / samples
                _centreline(x, xs, h, j, xi, at)
                d2 = 0.0
                for d in range(3):
                    r = points[i, d] - at[d]
                    d2 += r * r
                if d2 < best:
                    best, where = d2, (j + xi) * h
        out[i, 0], out[i, 1] = np.sqrt(best), where
    return out
