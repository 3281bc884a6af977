"""Many fibers in Legendre modes, their interaction by a fast Ewald sum with near corrections.

    velocity = plain sum over the nodes of all fibers and images, (7) + (8), by `EwaldSum`
             + for each near fiber, (its accurate integral or blend) - (its plain sum).

The work of a sum grows like the number of fibers. Velocities are times 8 pi mu and carry the sign
of (6), as in `slender.spectral_suspension`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import AbstractDomain
from stokesfibers.kernels import spectral_pairs as kernels
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_interaction import (
    AbstractSpectralInteraction,
    AbstractSpectralScene,
    CloseSettings,
    Summed,
    quadrature_rules,
)
from stokesfibers.summation import FastImages
from stokesfibers.summation.close_approach import AbstractCloseApproach
from stokesfibers.summation.ewald import EwaldSum
from stokesfibers.summation.ewald.cloud import Lattice
from stokesfibers.summation.near_images import Balls, NearImages, near_images

_BODIES = 16  # handed to one thread at a time


@dataclass(frozen=True)
class _Still:
    """A domain that does not depend on time."""

    domain: AbstractDomain

    def __call__(self, t: float) -> AbstractDomain:  # noqa: ARG002
        return self.domain


@dataclass(frozen=True)
class EwaldInteraction(AbstractSpectralInteraction):
    """Fibers that act on each other through a fast sum; see `AbstractSpectralInteraction`.

    Attributes
    ----------
    fibers
        Discretised fibers.
    domain_at
        The domain at a time; free, periodic or sheared.
    ewald
        The fast sum.
    close
        Where nodes are not enough.
    """

    fibers: tuple[SpectralFiber, ...]
    domain_at: Callable[[float], AbstractDomain]
    ewald: EwaldSum
    close: CloseSettings

    @classmethod
    def build(
        cls,
        fibers: tuple[SpectralFiber, ...],
        domain_at: Callable[[float], AbstractDomain],
        *,
        close_approach: AbstractCloseApproach,
        tolerance: float = 1e-6,
        chosen: FastImages = FastImages(),  # noqa: B008 - frozen
    ) -> EwaldInteraction:
        """Prepare the interaction; velocities err by `tolerance`, relative to their size.

        `chosen` says how to split the sum; its own tolerance is not read.
        """
        close = CloseSettings.of(fibers, close_approach, tolerance)
        return cls(fibers, domain_at, EwaldSum(tolerance, chosen.split, chosen.cutoff), close)

    @property
    def alone(self) -> bool:
        return False

    def still(self, domain: AbstractDomain) -> EwaldInteraction:
        return replace(self, domain_at=_Still(domain))

    def scene(self, modes: Array, t: float, workers: Workers) -> EwaldScene:
        return EwaldScene(self, modes, self.domain_at(t), workers)


class EwaldScene(AbstractSpectralScene):
    """The fibers at one moment, as sources of flow.

    Parameters
    ----------
    interaction
        How they act on each other.
    modes
        Position modes for unit length, (fiber, 3, N).
    domain
        Free, periodic or sheared.
    workers
        Threads and ranks; each rank corrects at the nodes of its share of the fibers.
    """

    def __init__(
        self,
        interaction: EwaldInteraction,
        modes: Array,
        domain: AbstractDomain,
        workers: Workers,
    ) -> None:
        self._interaction = interaction
        self._domain, self._lattice = domain, Lattice.of(domain)
        self._workers = workers
        fibers = interaction.fibers
        lengths = np.array([f.length for f in fibers])
        scaled = lengths[:, None, None] * modes
        self._x = np.matmul(scaled, fibers[0].tables[0].T)
        self._radii = np.array([f.eps * f.length for f in fibers])
        self._quadrature = np.stack([f.quadrature for f in fibers])
        self._to_legendre = fibers[0].to_legendre.T
        self._polynomials = np.linalg.inv(fibers[0].to_legendre)
        series = np.matmul(scaled, fibers[0].position_series)
        self._sources = (self._x, series, fibers[0].sigma, lengths, 0.5 * self._radii**2)
        self._balls = Balls.around(self._x)
        self._close = interaction.close.around(modes, fibers)
        self._names = np.repeat(np.arange(len(fibers)), fibers[0].count)
        self._points = np.ascontiguousarray(self._x.transpose(0, 2, 1)).reshape(-1, 3)
        self._plan = interaction.ewald.plan(
            domain,
            self._points,
            filaments=self._names,
            radius=np.repeat(self._radii, fibers[0].count),
            workers=workers,
        )
        share = workers.team.share(len(fibers))
        self._share = slice(share.start, share.stop)
        self._corrections: list[Any] = []
        if share:
            own = Balls(self._balls.centres[self._share], self._balls.radii[self._share])
            reach = self._close.widest
            near = near_images(own, self._balls, reach, self._lattice, first=share.start)
            self._corrections = self._near(self._x[self._share], near)

    @property
    def summed(self) -> Summed:
        choice = self._plan.choice
        if choice is None:
            return Summed()
        return Summed(choice.split.rc, int(np.prod(choice.modes)))

    def velocity(self, force: Array, resisted: Array) -> Array:
        weighted = (force * self._quadrature[:, None]).transpose(0, 2, 1).reshape(-1, 3)
        found = self._plan.execute(np.ascontiguousarray(weighted))
        by_fiber = found.reshape(len(self._x), -1, 3)
        own = by_fiber[self._share].reshape(-1, 3)
        self._correct(self._corrections, force, resisted, own)
        self._workers.team.complete(by_fiber)
        return np.ascontiguousarray(by_fiber.transpose(0, 2, 1))

    def fluid(self, points: Points, force: Array, resisted: Array) -> Points:
        plan = self._interaction.ewald.plan(
            self._domain,
            self._points,
            np.ascontiguousarray(points),
            filaments=self._names,
            radius=np.repeat(self._radii, self._x.shape[2]),
            workers=self._workers.alone,
        )
        weighted = (force * self._quadrature[:, None]).transpose(0, 2, 1).reshape(-1, 3)
        found = plan.execute(np.ascontiguousarray(weighted))
        targets = Balls(points, np.zeros(len(points)))
        near = near_images(targets, self._balls, self._close.widest, self._lattice)
        single = np.ascontiguousarray(points[:, :, None])
        self._correct(self._near(single, near), force, resisted, found)
        return found

    def _near(self, points: Array, near: NearImages) -> list[Any]:
        """Return the corrections at points (body, 3, point), in blocks of bodies."""
        plain = self._quadrature, self._polynomials
        listed = near.start, near.source, near.shift
        blocks = -(-len(points) // _BODIES)
        found: list[Any] = [None] * blocks

        def fill(block: int) -> None:
            bodies = block * _BODIES, min((block + 1) * _BODIES, len(points))
            found[block] = kernels.corrections(
                bodies,
                points,
                listed,
                self._sources,
                plain,
                self._close.arguments,
                quadrature_rules(),
            )

        self._workers.for_each(blocks, fill)
        return found

    def _correct(self, found: list[Any], force: Array, resisted: Array, out: Points) -> None:
        """Add the corrections to out (target, 3); each block has targets of its own."""
        series = np.matmul(force, self._to_legendre)
        centreline = np.matmul(resisted, self._to_legendre)

        def add(block: int) -> None:
            kernels.add_corrections(found[block], series, centreline, out)

        self._workers.for_each(len(found), add)
