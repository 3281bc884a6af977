"""Rigid rotation about an axis through the origin, U = omega x x."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.flow.base import AbstractFlow, as_points


@final
@dataclass(frozen=True)
class Rotation(AbstractFlow):
    """Rigid rotation, U = omega x x.

    In components U = (w_y z - w_z y, w_z x - w_x z, w_x y - w_y x) with w = omega.

    Attributes
    ----------
    angular_velocity
        The vector omega [1/time]; along +z it turns x towards y.
    """

    kind: ClassVar[str] = "rotation"

    angular_velocity: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        omega = checks.vector3("angular_velocity", self.angular_velocity)
        object.__setattr__(self, "angular_velocity", omega)

    def velocity(self, x: Points, t: float) -> Points:  # noqa: ARG002
        wx, wy, wz = self.angular_velocity
        points = as_points(x)
        px, py, pz = points[..., 0], points[..., 1], points[..., 2]
        return np.stack([wy * pz - wz * py, wz * px - wx * pz, wx * py - wy * px], axis=-1)

    def gradient(self, x: Points, t: float) -> Array:  # noqa: ARG002
        wx, wy, wz = self.angular_velocity
        gradient = np.empty((*as_points(x).shape, 3))
        gradient[...] = [[0.0, -wz, wy], [wz, 0.0, -wx], [-wy, wx, 0.0]]
        return gradient

    def rate_scale(self) -> float:
        return max(abs(w) for w in self.angular_velocity)
