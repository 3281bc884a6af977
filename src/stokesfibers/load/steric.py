"""Short-range repulsion between fibers, since slender body theory does not keep them apart.

Two elements of centreline at distance R, of fibers with mid-length radii r_1 and r_2, repel with
the potential per length squared

    phi(R) = (A w / 3) (1 - (R - r_1 - r_2) / w)^3    for R < r_1 + r_2 + w, else 0,

w the range and A the strength: at contact the force per length squared is A, and it grows further
where fibers overlap. The force vanishes with two derivatives of phi at the range.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Positions
from stokesfibers.domain.neighbours import Neighbours, within
from stokesfibers.load.base import AbstractLoad, LoadedState


@dataclass(frozen=True)
class StericRepulsion(AbstractLoad):
    """Short-range repulsion between fibers.

    Attributes
    ----------
    strength
        A, in units of force / length^2.
    range
        w, beyond contact of the surfaces, in units of length; should span a few node spacings.
    """

    strength: float
    range: float
    kind: ClassVar[str] = "steric"
    citation: ClassVar[str] = "stokesfibers, theory page 'Steric repulsion'"

    def __post_init__(self) -> None:
        checks.positive("strength", self.strength)
        checks.positive("range", self.range)

    def density(self, state: LoadedState) -> Positions:
        flat = np.zeros((state.weights.size, 3))
        pairs, force = self._pair_forces(state)
        weights = state.weights.ravel()
        np.add.at(flat, pairs.first, weights[pairs.second, None] * force)
        np.add.at(flat, pairs.second, -weights[pairs.first, None] * force)
        return flat.reshape(state.positions.shape)

    def stress(self, state: LoadedState) -> Array:
        pairs, force = self._pair_forces(state)
        points, weights = state.positions.reshape(-1, 3), state.weights.ravel()
        apart = points[pairs.first] - points[pairs.second] + pairs.shift
        share = weights[pairs.first] * weights[pairs.second]
        # f carries -g, so the virial of the pair enters with a minus
        return -np.einsum("n,ni,nj->ij", share, force, apart)

    def _pair_forces(self, state: LoadedState) -> tuple[Neighbours, Array]:
        """Return near pairs and the force per length squared on the first of each, (pair, 3)."""
        nodes = state.positions.shape[1]
        radius = np.repeat(state.radii, nodes)
        pairs = within(state.positions, 2.0 * float(state.radii.max()) + self.range, state.domain)
        points = state.positions.reshape(-1, 3)
        apart = points[pairs.first] - points[pairs.second] + pairs.shift
        distance = np.linalg.norm(apart, axis=1)
        gap = distance - radius[pairs.first] - radius[pairs.second]
        size = self.strength * np.clip(1.0 - gap / self.range, 0.0, None) ** 2
        unit = apart / np.where(distance > 0.0, distance, 1.0)[:, None]
        return pairs, size[:, None] * unit
