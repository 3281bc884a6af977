"""Dimensionless groups of a case: what decides whether a fiber buckles, and on which scale.

The fiber's buckling is judged with the local drag model (1). A straight fiber compressed along
itself at the rate e carries the tension T = -8 pi mu e (s (L - s)) / (4 |c|), so |T| is at most
8 pi mu e L^2 / (16 |c|); a wave of number k grows with E k^4 - |T| k^2 below zero, fastest at
k^2 = |T| / (2 E).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf, pi, sqrt

import numpy as np

from stokesfibers.core.errors import InputError
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import AbstractFlow
from stokesfibers.load import Gravity
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.mobility import slenderness_constant

BUCKLING_THRESHOLD = 153.20243
"""8 pi mu e L^4 / (|c| E) at which the first mode grows (Becker & Shelley 2001, local drag)."""
_GOLDEN = 0.5 * (sqrt(5.0) - 1.0)
_TIMES = 144


@dataclass(frozen=True)
class Groups:
    """Dimensionless groups of one kind of fiber in a flow.

    Attributes
    ----------
    eps
        Slenderness r(L/2) / L.
    c
        log(eps^2 e) of (3), negative.
    mu_bar
        Effective viscosity (10) at the flow's rate, 8 pi mu rate L^4 / E.
    eta
        mu_bar / |c|, the same with the fiber's own drag.
    compression
        eta with the flow's largest compressive strain rate e in place of its rate, over the value
        at which a straight fiber buckles; above 1 it buckles while it lies in that direction.
    wavelength
        Length of the wave that grows fastest at that compression, over the fiber's length;
        infinite without compression.
    """

    eps: float
    c: float
    mu_bar: float
    eta: float
    compression: float
    wavelength: float


def effective_viscosity(problem: Problem, fiber: Fiber) -> float:
    """Return mu_bar (10) of `fiber` at the flow's rate, 8 pi mu rate L^4 / E."""
    return _drag_over_rigidity(problem, fiber) * problem.flow.rate_scale()


def eta(problem: Problem, fiber: Fiber) -> float:
    """Return mu_bar / |c|, the effective viscosity with the fiber's own drag."""
    return effective_viscosity(problem, fiber) / abs(slenderness_constant(fiber.eps))


def _drag_over_rigidity(problem: Problem, fiber: Fiber) -> float:
    return problem.drag * float(fiber.length) ** 4 / float(fiber.rigidity)


def groups(problem: Problem, fiber: Fiber, until: float) -> Groups:
    """Return the groups of `fiber` in the problem's flow between times 0 and `until`."""
    c = slenderness_constant(fiber.eps)
    rate = compressive_rate(problem.flow, until)
    squeezed = _drag_over_rigidity(problem, fiber) * rate / abs(c)
    return Groups(
        eps=fiber.eps,
        c=c,
        mu_bar=effective_viscosity(problem, fiber),
        eta=eta(problem, fiber),
        compression=squeezed / BUCKLING_THRESHOLD,
        wavelength=2.0 * pi * sqrt(32.0 / squeezed) if squeezed > 0.0 else inf,
    )


@dataclass(frozen=True)
class Crowding:
    """How full the cell of a suspension is.

    Attributes
    ----------
    concentration
        n L^3: the sum of L^3 of all fibers over the volume.
    contacts
        n L^2 d, d the diameter at mid-length: from about 1 on rods touch unless they are ordered.
    volume_fraction
        Volume of the fibers, spheroids of radius r(s), over that of the cell.
    """

    concentration: float
    contacts: float
    volume_fraction: float


def crowding(problem: Problem) -> Crowding | None:
    """Return how full the cell is; None where it has no volume."""
    volume = problem.domain.volume
    if volume == inf:
        return None
    lengths = np.array([fiber.length for fiber in problem.fibers])
    eps = np.array([fiber.eps for fiber in problem.fibers])
    cubes = lengths**3 / volume
    return Crowding(
        concentration=float(cubes.sum()),
        contacts=float(np.sum(2.0 * eps * cubes)),
        volume_fraction=float(np.sum(2.0 * pi / 3.0 * eps**2 * cubes)),
    )


def weight(problem: Problem, fiber: Fiber) -> float | None:
    """Return the elasto-gravitational number g L^3 / E of `fiber`; None without a weight."""
    if not isinstance(problem.load, Gravity):
        return None
    pull = hypot(*problem.load.force)
    return pull * float(fiber.length) ** 3 / float(fiber.rigidity)


def compressive_rate(flow: AbstractFlow, until: float) -> float:
    """Return the largest rate of compression along any direction at the origin, 1/time.

    Times are tried between 0 and `until`; half the flow's rate stands for a flow that cannot be
    evaluated there.
    """
    origin = np.zeros(3)
    largest = 0.0
    try:
        for k in range(_TIMES):
            gradient = flow.gradient(origin, until * ((k * _GOLDEN) % 1.0))
            strain = 0.5 * (gradient + gradient.T)
            largest = max(largest, -float(np.linalg.eigvalsh(strain)[0]))
    except InputError:
        return 0.5 * flow.rate_scale()
    return largest
