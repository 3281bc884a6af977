"""Many fibers in Legendre modes: what they induce on each other, (6)-(8), with close approach.

`SpectralInteraction` holds what does not change, `SpectralScene` the fibers at one moment.
Velocities are times 8 pi mu and carry the sign of (6): a fiber moves with minus the sum over the
others. All fibers have the same number of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import AbstractDomain
from stokesfibers.kernels import spectral_pairs as kernels
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_images import AbstractFarImages, FarSources, images_of
from stokesfibers.summation.close_approach import AbstractCloseApproach
from stokesfibers.summation.images import AbstractImageSum

_SIZES = np.arange(8, 264, 8)
_EXPONENT = 1.5  # the rule on N nodes errs like rho^(-1.5 N) at least, where N modes are needed


@cache
def _rules() -> tuple[Array, Array, Any]:
    """Return Gauss-Legendre rules on [-1, 1] of all `_SIZES`, padded: nodes, weights, sizes."""
    nodes = np.zeros((_SIZES.size, _SIZES[-1]))
    weights = np.zeros_like(nodes)
    for r, n in enumerate(_SIZES):
        nodes[r, :n], weights[r, :n] = np.polynomial.legendre.leggauss(int(n))
    return nodes, weights, _SIZES


def plain_reach(nodes: int, tolerance: float) -> float:
    """Return the distance, over the length, from which the rule on the nodes errs by `tolerance`.

    A point at distance d from the middle of a straight fiber lies on the Bernstein ellipse with
    ``rho = 2 d + sqrt(4 d^2 + 1)``.
    """
    rho = tolerance ** (-1.0 / (_EXPONENT * nodes))
    return 0.25 * (rho - 1.0 / rho)


@dataclass(frozen=True)
class SpectralInteraction:
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
        (reach, d0, smooth, digits) of `kernels.near_rows`.
    """

    fibers: tuple[SpectralFiber, ...]
    domain: AbstractDomain
    near_shifts: Array
    far: AbstractFarImages | None
    close: tuple[Array, Array, bool, float]

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
        if not 1e-13 <= checks.positive("tolerance", tolerance) <= 1e-2:
            raise InputError("tolerance", "a number from 1e-13 to 1e-2", tolerance)
        if not fibers or len({f.count for f in fibers}) > 1:
            raise InputError("fibers", "one fiber or more, all with as many nodes", len(fibers))
        lengths = np.array([f.length for f in fibers])
        radius = np.array([f.eps * f.length for f in fibers])
        # no grid spacing here: d_0 is the given one, or 2 eps L
        _, _, d0, smooth = close_approach.settings(np.zeros(len(fibers)), radius)
        reach = np.maximum(lengths * plain_reach(fibers[0].count, tolerance), 2.0 * d0)
        close = (reach, d0, smooth, float(-np.log(tolerance)))
        near, far = images_of(image_sum, domain, tolerance)
        return cls(fibers, domain, near, far, close)

    @property
    def alone(self) -> bool:
        """True if nothing acts on anything: one fiber without images."""
        return len(self.fibers) == 1 and len(self.near_shifts) == 1


class SpectralScene:
    """The fibers at one moment, as sources of flow.

    Parameters
    ----------
    interaction
        How they act on each other.
    modes
        Position modes for unit length, (fiber, 3, N).
    workers
        Threads.
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
        self._middles = np.ascontiguousarray(scaled[:, :, 0])
        far = interaction.far
        sources = FarSources(self._x, series, lengths, self._doublets)
        self._far = None if far is None else far.scene(sources)
        self._prepared: list[Any] = [None] * len(fibers)

        def prepare(k: int) -> None:
            self._prepared[k] = self._geometry(self._x[k], k, self._middles[k])

        workers.for_each(len(fibers), prepare)

    def velocity(self, force: Array, resisted: Array) -> Array:
        """Return what all other fibers and images add to (6) at the nodes, (fiber, 3, N).

        Parameters
        ----------
        force
            f at the nodes, (fiber, 3, N).
        resisted
            Lambda f + K f at the nodes: the close approach needs it.
        """
        forces = self._forces(force, resisted)
        out = np.empty_like(self._x)

        def fill(k: int) -> None:
            out[k] = self._others(self._x[k], k, self._prepared[k], forces=forces)

        self._workers.for_each(len(out), fill)
        return out

    def fluid(self, points: Points, force: Array, resisted: Array) -> Points:
        """Return what all fibers and images add to (6) at `points` (point, 3) in the fluid."""
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
            interaction.close,
            _rules(),
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
