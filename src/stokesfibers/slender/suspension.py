"""Many fibers: what they induce on each other, (6), (25), (26), with images and close approach.

Everything of one moment is gathered in `Scene`. Velocities are times 8 pi mu and carry the sign of
(6): a fiber moves with minus the sum over the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import AbstractDomain
from stokesfibers.kernels import forces
from stokesfibers.kernels import pairs as kernels
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.sampled import Shape
from stokesfibers.summation.close_approach import AbstractCloseApproach
from stokesfibers.summation.images import AbstractImageSum

_BLOCK = 64  # points handed to one thread at a time


@dataclass(frozen=True)
class Interaction:
    """How fibers act on each other: domain, image sum, close approach; prepared for the kernels.

    Attributes
    ----------
    fibers
        Discretised fibers.
    images
        Periods, shifts of exact images, shifts of far images.
    close
        Settings of the close approach, see `AbstractCloseApproach.settings`.
    about_centre
        Whether far images are taken about the centre of mass instead of the mid-point.
    """

    fibers: tuple[DiscreteFiber, ...]
    images: tuple[Array, Array, Array]
    close: tuple[float, float, Array, bool]
    about_centre: bool

    @classmethod
    def build(
        cls,
        fibers: tuple[DiscreteFiber, ...],
        domain: AbstractDomain,
        *,
        image_sum: AbstractImageSum,
        close_approach: AbstractCloseApproach,
    ) -> Interaction:
        """Prepare the interaction of `fibers` in `domain`."""
        spacing = np.array([f.grid.spacing for f in fibers])
        radius = np.array([f.eps * f.grid.length for f in fibers])
        return cls(
            fibers,
            image_sum.shifts(domain),
            close_approach.settings(spacing, radius),
            image_sum.about == "centre_of_mass",
        )

    @property
    def alone(self) -> bool:
        """True if nothing acts on anything: one fiber without images."""
        return len(self.fibers) == 1 and len(self.images[1]) == 1


class Scene:
    """The fibers at one moment, as sources of flow.

    Parameters
    ----------
    interaction
        How they act on each other.
    shapes
        Their centrelines.
    workers
        Threads.
    """

    def __init__(
        self, interaction: Interaction, shapes: tuple[Shape, ...], workers: Workers
    ) -> None:
        self._interaction = interaction
        self._fibers = interaction.fibers
        self._shapes = shapes
        self.workers = workers
        self._x = np.stack([s.x for s in shapes])
        self._xs = np.stack([s.xs for s in shapes])
        self._h = np.array([f.grid.spacing for f in self._fibers])
        self._doublet = np.array([0.5 * (f.eps * f.grid.length) ** 2 for f in self._fibers])
        weights = np.ones(self._x.shape[2])
        weights[[0, -1]] = 0.5
        self._weights = weights
        self._middle = np.ascontiguousarray(self._x[:, :, self._x.shape[2] // 2])
        self._centres = self._middle
        if interaction.about_centre:
            self._centres = self._x @ weights / weights.sum()

    def integrated_force(self, tension: Array | None, *, bending: bool = True) -> Array:
        """Return F = -T x_s + E x_sss at the nodes, (fiber, 3, node), or one part of it."""
        force = np.zeros_like(self._x)
        for k, (fiber, shape) in enumerate(zip(self._fibers, self._shapes, strict=True)):
            if tension is not None:
                force[k] -= tension[k] * shape.xs
            if bending:
                force[k] += fiber.rigidity * shape.xsss
        return force

    @cached_property
    def bending_value(self) -> Array:
        """Lambda[f] + K[f] of each fiber at its nodes by bending alone, (fiber, 3, node)."""
        return self._per_fiber(lambda k: -self._fibers[k].bending_velocity(self._shapes[k]))

    def tensile_value(self, tension: Array) -> Array:
        """Return Lambda[f] + K[f] of each fiber at its nodes by tension alone."""
        return self._per_fiber(
            lambda k: -self._fibers[k].tensile_velocity(self._shapes[k], tension[k])
        )

    def centreline_value(self, tension: Array) -> Array:
        """Return Lambda[f] + K[f] of each fiber at its nodes, (fiber, 3, node)."""
        return self.tensile_value(tension) + self.bending_value

    def _per_fiber(self, value: Callable[[int], Array]) -> Array:
        out = np.empty_like(self._x)

        def fill(k: int) -> None:
            out[k] = value(k)

        self.workers.for_each(len(self._fibers), fill)
        return out

    def velocity(self, targets: Array, force: Array, centreline: Array) -> Array:
        """Return what all other fibers and images add to (6) at `targets` (fiber, point, 3).

        V and W are (17), (18); the sum over images is (40) as the image sum has it, e.g. (42).
        """
        sources = self._sources(force, centreline)
        out = np.empty(targets.shape)
        count, points = targets.shape[:2]
        blocks = -(-points // _BLOCK)

        def fill(task: int) -> None:
            k, block = divmod(task, blocks)
            rows = slice(block * _BLOCK, (block + 1) * _BLOCK)
            here = np.ascontiguousarray(targets[k, rows])
            out[k, rows] = kernels.others_velocity(here, self._middle[k], k, *sources)

        self.workers.for_each(count * blocks, fill)
        return out

    def _sources(self, force: Array, centreline: Array) -> tuple[Any, ...]:
        """Return all that the kernels need of the sources, the moments (41) included."""
        moments = np.einsum("kan,kbn,n,k->kab", self._xs, force, self._weights, self._h)
        return (
            self._x,
            self._xs,
            force,
            self._h,
            self._doublet,
            self._interaction.images,
            self._interaction.close,
            centreline,
            moments,
            self._centres,
        )

    def at_nodes(self, force: Array, centreline: Array) -> Array:
        """Return `velocity` at the fibers' own nodes, (fiber, 3, node)."""
        targets = np.ascontiguousarray(self._x.transpose(0, 2, 1))
        return self.velocity(targets, force, centreline).transpose(0, 2, 1)

    def stretching(self, force: Array, centreline: Array) -> Array:
        """Return Phi of (26), x_s . d/ds of `velocity`, by (33); (fiber, node), ends zero.

        With images it is (43).
        """
        half = 0.5 * (self._x[:, :, 1:] + self._x[:, :, :-1])
        targets = np.ascontiguousarray(half.transpose(0, 2, 1))
        change = np.diff(self.velocity(targets, force, centreline), axis=1)
        phi = np.zeros(self._x[:, 0].shape)
        phi[:, 1:-1] = np.einsum("kin,kni->kn", self._xs[:, :, 1:-1], change)
        return phi / self._h[:, None]

    def loaded(self, density: Array) -> tuple[Array, Array]:
        """Return what a force per length g on the fibers adds to G and to the right of (27).

        Parameters
        ----------
        density
            g at the nodes, (fiber, 3, node).

        Returns
        -------
        velocity
            (Lambda + K)[g] of the fiber itself plus (7) and (8) of the others, (fiber, 3, node).
        stretching
            x_s . d/ds of it, (fiber, node), ends zero.
        """
        velocity, stretching = np.empty_like(self._x), np.zeros_like(self._x[:, 0])
        weights = self._weights * self._h[:, None]
        periods, near, far = self._interaction.images
        images = (self._x, density, weights, self._doublet, periods, np.vstack([near, far.T]))

        def fill(k: int) -> None:
            fiber, shape = self._fibers[k], self._shapes[k]
            own = fiber.mobility_velocity(shape, density[k])
            half = np.ascontiguousarray(0.5 * (shape.x[:, 1:] + shape.x[:, :-1]).T)
            nodes = np.ascontiguousarray(shape.x.T)
            others = forces.forces_velocity(nodes, self._middle[k], k, *images)
            at_half = forces.forces_velocity(half, self._middle[k], k, *images)
            velocity[k] = own + others.T
            change = np.diff(at_half, axis=0).T / self._h[k]
            change = change + fiber.derivative(own)[:, 1:-1]
            stretching[k, 1:-1] = np.sum(shape.xs[:, 1:-1] * change, axis=0)

        self.workers.for_each(len(self._fibers), fill)
        return velocity, stretching

    def influence(self, out: Array | None = None) -> Array:
        """Return the map from inner tensions to Phi at inner nodes, (target, m, source, m).

        It is written to `out` if given: fresh memory of this size costs as much as filling it.
        """
        count, _, n = self._x.shape
        if out is None:
            out = np.empty((count, n - 2, count, n - 2))
        filled = out
        tensile = self._tensile_matrices()

        def fill(k: int) -> None:
            kernels.tension_influence(
                k,
                self._x,
                self._xs,
                self._h,
                self._doublet,
                self._interaction.images,
                self._interaction.close,
                tensile,
                self._centres,
                self._weights,
                filled[k],
            )

        self.workers.for_each(count, fill)
        return filled

    def fluid(self, points: Points, force: Array, centreline: Array) -> Points:
        """Return what all fibers and images add to (6) at `points` (point, 3) in the fluid.

        Each point sees every fiber at its own nearest image.
        """
        sources = self._sources(force, centreline)
        out = np.empty(points.shape)

        def fill(block: int) -> None:
            rows = slice(block * _BLOCK, (block + 1) * _BLOCK)
            out[rows] = kernels.fluid_velocity(
                points[rows],
                *sources,
            )

        self.workers.for_each(-(-len(points) // _BLOCK), fill)
        return out

    def fluid_loaded(self, points: Points, density: Array) -> Points:
        """Return what a force per length g (fiber, 3, node) adds to the fluid at `points`."""
        weights = self._weights * self._h[:, None]
        periods, near, far = self._interaction.images
        shifts = np.vstack([near, far.T])
        rows = [
            forces.forces_velocity(
                p[None], p, -1, self._x, density, weights, self._doublet, periods, shifts
            )
            for p in points
        ]
        return np.concatenate(rows)

    def _tensile_matrices(self) -> Array:
        """Return the map from tensions to `centreline_value`, (fiber, 3, node, node)."""
        count, _, n = self._x.shape
        out = np.empty((count, 3, n, n))

        def fill(k: int) -> None:
            out[k] = -self._fibers[k].tensile_matrix(self._shapes[k])

        self.workers.for_each(count, fill)
        return out
