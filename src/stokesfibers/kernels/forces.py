"""Compiled sums of the plain forms (7), (8), for forces without an F that vanishes at the ends.

Same conventions as ``kernels/pairs.py``: component first, times 8 pi mu, without the minus of (6).
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


@njit(**_OPTIONS)
def forces_velocity(points, middle, own, x, force, weights, doublet, periods, shifts):
    """Return the sum of V + D W by (7), (8) over all fibers but `own`, and all images.

    Parameters
    ----------
    points, middle, own
        Targets (point, 3), where they are, and their fiber; as in ``others_velocity``.
    x, force
        Sources and force per length, (fiber, 3, node).
    weights, doublet
        Quadrature weights (fiber, node) and (eps L)^2 / 2 (fiber,).
    periods, shifts
        Periods (3,) and shifts of all images, (image, 3).
    """
    out = np.zeros(points.shape)
    half = x.shape[2] // 2
    for k in range(x.shape[0]):
        acting = False
        for j in range(x.shape[2]):
            if force[k, 0, j] != 0.0 or force[k, 1, j] != 0.0 or force[k, 2, j] != 0.0:
                acting = True
        if not acting:
            continue
        base = np.zeros(3)
        for d in range(3):
            if periods[d] > 0.0:
                r = middle[d] - x[k, d, half]
                base[d] = -periods[d] * np.round(r / periods[d])
        for q in range(shifts.shape[0]):
            sx, sy, sz = base[0] + shifts[q, 0], base[1] + shifts[q, 1], base[2] + shifts[q, 2]
            if k == own and sx == 0.0 and sy == 0.0 and sz == 0.0:
                continue
            for i in range(points.shape[0]):
                px, py, pz = points[i, 0] + sx, points[i, 1] + sy, points[i, 2] + sz
                ox, oy, oz = 0.0, 0.0, 0.0
                for j in range(x.shape[2]):
                    rx, ry, rz = px - x[k, 0, j], py - x[k, 1, j], pz - x[k, 2, j]
                    fx, fy, fz = force[k, 0, j], force[k, 1, j], force[k, 2, j]
                    inverse2 = 1.0 / (rx * rx + ry * ry + rz * rz)
                    weight = weights[k, j] * np.sqrt(inverse2)
                    along = (rx * fx + ry * fy + rz * fz) * inverse2
                    plain = weight * (1.0 + doublet[k] * inverse2)
                    on_r = weight * along * (1.0 - 3.0 * doublet[k] * inverse2)
                    ox += plain * fx + on_r * rx
                    oy += plain * fy + on_r * ry
                    oz += plain * fz + on_r * rz
                out[i, 0] += ox
                out[i, 1] += oy
                out[i, 2] += oz
    return out
