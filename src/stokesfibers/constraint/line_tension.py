"""The line-tension equation (22), corrected, with the penalisation of (14).

With the local operator Lambda[g] = a g + b x_s (x_s . g), where (3) has a + b = -2c, it reads

    -(a + b) T_ss + a T x_ss.x_ss - x_s . d/ds K[(T x_s)_s]
        = 8 pi mu x_s . dU_0/ds + E [(4a + 3b) x_ss.x_ssss + 3 (a + b) x_sss.x_sss]
          - E x_s . d/ds K[x_ssss] - 8 pi mu beta (1 - x_s.x_s),       T(0) = T(L) = 0.

The printed (13) and (22) have x_ss.x_sss where x_ss.x_ssss stands here (errata). The tension is
positive where the fiber is stretched.
"""

from __future__ import annotations

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.sampled import Shape


def tension_system(
    fiber: DiscreteFiber, shape: Shape, stretching: Array, *, drag: float, beta: float
) -> tuple[Array, Array]:
    """Return matrix (N - 1, N - 1) and right-hand side (N - 1,) for the inner tensions.

    (13) with K_delta and the penalisation: (11), expanded with the ladder (12), (36).

    Parameters
    ----------
    fiber
        Discretised fiber.
    shape
        Its centreline.
    stretching
        x_s . dU_0/ds at the nodes, (node,), in units of 1/time.
    drag
        8 pi mu.
    beta
        Penalisation parameter, in units of 1/time.
    """
    a, b, phi_0 = fiber.local.a, fiber.local.b, fiber.weights.phi_0
    h = fiber.grid.spacing
    matrix, bending = fiber.tension_coupling(shape)
    inner = matrix[1:-1]
    count = inner.shape[0]
    rows = np.arange(count)
    curvature2 = np.sum(shape.xss**2, axis=0)[1:-1]
    second = (2.0 * phi_0 - (a + b)) / h**2
    inner[rows, rows] += second
    inner[rows, rows + 2] += second
    inner[rows, rows + 1] += -2.0 * second + (a - phi_0) * curvature2
    stretch = np.sum(shape.xs**2, axis=0)
    right = drag * (stretching - beta * (1.0 - stretch)) + fiber.rigidity * (
        (4.0 * a + 3.0 * b) * np.sum(shape.xss * shape.xssss, axis=0)
        + 3.0 * (a + b) * np.sum(shape.xsss**2, axis=0)
        - bending
    )
    return np.ascontiguousarray(inner[:, 1:-1]), right[1:-1]


def solve_tension(
    fiber: DiscreteFiber, shape: Shape, stretching: Array, *, drag: float, beta: float
) -> Array:
    """Solve (22) by dense LU; return the nodal tensions (node,), zero at the ends."""
    matrix, right = tension_system(fiber, shape, stretching, drag=drag, beta=beta)
    tension = np.zeros(fiber.grid.intervals + 1)
    tension[1:-1] = np.linalg.solve(matrix, right)
    return tension
