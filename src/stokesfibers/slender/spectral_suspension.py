"""Many fibers in Legendre modes: what they induce on each other, (6)-(8), with close approach.

`SpectralInteraction` holds what does not change, `SpectralScene` the fibers at one moment.
Velocities are times 8 pi mu and carry the sign of (6): a fiber moves with minus the sum over the
others. All fibers have the same number of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import AbstractDomain
from stokesfibers.kernels import spectral_pairs as kernels
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_images import AbstractFarImages, FarSources, images_of
from stokesfibers.slender.spectral_interaction import (
    AbstractSpectralInteraction,
    AbstractSpectralScene,
    CloseSettings,
    quadrature_rules,
)
from stokesfibers.summation.close_approach import AbstractCloseApproach
from stokesfibers.summation.images import AbstractImageSum


@dataclass(frozen=True)
class SpectralInteraction(AbstractSpectralInteraction):
    """How fibers act on each other: domain, image sum, close approach; prepared for the kernels.

    Attributes
    ----------
    fibers
        Discretised fibers.
    domain
        Free or periodic space.
    near_shifts
        Of the images that are summed directly, (image, 3).
    far
        How the other images are summed; None if there are none.
    close
        Where nodes are not enough.
    """

    fibers: tuple[SpectralFiber, ...]
    domain: AbstractDomain
    near_shifts: Array
    far: AbstractFarImages | None
    close: CloseSettings

    @classmethod
    def build(
        cls,
        fibers: tuple[SpectralFiber, ...],
        domain: AbstractDomain,
        *,
        image_sum: AbstractImageSum,
        close_approach: AbstractCloseApproach,
        tolerance: float = 1e-6,
    ) -> SpectralInteraction:
        """Prepare the interaction of `fibers` in `domain`.

        The velocities between fibers err by `tolerance`, relative to those near the fibers.
        """
        close = CloseSettings.of(fibers, close_approach, tolerance)
        near, far = images_of(image_sum, domain, tolerance)
        return cls(fibers, domain, near, far, close)

    @property
    def alone(self) -> bool:
        """True if nothing acts on anything: one fiber without images."""
        return len(self.fibers) == 1 and len(self.near_shifts) == 1

    def domain_at(self, t: float) -> AbstractDomain:  # noqa: ARG002
        return self.domain

    def still(self, domain: AbstractDomain) -> SpectralInteraction:  # noqa: ARG002
        return self

    def scene(self, modes: Array, t: float, workers: Workers) -> SpectralScene:  # noqa: ARG002
        return SpectralScene(self, modes, workers)


class SpectralScene(AbstractSpectralScene):
    """The fibers at one moment, as sources of flow.

    Parameters
    ----------
    interaction
        How they act on each other.
    modes
        Position modes for unit length, (fiber, 3, N).
    workers
        Threads and ranks; each rank prepares and sums at the nodes of its share of the fibers.
    """

    def __init__(self, interaction: SpectralInteraction, modes: Array, workers: Workers) -> None:
        self._interaction = interaction
        self._workers = workers
        fibers = interaction.fibers
        lengths = np.array([f.length for f in fibers])
        scaled = lengths[:, None, None] * modes
        self._x = np.matmul(scaled, fibers[0].tables[0].T)
        self._doublets = np.array([0.5 * (f.eps * f.length) ** 2 for f in fibers])
        self._quadrature = np.stack([f.quadrature for f in fibers])[:, None]
        self._to_legendre = fibers[0].to_legendre.T
        series = np.matmul(scaled, fibers[0].position_series)
        self._sources = (self._x, series, fibers[0].sigma, lengths, self._doublets)
        self._close = interaction.close.around(modes, fibers).arguments
        self._middles = np.ascontiguousarray(scaled[:, :, 0])
        far = interaction.far
        sources = FarSources(self._x, series, lengths, self._doublets)
        self._far = None if far is None else far.scene(sources)
        self._prepared: list[Any] = [None] * len(fibers)

        self._share = workers.team.share(len(fibers))

        def prepare(i: int) -> None:
            k = self._share[i]
            self._prepared[k] = self._geometry(self._x[k], k, self._middles[k])

        workers.for_each(len(self._share), prepare)

    def velocity(self, force: Array, resisted: Array) -> Array:
        forces = self._forces(force, resisted)
        out = np.empty_like(self._x)

        def fill(i: int) -> None:
            k = self._share[i]
            out[k] = self._others(self._x[k], k, self._prepared[k], forces=forces)

        self._workers.for_each(len(self._share), fill)
        self._workers.team.complete(out)
        return out

    def fluid(self, points: Points, force: Array, resisted: Array) -> Points:
        forces = self._forces(force, resisted)
        out = np.empty(points.shape)

        def fill(i: int) -> None:
            one = np.ascontiguousarray(points[i, :, None])
            geometry = self._geometry(one, -1, points[i])
            out[i] = self._others(one, -1, geometry, forces=forces)[:, 0]

        self._workers.for_each(len(points), fill)
        return out

    def _forces(self, force: Array, resisted: Array) -> Any:
        """Return what sums over near and over far images take of the forces."""
        weighted = force * self._quadrature
        near = weighted, np.matmul(force, self._to_legendre), np.matmul(resisted, self._to_legendre)
        return near, None if self._far is None else self._far.forces(weighted)

    def _geometry(self, points: Array, own: int, middle: Array) -> Any:
        """Return all that the sum at `points` (3, point) around `middle` needs but the forces."""
        interaction = self._interaction
        apart = middle - self._middles
        shift = interaction.domain.nearest_image(apart) - apart
        near = kernels.near_rows(
            points,
            own,
            shift,
            interaction.near_shifts,
            self._sources,
            self._close,
            quadrature_rules(),
        )
        return shift, near, None if self._far is None else self._far.prepare(points, own, shift)

    def _others(self, points: Array, own: int, geometry: Any, *, forces: Any) -> Array:
        shift, near, prepared = geometry
        found = kernels.others_velocity(
            points,
            own,
            shift,
            self._interaction.near_shifts,
            self._x,
            self._doublets,
            near,
            forces[0],
        )
        return found if self._far is None else found + self._far.velocity(prepared, forces[1])
