"""Array aliases whose names say the axes. All arrays are C-contiguous float64.

Axes are always ordered (time, fiber, node, space); leading ones are dropped when absent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Positions = NDArray[np.float64]
"""Positions of one time: (fiber, node, space)."""
Points = NDArray[np.float64]
"""Any set of points: (..., space)."""
Nodal = NDArray[np.float64]
"""A scalar along fibers: (fiber, node)."""


def as_float(values: object) -> Array:
    """Return `values` as a C-contiguous float64 array (copied only if needed)."""
    return np.ascontiguousarray(values, dtype=np.float64)
