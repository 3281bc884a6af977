"""A kind of fiber of the high-order engine on the points where observables and records see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.numerics.chebyshev import ChebyshevGrid
from stokesfibers.problem.discretised import SHOWN_PER_NODE
from stokesfibers.slender.sampled import Shape
from stokesfibers.slender.spectral import SpectralFiber


@dataclass(frozen=True, eq=False)
class ShownFiber:
    """One kind of fiber on Chebyshev points.

    Attributes
    ----------
    grid
        The points.
    rigidity
        E.
    eps
        Slenderness.
    tables
        Derivatives 0 ... 4 of the position modes at the points, (5, node, N).
    tension_table
        Tension modes at the points, (node, N - 1).
    """

    grid: ChebyshevGrid
    rigidity: float
    eps: float
    tables: Array
    tension_table: Array

    @classmethod
    def of(cls, fiber: SpectralFiber) -> ShownFiber:
        """Return where `fiber` is shown."""
        grid = ChebyshevGrid(fiber.length, SHOWN_PER_NODE * fiber.count)
        sigma = grid.nodes / fiber.length
        tables = [
            fiber.length ** (1 - order) * fiber.basis.positions(sigma, order) for order in range(5)
        ]
        tension = fiber.force_unit * fiber.basis.tensions(sigma, 0)
        return cls(grid, fiber.rigidity, fiber.eps, np.stack(tables), tension)

    def shape(self, modes: Array) -> Shape:
        """Return the centreline of position modes (3, N)."""
        return Shape(*np.matmul(modes, self.tables.transpose(0, 2, 1)))
