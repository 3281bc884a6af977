"""One moment of a run as observables see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stokesfibers.core.arrays import Array, Nodal, Positions
from stokesfibers.slender.discrete import DiscreteFiber, Shape


@dataclass(frozen=True)
class Snapshot:
    """Shapes and tensions at one time.

    Attributes
    ----------
    time
        Simulated time.
    fibers
        Discretised fibers.
    shapes
        Their centrelines.
    tension
        Nodal tensions, (fiber, node).
    """

    time: float
    fibers: tuple[DiscreteFiber, ...]
    shapes: tuple[Shape, ...]
    tension: Nodal

    @classmethod
    def take(
        cls, time: float, fibers: tuple[DiscreteFiber, ...], positions: Positions, tension: Nodal
    ) -> Snapshot:
        """Return the snapshot of positions (fiber, node, space) and tensions (fiber, node)."""
        shapes = tuple(f.shape(x.T) for f, x in zip(fibers, positions, strict=True))
        return cls(time, fibers, shapes, tension)

    @property
    def positions(self) -> Positions:
        """Positions, (fiber, node, space)."""
        return np.stack([shape.x.T for shape in self.shapes])

    def integrate(self, values: list[Array]) -> Array:
        """Return the integrals over arclength of nodal values (..., node), one per fiber."""
        pairs = zip(self.fibers, values, strict=True)
        return np.stack([v @ f.grid.trapezoid for f, v in pairs])
