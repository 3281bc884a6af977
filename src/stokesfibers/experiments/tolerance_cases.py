"""The cases of `tolerance`: one or two fibers, in flows and under weight.

A case is a problem but for its engine, an initial shape per fiber and an end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import pi

import numpy as np

from stokesfibers.core.arrays import Array, Points
from stokesfibers.domain import AbstractDomain, Free, Periodic
from stokesfibers.fiber.curves import Curve, nearly_straight, scaled
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import (
    AbstractFlow,
    Extension,
    NoFlow,
    OscillatoryShear,
    PlanarExtension,
    Shear,
)
from stokesfibers.load import AbstractLoad, Gravity, NoLoad
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.mobility import AbstractMobility, LocalDrag, NonLocal
from stokesfibers.slender.regularization import ConstantRegularization, PaperRegularization

Start = Callable[[Fiber], Curve]


@dataclass(frozen=True)
class ToleranceCase:
    """One case.

    Attributes
    ----------
    name
        What it is, short.
    mu_bar
        Effective viscosity (10), at rate 1.
    eps
        Slenderness.
    flow
        Background flow, of rate 1 if there is one.
    starts
        Initial centreline of each fiber, for a fiber of unit length.
    until
        End.
    mobility
        Model of the drag.
    load
        External force.
    domain
        Free or periodic space.
    """

    name: str
    mu_bar: float
    eps: float
    flow: AbstractFlow
    starts: tuple[Start, ...]
    until: float
    mobility: AbstractMobility = field(default_factory=NonLocal)
    load: AbstractLoad = field(default_factory=NoLoad)
    domain: AbstractDomain = field(default_factory=Free)

    def problem(self, rtol: float) -> Problem:
        """Return the problem at a tolerance; nodes are chosen by the engine."""
        return Problem(
            Fiber(length=1.0, slenderness=self.eps, rigidity=1.0, count=len(self.starts)),
            mu_bar=self.mu_bar,
            flow=self.flow,
            mobility=self.mobility,
            load=self.load,
            domain=self.domain,
            engine=SpectralEngine(rtol=rtol),
        )

    def curves(self) -> tuple[Curve, ...]:
        """Return the initial centreline of each fiber."""
        fibers = self.problem(1e-3).fibers
        return tuple(start(fiber) for start, fiber in zip(self.starts, fibers, strict=True))


def planar(angle: float, amplitude: float) -> Start:
    """Return the start (47): in the (x, y) plane."""
    return lambda fiber: nearly_straight(fiber, angle=angle, amplitude=amplitude)


def spatial(angle: float, bend: float, skew: float) -> Start:
    """Return a start that leaves the plane: deflections `bend` in y and `skew` in z."""
    along = np.array([np.cos(angle), np.sin(angle), 0.0])

    def position(alpha: Array) -> Points:
        u = alpha - 0.5
        bump = 256.0 * (alpha * (1.0 - alpha)) ** 4
        out = np.zeros_like(u)
        return u[:, None] * along + np.stack([out, bend * bump, 4.0 * skew * u * bump], axis=-1)

    def tangent(alpha: Array) -> Points:
        u, inside = alpha - 0.5, alpha * (1.0 - alpha)
        bump, slope = 256.0 * inside**4, -2048.0 * inside**3 * u
        rates = [0.0 * u, bend * slope, 4.0 * skew * (bump + u * slope)]
        return along + np.stack(rates, axis=-1)

    return lambda fiber: scaled(Curve(position, tangent), fiber)


def moved(start: Start, by: tuple[float, float, float]) -> Start:
    """Return `start` shifted by a vector."""

    def shifted(fiber: Fiber) -> Curve:
        curve = start(fiber)
        return Curve(lambda alpha: curve.position(alpha) + np.array(by), curve.tangent)

    return shifted


def _and(
    first: tuple[Start], second: Start, apart: tuple[float, float, float]
) -> tuple[Start, ...]:
    """Return the starts of two fibers, the second `apart` from where it is drawn."""
    return first[0], moved(second, apart)


def _weight(size: float) -> Gravity:
    return Gravity((0.0, -size, 0.0))


_SHEAR, _PLANAR = Shear(rate=1.0), PlanarExtension(rate=1.0)
_WAVE = OscillatoryShear(amplitude=1.0, frequency=1.0 / 25.6)
_THICK = 10.0**-1.5
# In shear these starts are vertical at t = 9.7; in extension they lie near the compressed axis.
_TURNING, _BENT = (planar(pi - 0.1024, -1e-3),), (spatial(pi - 0.1024, 0.01, 0.01),)
_SQUEEZED, _TWISTED = (planar(0.5 * pi - 0.02, 1e-2),), (spatial(0.5 * pi - 0.02, 1e-3, 1e-3),)
_TILTED = (spatial(0.7 * pi, 0.01, -0.01),)
_FALLING, _UPRIGHT = (spatial(0.3, 0.1, 0.05),), (spatial(0.8 * pi, 0.02, 0.01),)
_SIDE = _and(_FALLING, spatial(-0.4, 0.05, 0.1), (0.3, 0.1, 0.2))
_CROSSED = _and(_BENT, spatial(pi - 0.6, -0.01, 0.02), (0.1, 0.0, 0.15))
_PAIR = _and(_TURNING, spatial(pi - 0.1024, 0.01, 0.0), (0.2, 0.0, 0.1))
_SQUEEZED_PAIR = _and(_TWISTED, planar(0.5 * pi + 0.1, 5e-3), (0.15, 0.1, 0.1))
_PASSING = _and(_TILTED, spatial(0.2 * pi, 0.02, 0.01), (0.1, 0.3, 0.1))
CASES = (
    ToleranceCase("shear", 1e3, 1e-2, _SHEAR, _BENT, 16.0),
    ToleranceCase("shear", 1e4, _THICK, _SHEAR, _TURNING, 16.0),
    ToleranceCase("shear", 3e4, 1e-4, _SHEAR, _BENT, 16.0),
    ToleranceCase("shear", 1e5, 1e-3, _SHEAR, _TURNING, 16.0),
    ToleranceCase("shear, Fig. 4", 4e5, 1e-3, _SHEAR, (nearly_straight,), 61.44),
    ToleranceCase("shear", 4e5, 1e-2, _SHEAR, _BENT, 16.0),
    ToleranceCase("shear", 1e6, 1e-4, _SHEAR, _BENT, 16.0),
    ToleranceCase("shear, (16)", 2e5, 1e-3, _SHEAR, _BENT, 16.0, NonLocal(PaperRegularization())),
    ToleranceCase("shear, local drag", 1e5, 1e-3, _SHEAR, _BENT, 16.0, LocalDrag()),
    ToleranceCase("extension", 1e3, 1e-2, _PLANAR, _SQUEEZED, 5.0),
    ToleranceCase("extension", 1e4, 1e-3, _PLANAR, _TWISTED, 5.0),
    ToleranceCase("extension", 1e5, 1e-4, _PLANAR, _SQUEEZED, 5.0),
    ToleranceCase(
        "extension, const. delta",
        3e4,
        _THICK,
        _PLANAR,
        _TWISTED,
        5.0,
        NonLocal(ConstantRegularization()),
    ),
    ToleranceCase("extension, local drag", 1e4, 1e-2, _PLANAR, _TWISTED, 5.0, LocalDrag()),
    ToleranceCase("uniaxial extension", 3e4, 1e-2, Extension(rate=1.0), _TWISTED, 6.0),
    ToleranceCase("oscillating shear", 1e4, _THICK, _WAVE, _TILTED, 25.6),
    ToleranceCase("oscillating shear", 1.5e5, 1e-2, _WAVE, _TILTED, 25.6),
    ToleranceCase("oscillating shear", 3e5, 1e-4, _WAVE, _TILTED, 25.6),
    ToleranceCase("oscillating shear", 1e6, 1e-3, _WAVE, _TILTED, 25.6),
    ToleranceCase("oscillating shear, local drag", 1e6, 1e-3, _WAVE, _TILTED, 25.6, LocalDrag()),
    ToleranceCase("gravity", 1e4, 1e-2, NoFlow(), _FALLING, 10.0, load=_weight(2e3)),
    ToleranceCase("gravity", 1e5, 1e-3, NoFlow(), _FALLING, 20.0, load=_weight(1e4)),
    ToleranceCase("gravity, shear", 3e5, 1e-2, _SHEAR, _UPRIGHT, 12.0, load=_weight(1e4)),
    ToleranceCase("gravity, 2 fibers", 1e4, _THICK, NoFlow(), _SIDE, 10.0, load=_weight(300.0)),
    ToleranceCase("shear, 2 fibers", 1e5, 1e-2, _SHEAR, _CROSSED, 12.0),
    ToleranceCase("shear, 2 fibers", 1e6, 1e-3, _SHEAR, _PAIR, 12.0),
    ToleranceCase("extension, 2 fibers", 1e4, 1e-2, _PLANAR, _SQUEEZED_PAIR, 5.0),
    ToleranceCase(
        "oscillating shear, 2 fibers",
        1e5,
        1e-2,
        _WAVE,
        _PASSING,
        25.6,
        domain=Periodic((2.0, 0, 0)),
    ),
)
QUICK_CASES = (CASES[0], CASES[3], CASES[9], CASES[15], CASES[20], CASES[24])
