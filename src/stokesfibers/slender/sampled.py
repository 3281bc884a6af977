"""A fiber's centreline at points along it, whatever engine it comes from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from stokesfibers.core.arrays import Array, Nodal, Positions


@dataclass(frozen=True)
class Shape:
    """A centreline with its arclength derivatives at the nodes, each of shape (3, node)."""

    x: Array
    xs: Array
    xss: Array
    xsss: Array
    xssss: Array


class Grid(Protocol):
    """Points along a fiber, both ends included, that values can be integrated and interpolated on.

    Attributes
    ----------
    length
        L.
    nodes
        Arclength of the points, (node,).
    weights
        Quadrature weights in arclength, (node,).
    """

    @property
    def length(self) -> float: ...

    @property
    def nodes(self) -> Array: ...

    @property
    def weights(self) -> Array: ...

    def interpolate(self, values: Array, s: Array) -> Array:
        """Return nodal values (node, ...) at arclengths s (point,), (point, ...)."""
        ...


class SampledFiber(Protocol):
    """One kind of fiber on a grid.

    Attributes
    ----------
    grid
        Where it is sampled.
    rigidity
        E.
    eps
        Slenderness.
    """

    @property
    def grid(self) -> Grid: ...

    @property
    def rigidity(self) -> float: ...

    @property
    def eps(self) -> float: ...


def radii(fiber: SampledFiber) -> Array:
    """Return r(s) = 2 eps sqrt(s (L - s)) at the nodes, (node,)."""
    s = fiber.grid.nodes
    return 2.0 * fiber.eps * np.sqrt(np.clip(s * (fiber.grid.length - s), 0.0, None))


@dataclass(frozen=True)
class View:
    """All fibers at one time.

    Attributes
    ----------
    time
        Simulated time.
    fibers
        Where each is sampled, and what it is.
    shapes
        Centrelines.
    tension
        Nodal tensions, (fiber, node).
    """

    time: float
    fibers: tuple[SampledFiber, ...]
    shapes: tuple[Shape, ...]
    tension: Nodal

    @property
    def positions(self) -> Positions:
        """Positions, (fiber, node, space)."""
        return np.stack([shape.x.T for shape in self.shapes])
