"""A load in its own file: a harmonic trap that pulls every point of a fiber to one place.

g = -stiffness (x - centre), a force per length on the fiber.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Positions
from stokesfibers.load import AbstractLoad, LoadedState


@dataclass(frozen=True)
class Trap(AbstractLoad):
    """A harmonic trap of `stiffness` (force / length^2) around `centre`."""

    stiffness: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    kind: ClassVar[str] = "trap"
    citation: ClassVar[str] = "a harmonic trap"
    has_net_force: ClassVar[bool] = True  # so that periodic domains without a balance refuse it

    def __post_init__(self) -> None:
        checks.positive("stiffness", self.stiffness)
        object.__setattr__(self, "centre", checks.vector3("centre", self.centre))

    def density(self, state: LoadedState) -> Positions:
        return -self.stiffness * (state.positions - np.array(self.centre))

    def stress(self, state: LoadedState) -> Array:
        """Return - int g (x - x_c) ds, x_c the middle of each fiber, summed over fibers, (3, 3)."""
        lengths = state.weights.sum(axis=1)[:, None, None]
        middle = (state.weights[..., None] * state.positions).sum(axis=1, keepdims=True) / lengths
        arm = state.positions - middle
        return -np.einsum("fn,fni,fnj->ij", state.weights, self.density(state), arm)
