"""Flows without a gradient: one velocity everywhere, and fluid at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.flow.base import AbstractFlow, as_points


@final
@dataclass(frozen=True)
class Uniform(AbstractFlow):
    """The same velocity at all points and times, U.

    Attributes
    ----------
    stream_velocity
        The vector U [length/time]. Not called ``velocity``: that is the method.
    """

    kind: ClassVar[str] = "uniform"

    stream_velocity: tuple[float, float, float] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        vector = checks.vector3("stream_velocity", self.stream_velocity)
        object.__setattr__(self, "stream_velocity", vector)

    def velocity(self, x: Points, t: float) -> Points:  # noqa: ARG002
        velocity = np.empty_like(as_points(x))
        velocity[...] = self.stream_velocity
        return velocity

    def gradient(self, x: Points, t: float) -> Array:  # noqa: ARG002
        return np.zeros((*as_points(x).shape, 3))

    def rate_scale(self) -> float:
        return 0.0


@final
@dataclass(frozen=True)
class NoFlow(AbstractFlow):
    """Fluid at rest far from the fibers, U = 0."""

    kind: ClassVar[str] = "none"

    def velocity(self, x: Points, t: float) -> Points:  # noqa: ARG002
        return np.zeros_like(as_points(x))

    def gradient(self, x: Points, t: float) -> Array:  # noqa: ARG002
        return np.zeros((*as_points(x).shape, 3))

    def rate_scale(self) -> float:
        return 0.0
