"""A one-second test that the solver works on this machine: an exact answer."""

from __future__ import annotations

from math import pi, sin

import numpy as np

from stokesfibers.fiber.curves import straight
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.simulate import nodal_positions, reproducible
from stokesfibers.slender.mobility import NonLocal, slenderness_constant
from stokesfibers.slender.regularization import NoRegularization
from stokesfibers.stepping.paper import PaperStepper

TOLERANCE = 1e-9
_ANGLE = 0.75 * pi  # most compressed
_MU_BAR = 4e5


def tension_error() -> float:
    """Return the relative error of the tension of a straight fiber in shear against (44).

    The unregularised solution is T = -(mu_bar / 8) sin(2 theta) / (c + 2) s (1 - s): quadratic in
    s, so that the discrete tension equation must give it to rounding.
    """
    fiber = Fiber(slenderness=1e-3)
    problem = Problem(
        fiber,
        mu_bar=_MU_BAR,
        flow=Shear(1.0),
        mobility=NonLocal(NoRegularization()),
        engine=PaperEngine(intervals=40),
    )
    with reproducible():
        stepper = PaperStepper(problem)
        carry = stepper.init(nodal_positions(straight(fiber, angle=_ANGLE), problem))
    s = stepper.fibers[0].nodes
    c = slenderness_constant(fiber.eps)
    exact = -_MU_BAR / 8.0 * sin(2.0 * _ANGLE) / (c + 2.0) * s * (1.0 - s)
    return float(np.max(np.abs(carry.tension[0] - exact)) / np.max(np.abs(exact)))
