"""Dense linear solves that several threads can do at once: NumPy's own hold each other up."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def solve(matrix, right):
    """Return the solution of matrix @ x = right, (n,); LinAlgError if singular or not finite."""
    return np.linalg.solve(matrix, right)
