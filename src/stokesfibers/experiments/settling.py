"""A flexible fiber falls until its shape is steady: the runs of `sedimentation`.

Length, rigidity and 8 pi mu are 1; the weight per length has the mean B, the elasto-gravitational
number: total weight times L^2 / E. The fiber falls towards negative y.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stokesfibers.core.arrays import Array, Positions
from stokesfibers.fiber import curves
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import NoFlow
from stokesfibers.numerics.step_control import AdaptiveSteps
from stokesfibers.slender.mobility import AbstractMobility
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.stepping.spectral import SpectralStepper
from stokesfibers.stepping.spectral_carry import State

STEADY = 1e-5
"""Largest velocity relative to the mean one, over it, at which a shape counts as steady."""
_POINTS = 201
_BETWEEN_LOOKS = 10
_MOST_STEPS = 30_000
_MANY_BENDS = 500.0  # B above which the bend needs more nodes

Weight = Callable[[Array], Array]
"""Weight per length over its mean, at fractions of the length."""


def uniform(sigma: Array) -> Array:
    """Return the same weight everywhere."""
    return np.ones_like(sigma)


def cross_section(sigma: Array) -> Array:
    """Return a weight like the cross-section of r(s) = 2 eps sqrt(s (L - s)): one material."""
    return 6.0 * sigma * (1.0 - sigma)


@dataclass(frozen=True)
class Settled:
    """A steady shape.

    Attributes
    ----------
    shape
        In the plane, centred, (2, point), equally spaced in arclength.
    curvature
        The largest.
    velocity
        Over that of a straight fiber across the force.
    angle
        Of the line between the ends to the horizontal, radians.
    fallen
        Distance fallen meanwhile, in lengths.
    error
        Estimated error of the shape through lack of nodes.
    """

    shape: Array
    curvature: float
    velocity: float
    angle: float
    fallen: float
    error: float

    @property
    def curve(self) -> Curve:
        """The shape as a start for another fall."""
        x, y = self.shape
        return curves.through_points(np.stack([x, y, 0.0 * x], axis=-1))

    @property
    def sag(self) -> float:
        """How far the middle hangs below the ends."""
        y = self.shape[1]
        return float(0.5 * (y[0] + y[-1]) - y[y.size // 2])

    @property
    def span(self) -> float:
        """Distance between the ends."""
        return float(np.hypot(*(self.shape[:, -1] - self.shape[:, 0])))


def slightly_bent(angle: float = 0.0) -> Curve:
    """Return a curve that sags by 4 % of its length, its chord at `angle` to the horizontal."""
    return curves.nearly_straight(Fiber(slenderness=1e-2), angle=angle, amplitude=-10.0)


def settled(
    number: float,
    mobility: AbstractMobility,
    eps: float,
    *,
    weight: Weight = cross_section,
    start: Curve | None = None,
) -> Settled:
    """Return the shape that a fiber falls with in the end.

    Parameters
    ----------
    number
        B.
    mobility, eps
        Model and slenderness.
    weight
        How the weight is distributed.
    start
        Shape at the start; by default a slight bend, ends up.

    Raises
    ------
    RuntimeError
        If the shape is not steady after many steps.
    """
    nodes = 32 if number < _MANY_BENDS else 64
    fiber = SpectralFiber.build(1.0, eps, rigidity=1.0, nodes=nodes, mobility=mobility)
    force = np.zeros((1, nodes, 3))
    force[0, :, 1] = -number * weight(fiber.sigma)

    def load(points: Positions, t: float) -> Positions:  # noqa: ARG001
        return force

    stepper = SpectralStepper(
        (fiber,),
        drag=1.0,
        flow=NoFlow(),
        control=AdaptiveSteps(1e-4),
        load=load,
        threads=1,
    )
    carry = stepper.init(((start or slightly_bent()).at_fractions,))
    high = carry.modes[0, 0, 1, 0]
    for _ in range(_MOST_STEPS // _BETWEEN_LOOKS):
        for _ in range(_BETWEEN_LOOKS):
            carry, _ = stepper.step(carry)
        state = State(carry.modes[:, 0], carry.tensions[:, 0])
        moving = stepper.velocity(state, carry.time)[0]
        mean = moving @ fiber.quadrature
        if np.abs(moving - mean[:, None]).max() < STEADY * np.linalg.norm(mean):
            fallen = float(high - carry.modes[0, 0, 1, 0])
            return _shape(fiber, state.modes[0], -mean[1] / (fiber.local.a * number), fallen)
    raise RuntimeError(f"B = {number:g}: not steady after {_MOST_STEPS} steps")


def _shape(fiber: SpectralFiber, modes: Array, velocity: float, fallen: float) -> Settled:
    s = np.linspace(0.0, 1.0, _POINTS)
    x = fiber.position(modes, s)[:2]
    chord = x[:, -1] - x[:, 0]
    return Settled(
        shape=x - modes[:2, :1],
        curvature=float(np.linalg.norm(fiber.position(modes, s, 2), axis=0).max()),
        velocity=float(velocity),
        angle=float(np.arctan2(chord[1], chord[0])),
        fallen=fallen,
        error=float(fiber.resolution(modes).error),
    )
