"""Weight: one constant force per length on every fiber.

Under net force a fiber's stress is taken about its centre x_c, the mean of x over arclength: with
f = f_e - g and f_e the elastic force, whose integral vanishes,

    int f (x - x_c) ds = int f_e x ds - int g (x - x_c) ds,

and a constant g leaves nothing in the last integral. So weight adds nothing to the extra stress by
itself, and no torque either; it changes the tension and the shape, which are in the first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Positions
from stokesfibers.load.base import AbstractLoad, LoadedState


@dataclass(frozen=True)
class Gravity(AbstractLoad):
    """A constant force per length, e.g. weight less buoyancy.

    A straight fiber falls without bending and without turning, at (2) with K = 0: its radius
    r(s) = 2 eps sqrt(s (L - s)) gives it the same drag everywhere.

    In periodic domains a net force F per cell needs a convention about the mean flow. By the Ewald
    sum: with three periodic directions the mean velocity of the whole suspension is zero and a
    uniform pressure gradient bears F. With two, far from the fibers the fluid moves with
    ``-|z| F / (2 mu A)`` along the planes, z the free direction and A the cell's area, symmetric
    about the layer, and not along z, where a pressure difference bears F. With one, the velocity
    would have no bound; it is refused.

    Attributes
    ----------
    force
        g, in units of force / length; (0, 0, -1) pulls towards negative z.
    """

    force: tuple[float, float, float]
    kind: ClassVar[str] = "gravity"
    citation: ClassVar[str] = "stokesfibers, theory page 'Weight'"
    has_net_force: ClassVar[bool] = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", checks.vector3("force", self.force))

    def density(self, state: LoadedState) -> Positions:
        return np.broadcast_to(np.array(self.force), state.positions.shape).copy()

    def stress(self, state: LoadedState) -> Array:  # noqa: ARG002
        return np.zeros((3, 3))
