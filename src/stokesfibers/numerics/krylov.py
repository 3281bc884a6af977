"""GMRES (Saad & Schultz 1986) for operators close to the identity, the same bits on any threads.

Inner products go through `numpy.einsum`, whose order of summation is fixed. The operator hands
back a by-product of each application, and that of the solution is combined from them, which saves
an application. SciPy's offers neither.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

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
    hessenberg = np.zeros((most + 1, most))
    for j in range(most):
        image, product = operator(basis[j])
        found.append(product)
        for i, v in enumerate(basis):
            hessenberg[i, j] = np.einsum("i,i->", v.ravel(), image.ravel())
            image = image - hessenberg[i, j] * v
        left = hessenberg[j + 1, j] = _norm(image)
        if not np.isfinite(left):
            raise np.linalg.LinAlgError("the coupled system is not finite")
        target = np.zeros(j + 2)
        target[0] = 1.0
        small = hessenberg[: j + 2, : j + 1]
        share, *_ = np.linalg.lstsq(small, target, rcond=None)
        if np.linalg.norm(target - small @ share) <= reduction:
            total = size * share[0] * found[0]
            for c, product in zip(share[1:], found[1:], strict=True):
                total = total + size * c * product
            return total, j + 1
        basis.append(image / left)
    raise np.linalg.LinAlgError(f"no reduction to {reduction:g} in {most} iterations")


def _norm(values: Array) -> float:
    return float(np.sqrt(np.einsum("i,i->", values.ravel(), values.ravel())))
