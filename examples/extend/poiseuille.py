"""A background flow in its own file: the flow between two plates.

U = (speed (1 - (y / half_width)^2), 0, 0). Nothing keeps fibers off the plates.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.flow import AbstractFlow


@dataclass(frozen=True)
class Poiseuille(AbstractFlow):
    """Flow along x with `speed` at y = 0 and none at y = +- `half_width`."""

    speed: float
    half_width: float
    kind: ClassVar[str] = "poiseuille"

    def __post_init__(self) -> None:
        checks.finite("speed", self.speed)
        checks.positive("half_width", self.half_width)

    def velocity(self, x: Points, t: float) -> Points:  # noqa: ARG002
        u = np.zeros_like(x)
        u[..., 0] = self.speed * (1.0 - (x[..., 1] / self.half_width) ** 2)
        return u

    def gradient(self, x: Points, t: float) -> Array:  # noqa: ARG002
        slope = np.zeros((*x.shape, 3))  # [..., i, j] is dU_i / dx_j
        slope[..., 0, 1] = -2.0 * self.speed * x[..., 1] / self.half_width**2
        return slope

    def rate_scale(self) -> float:
        return 2.0 * abs(self.speed) / self.half_width
