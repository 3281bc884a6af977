"""A ball of straight filaments, and what theory says of the velocity that it starts to fall with.

With independent middles uniform in a ball of radius R and directions uniform on the sphere, the
force F of each filament spread evenly along it, and 8 pi mu = 1, filament i falls with

    U_i = own velocity + sum over others of the mean of S(x_i - x_j) F,

and the mean of S is ``(4/3) <1/r> I``, since r points anywhere. The spectrum of 1/r is 4 pi / k^2:

    <1/r> = (2/pi) int_0^inf [3 j_1(kR) / (kR)]^2 [Si(kL/2) / (kL/2)]^2 dk,

the brackets being the transforms of ball and filament. For point forces, L = 0, it is 6 / (5 R): a
cloud of N falls with N F / (5 pi mu R), which is Hadamard's and Rybczynski's drop of the fluid's
own viscosity under the same force (Nitsche & Batchelor 1997).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.special import sici, spherical_jn

from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError
from stokesfibers.fiber import curves
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.initial import AbstractInitial
from stokesfibers.fiber.orientation import Isotropic
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.fiber.placement import Box, place_randomly

_SPARE = 1.5  # tries in the cube around the ball, of which the ball is pi / 6, per filament wanted
_K_MOST, _K_NODES, _RULE = 400.0, 400, 8


@dataclass(frozen=True)
class Ball(AbstractInitial):
    """Straight filaments with their middles at random in a ball about the origin.

    Attributes
    ----------
    radius
        Of the ball, in units of length.
    seed
        Of the places and directions.
    least_gap
        Between surfaces.
    """

    radius: float
    seed: int = 1
    least_gap: float = 0.05
    kind: ClassVar[str] = "ball"

    def placed(self, fibers: tuple[Fiber, ...]) -> tuple[Points, Points]:
        """Return middles and unit vectors, (fiber, 3) each."""
        count = int(np.ceil(_SPARE * 6.0 / np.pi * len(fibers))) + 10
        side = 2.0 * self.radius
        box = Box(np.full(3, -self.radius), np.full(3, side), np.zeros(3))
        middles, units = place_randomly(
            (replace(fibers[0], count=1),) * count,
            box,
            orientation=Isotropic(),
            least_gap=self.least_gap,
            seed=self.seed,
        )
        inside = np.flatnonzero(np.linalg.norm(middles, axis=1) <= self.radius)[: len(fibers)]
        if len(inside) < len(fibers):
            raise InputError("radius", "a ball with room for all filaments", self.radius)
        return middles[inside], units[inside]

    def points(self, fibers: tuple[Fiber, ...], count: int) -> Array:
        """Return `count` equally spaced points of each filament, (fiber, point, 3)."""
        middles, units = self.placed(fibers)
        along = np.linspace(-0.5, 0.5, count)[:, None] * fibers[0].length
        return middles[:, None] + along * units[:, None]

    def curves(self, fibers: tuple[Fiber, ...], periods: Array) -> tuple[Curve, ...]:  # noqa: ARG002
        middles, units = self.placed(fibers)
        return tuple(
            curves.segment(fiber, centre=middle, direction=unit)
            for fiber, middle, unit in zip(fibers, middles, units, strict=True)
        )


def mean_inverse_distance(radius: float, length: float) -> float:
    """Return <1/r> between points of two filaments in a ball of `radius`, see above."""
    z, w = np.polynomial.legendre.leggauss(_RULE)
    edges = np.linspace(0.0, _K_MOST / radius, _K_NODES + 1)
    half = 0.5 * np.diff(edges)[:, None]
    k = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * z).ravel()
    ball = 3.0 * spherical_jn(1, k * radius) / (k * radius)
    arm = 0.5 * k * length
    filament = sici(arm)[0] / arm if length > 0.0 else np.ones_like(k)
    return float(2.0 / np.pi * ((ball * filament) ** 2 @ (half * w).ravel()))


def swarm_velocity(count: int, force: float, *, radius: float, length: float) -> float:
    """Return what the others add to a filament's velocity on average, times 8 pi mu."""
    return (count - 1) * force * 4.0 / 3.0 * mean_inverse_distance(radius, length)
