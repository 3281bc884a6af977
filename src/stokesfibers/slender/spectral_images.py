"""Far periodic images of fibers in Legendre modes: all of them, or the paper's approximation (42).

Both give the velocities by images |p| >= 2 about the nearest one, in the sense of
`slender.spectral_suspension`; the nearer images are summed there.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.domain import AbstractDomain
from stokesfibers.kernels import spectral_images as kernels
from stokesfibers.numerics.legendre import gauss_legendre, legendre_values
from stokesfibers.summation.images import AbstractImageSum
from stokesfibers.summation.periodic_kernel import ExactImages, ReplacedImages

_MOST_STORED = 2**25  # numbers in the image blocks of a scene that are kept between applications
_LEAST_COARSE = 4
_SHAPE_SHARE = 10.0


@dataclass(frozen=True)
class FarSources:
    """The fibers at one moment, as far images see them.

    Attributes
    ----------
    x
        Positions at the nodes, (fiber, 3, N).
    series
        Their Legendre coefficients, (fiber, 3, N + 4).
    lengths
        L, (fiber,).
    doublets
        (eps L)^2 / 2, (fiber,).
    """

    x: Array
    series: Array
    lengths: Array
    doublets: Array


class AbstractFarScene(abc.ABC):
    """The far images of the fibers at one moment."""

    @abc.abstractmethod
    def prepare(self, targets: Array, own: int, shift: Array) -> Any:
        """Return what does not depend on the forces.

        Parameters
        ----------
        targets
            (3, point): the nodes of fiber `own`, or points in the fluid with own = -1.
        own
            The fiber that the targets are on.
        shift
            Lattice vectors that bring the targets to each source, (fiber, 3).
        """

    @abc.abstractmethod
    def forces(self, weighted: Array) -> Any:
        """Return what depends on force times quadrature weight at the nodes, (fiber, 3, N)."""

    @abc.abstractmethod
    def velocity(self, prepared: Any, forces: Any) -> Array:
        """Return 8 pi mu times minus the velocity at the targets, (3, point)."""


class AbstractFarImages(abc.ABC):
    """A way to sum over far images."""

    @abc.abstractmethod
    def scene(self, sources: FarSources) -> AbstractFarScene:
        """Return the far images of `sources`."""


@dataclass(frozen=True)
class ExactFarImages(AbstractFarImages):
    """All images |p| >= 2, on coarse nodes of targets and sources.

    Attributes
    ----------
    images
        What stands for them.
    tolerance
        Error of the velocities, relative to those near the fibers.
    """

    images: ReplacedImages
    tolerance: float

    def scene(self, sources: FarSources) -> AbstractFarScene:
        count = sources.x.shape[2]
        longest = float(sources.lengths.max())
        # The nearest image is 1.5 periods off, less half a fiber.
        away = 3.0 * self.images.period / longest - 1.0
        rho = away + np.sqrt(away**2 - 1.0)
        straight = int(np.ceil(-np.log(self.tolerance) / np.log(rho)))
        # What the coarse nodes do not resolve of the shapes moves far images, which matters less.
        sizes = np.linalg.norm(sources.series, axis=1)
        tail = np.cumsum(sizes[:, ::-1], axis=1)[:, ::-1].max(axis=0)
        allowed = _SHAPE_SHARE * self.tolerance * self.images.period
        bent = int(np.argmax(tail <= allowed)) if tail[-1] <= allowed else count
        coarse = min(max(straight, bent, _LEAST_COARSE), count)
        return _ExactFarScene(self.images, sources, coarse)


@lru_cache(maxsize=64)
def _coarse_tables(coarse: int, count: int) -> tuple[Array, Array]:
    """Return Legendre polynomials at coarse nodes, and Lagrange's of these at the nodes."""
    sigma, _ = gauss_legendre(coarse)
    lagrange = np.linalg.inv(legendre_values(sigma, coarse))
    at_nodes = legendre_values(gauss_legendre(count)[0], coarse) @ lagrange
    return legendre_values(sigma, count + 4), np.ascontiguousarray(at_nodes.T)


class _ExactFarScene(AbstractFarScene):
    def __init__(self, images: ReplacedImages, sources: FarSources, coarse: int) -> None:
        self._images = images
        self._doublets = sources.doublets
        polynomials, self._table = _coarse_tables(coarse, sources.x.shape[2])
        self._coarse = np.matmul(sources.series, polynomials.T)
        self._stored = 6 * self._coarse[:, 0].size ** 2 <= _MOST_STORED

    def prepare(self, targets: Array, own: int, shift: Array) -> Any:
        places = targets if own < 0 else self._coarse[own]
        block = self._block(places, shift) if self._stored else None
        return places, own, shift, block

    def forces(self, weighted: Array) -> Any:
        return np.matmul(weighted, self._table.T)

    def velocity(self, prepared: Any, forces: Any) -> Array:
        places, own, shift, block = prepared
        if block is None:
            block = self._block(places, shift)
        found = kernels.block_velocity(block, forces)
        return found if own < 0 else found @ self._table

    def _block(self, places: Array, shift: Array) -> Array:
        return kernels.image_block(
            places, shift, self._coarse, self._doublets, self._images.arguments
        )


@dataclass(frozen=True)
class MomentFarImages(AbstractFarImages):
    """The far images of `ImageSum`, through moments.

    Attributes
    ----------
    shifts
        Of the images, (3, image).
    about_centre
        Whether moments are about the centre of mass instead of the mid-point.
    """

    shifts: Array
    about_centre: bool

    def scene(self, sources: FarSources) -> AbstractFarScene:
        return _MomentFarScene(self, sources)


class _MomentFarScene(AbstractFarScene):
    def __init__(self, images: MomentFarImages, sources: FarSources) -> None:
        self._shifts = images.shifts
        centres = sources.series[:, :, 0]
        if not images.about_centre:
            centres = sources.series @ legendre_values(np.array(0.5), sources.series.shape[2])
        self._centres = np.ascontiguousarray(centres)
        self._arms = sources.x - self._centres[:, :, None]

    def prepare(self, targets: Array, own: int, shift: Array) -> Any:  # noqa: ARG002
        return targets, shift

    def forces(self, weighted: Array) -> Any:
        # S of (41) by parts: F vanishes at the ends
        moments = -np.einsum("kan,kbn->kab", self._arms, weighted)
        return moments, np.ascontiguousarray(weighted.sum(axis=2))

    def velocity(self, prepared: Any, forces: Any) -> Array:
        targets, shift = prepared
        moments, net = forces
        return kernels.moment_velocity(targets, shift, self._centres, moments, net, self._shifts)


def images_of(
    image_sum: AbstractImageSum, domain: AbstractDomain, tolerance: float
) -> tuple[Array, AbstractFarImages | None]:
    """Return the shifts of the images to sum directly, (image, 3), and the sum over the others.

    There may be no others. `tolerance` is relative to the velocities near the fibers.
    """
    if isinstance(image_sum, ExactImages):
        images = image_sum.replaced(domain, tolerance)
        return image_sum.near(domain), images and ExactFarImages(images, tolerance)
    _, near, far = image_sum.shifts(domain)
    about_centre = image_sum.about == "centre_of_mass"
    return near, MomentFarImages(far, about_centre) if far.size else None
