"""What all interactions of fibers in Legendre modes share: the seam, and the close approach.

An interaction holds what does not change; its scene holds the fibers at one moment. Velocities are
times 8 pi mu and carry the sign of (6): a fiber moves with minus the sum over the others.
"""

from __future__ import annotations

import abc
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Self

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import AbstractDomain
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.summation.close_approach import AbstractCloseApproach

_SIZES = np.arange(8, 264, 8)
_EXPONENT = 1.5  # the rule on N nodes errs like rho^(-1.5 N) at least, where N modes are needed
_STRAIGHT = 1e-6  # a curvature times length
_WIDEST = 4.0  # reaches of a straight source within which a bent one may need rows


@dataclass(frozen=True)
class Summed:
    """How a scene is summed.

    Attributes
    ----------
    cutoff
        Distance to which pairs are summed one by one; infinite where all are.
    modes
        Number of Fourier modes for the rest.
    """

    cutoff: float = float("inf")
    modes: int = 0


class AbstractSpectralScene(abc.ABC):
    """The fibers at one moment, as sources of flow."""

    @property
    def summed(self) -> Summed:
        """How this is summed; pair by pair unless a fast sum says otherwise."""
        return Summed()

    @abc.abstractmethod
    def velocity(self, force: Array, resisted: Array) -> Array:
        """Return what all other fibers and images add to (6) at the nodes, (fiber, 3, N).

        Parameters
        ----------
        force
            f at the nodes, (fiber, 3, N).
        resisted
            Lambda f + K f at the nodes: the close approach needs it.

        All ranks must call it together, with the same forces.
        """

    @abc.abstractmethod
    def fluid(self, points: Points, force: Array, resisted: Array) -> Points:
        """Return what all fibers and images add to (6) at `points` (point, 3) in the fluid.

        A rank does it by itself.
        """


class AbstractSpectralInteraction(abc.ABC):
    """How fibers act on each other. All have the same number of nodes.

    Attributes
    ----------
    fibers
        Discretised fibers.
    domain_at
        The domain at a time.
    """

    fibers: tuple[SpectralFiber, ...]
    domain_at: Callable[[float], AbstractDomain]

    @property
    @abc.abstractmethod
    def alone(self) -> bool:
        """True if nothing acts on anything: one fiber without images."""

    @abc.abstractmethod
    def still(self, domain: AbstractDomain) -> Self:
        """Return the interaction in `domain` at all times; it holds no functions."""

    @abc.abstractmethod
    def scene(self, modes: Array, t: float, workers: Workers) -> AbstractSpectralScene:
        """Return the scene of position modes for unit length, (fiber, 3, N), at time t."""


@dataclass(frozen=True)
class CloseSettings:
    """Where and how sources near a target are summed otherwise than over their nodes.

    Attributes
    ----------
    reach
        Distance from each source below which its nodes are not enough, (fiber,).
    rho
        Bernstein ellipse about a source, as [-1, 1], within which a root of |R|^2 must not lie.
    d0
        d_0 of each source, (fiber,).
    smooth
        Whether the blend has two continuous derivatives.
    digits
        Near sources err by exp(-digits), relative.
    """

    reach: Array
    rho: float
    d0: Array
    smooth: bool
    digits: float

    @classmethod
    def of(
        cls,
        fibers: tuple[SpectralFiber, ...],
        close_approach: AbstractCloseApproach,
        tolerance: float,
    ) -> CloseSettings:
        """Return the settings for an error of `tolerance`, relative to velocities near fibers.

        Raises
        ------
        InputError
            If the tolerance is out of range or fibers have different numbers of nodes.
        """
        if not 1e-13 <= checks.positive("tolerance", tolerance) <= 1e-2:
            raise InputError("tolerance", "a number from 1e-13 to 1e-2", tolerance)
        if not fibers or len({f.count for f in fibers}) > 1:
            raise InputError("fibers", "one fiber or more, all with as many nodes", len(fibers))
        lengths = np.array([f.length for f in fibers])
        radius = np.array([f.eps * f.length for f in fibers])
        # no grid spacing here: d_0 is the given one, or 2 eps L
        _, _, d0, smooth = close_approach.settings(np.zeros(len(fibers)), radius)
        nodes = fibers[0].count
        reach = np.maximum(lengths * plain_reach(nodes, tolerance), 2.0 * d0)
        return cls(reach, plain_ellipse(nodes, tolerance), d0, smooth, float(-np.log(tolerance)))

    def around(self, modes: Array, fibers: tuple[SpectralFiber, ...]) -> CloseExtents:
        """Return the settings for shapes with position modes for unit length, (fiber, 3, N)."""
        bends = np.linalg.norm(np.matmul(modes, fibers[0].tables[2].T), axis=1)
        turns = bends @ (fibers[0].quadrature / fibers[0].length)
        tightest = np.maximum(bends.max(axis=1), _STRAIGHT)
        straight = plain_reach(fibers[0].count, float(np.exp(-self.digits)))
        # outside a circle of curvature k, distance d, the roots are log(1 + k d) / k off the source
        wider = np.minimum(np.expm1(tightest * straight) / tightest, _WIDEST * straight)
        lengths = np.array([f.length for f in fibers])
        return CloseExtents(self, np.maximum(self.reach, lengths * wider), modes.shape[2] + turns)


@dataclass(frozen=True)
class CloseExtents:
    """The same for fibers of given shapes: what the kernels take.

    Attributes
    ----------
    settings
        What does not depend on shapes.
    widest
        Distance from each source beyond which its nodes are enough, (fiber,).
    modes
        Oscillations that its force and its shape may hold, (fiber,).
    """

    settings: CloseSettings
    widest: Array
    modes: Array

    @property
    def arguments(self) -> tuple[Array, Array, float, Array, Array, bool, float]:
        """What the kernels take."""
        s = self.settings
        return (s.reach, self.widest, s.rho, self.modes, s.d0, s.smooth, s.digits)


@cache
def quadrature_rules() -> tuple[Array, Array, Any]:
    """Return Gauss-Legendre rules on [-1, 1] of many sizes, padded: nodes, weights, sizes."""
    nodes = np.zeros((_SIZES.size, _SIZES[-1]))
    weights = np.zeros_like(nodes)
    for r, n in enumerate(_SIZES):
        nodes[r, :n], weights[r, :n] = np.polynomial.legendre.leggauss(int(n))
    return nodes, weights, _SIZES


def plain_ellipse(nodes: int, tolerance: float) -> float:
    """Return the Bernstein ellipse from which on the rule on the nodes errs by `tolerance`."""
    return tolerance ** (-1.0 / (_EXPONENT * nodes))


def plain_reach(nodes: int, tolerance: float) -> float:
    """Return the distance, over the length, from which the rule on the nodes errs by `tolerance`.

    A point at distance d from the middle of a straight fiber lies on the Bernstein ellipse with
    ``rho = 2 d + sqrt(4 d^2 + 1)``.
    """
    rho = plain_ellipse(nodes, tolerance)
    return 0.25 * (rho - 1.0 / rho)
