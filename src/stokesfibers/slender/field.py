"""The fluid's velocity off the fibers: (5).

``8 pi mu (U(x) - U_0(x)) = - int [(I + RR)/|R| + (eps L)^2/2 (I - 3 RR)/|R|^3] f ds`` with
R = x - x(s) and f = -(T x_s)_s + E x_ssss the force of the fluid on the fiber, as in (9). The
formula holds outside the fiber's surface r(s) = 2 eps sqrt(s (L - s)); it is accurate to O(eps).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array, Points
from stokesfibers.kernels import stokeslet
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.sampled import Shape

_MOST_PANELS = 256
_SURFACE = 0.99  # of the radius: points on the surface count as outside, to rounding
_SAMPLES = 16


def disturbance(fiber: DiscreteFiber, shape: Shape, force: Array, points: Points) -> Points:
    """Return 8 pi mu (U - U_0) due to one fiber, at `points` (point, 3).

    Parameters
    ----------
    fiber, shape
        The fiber and its centreline.
    force
        f at the nodes, (3, node), in units of force / length.
    points
        Where, (point, 3).

    Returns
    -------
    Array of shape (point, 3), in units of force / length; NaN inside the fiber.
    """
    gauss_x, gauss_w = np.polynomial.legendre.leggauss(4)
    points = np.ascontiguousarray(points)
    grid = fiber.grid
    value = -stokeslet.line_velocity(
        points,
        shape.x,
        shape.xs,
        np.ascontiguousarray(force),
        grid.spacing,
        0.5 * (fiber.eps * grid.length) ** 2,
        0.5 * (gauss_x + 1.0),
        0.5 * gauss_w,
        _MOST_PANELS,
    )
    inside = _inside(fiber, shape, points)
    return np.where(inside[:, None], np.nan, value)


def _inside(fiber: DiscreteFiber, shape: Shape, points: Points) -> NDArray[np.bool_]:
    nearest = stokeslet.nearest_on_centreline(
        points, shape.x, shape.xs, fiber.grid.spacing, _SAMPLES
    )
    distance, s = nearest.T
    radius = 2.0 * fiber.eps * np.sqrt(np.clip(s * (fiber.grid.length - s), 0.0, None))
    return distance < _SURFACE * radius
