"""GMRES (Saad & Schultz 1986) for operators close to the identity, the same bits on any threads.

Inner products go through `numpy.einsum`, whose order of summation is fixed. The operator hands
back a by-product of each application, and that of the solution is combined from them, which saves
an application. SciPy's offers neither.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot

import numpy as np
from scipy.linalg import solve_triangular

from stokesfibers.core.arrays import Array

Operator = Callable[[Array], tuple[Array, Array]]
"""Takes v to (A v, C v): the operator, and something linear that came up on the way."""


def gmres(operator: Operator, right: Array, *, reduction: float, most: int) -> tuple[Array, int]:
    """Return C u for the solution of A u = right from the guess 0, and the iterations taken.

    Parameters
    ----------
    operator
        A and C together.
    right
        Any shape.
    reduction
        What the residual is brought down to, relative to `right` in the 2-norm.
    most
        Iterations after which to give up.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the residual is not reduced, or not finite.
    """
    size = _norm(right)
    if not np.isfinite(size):
        raise np.linalg.LinAlgError("the coupled system is not finite")
    if size == 0.0:
        return operator(right)[1], 1
    basis, found = [right / size], []
    least = _LeastSquares()
    for j in range(most):
        image, product = operator(basis[j])
        found.append(product)
        column = []
        for v in basis:
            column.append(float(np.einsum("i,i->", v.ravel(), image.ravel())))
            image = image - column[-1] * v
        left = _norm(image)
        if not np.isfinite(left):
            raise np.linalg.LinAlgError("the coupled system is not finite")
        if least.add(column, left) <= reduction:
            share = least.solution()
            total = size * share[0] * found[0]
            for c, product in zip(share[1:], found[1:], strict=True):
                total = total + size * c * product
            return total, j + 1
        basis.append(image / left)
    raise np.linalg.LinAlgError(f"no reduction to {reduction:g} in {most} iterations")


class _LeastSquares:
    """min |e_1 - H y| of a Hessenberg matrix that grows by a column, by Givens rotations."""

    def __init__(self) -> None:
        self._triangle: list[list[float]] = []
        self._turns: list[tuple[float, float]] = []
        self._target = [1.0]

    def add(self, column: list[float], below: float) -> float:
        """Take a column of H and what stands below its diagonal; return the residual."""
        rows = [*column, below]
        for i, (c, s) in enumerate(self._turns):
            rows[i], rows[i + 1] = c * rows[i] + s * rows[i + 1], c * rows[i + 1] - s * rows[i]
        size = hypot(rows[-2], rows[-1])
        if size == 0.0:
            raise np.linalg.LinAlgError("the coupled system is singular")
        c, s = rows[-2] / size, rows[-1] / size
        self._turns.append((c, s))
        self._triangle.append([*rows[:-2], size])
        rest = self._target.pop()
        self._target += [c * rest, -s * rest]
        return abs(s * rest)

    def solution(self) -> Array:
        """Return y."""
        matrix = np.zeros((len(self._triangle), len(self._triangle)))
        for j, column in enumerate(self._triangle):
            matrix[: j + 1, j] = column
        return solve_triangular(matrix, self._target[:-1])


def _norm(values: Array) -> float:
    return float(np.sqrt(np.einsum("i,i->", values.ravel(), values.ravel())))
