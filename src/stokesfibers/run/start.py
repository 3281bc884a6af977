"""Where the fibers are at time 0: curves or points, at the engine's nodes, not overlapping."""

from __future__ import annotations

import numpy as np

from stokesfibers.constraint.coupled import TensionError
from stokesfibers.core.arrays import Positions
from stokesfibers.core.errors import InputError
from stokesfibers.domain.neighbours import closest
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.initial import given
from stokesfibers.problem.problem import Problem
from stokesfibers.stepping.base import AbstractStepper, C

Initial = Curve | tuple[Curve, ...] | np.ndarray


def initial_curves(initial: Initial, problem: Problem) -> tuple[Curve, ...]:
    """Return one curve per fiber.

    Raises
    ------
    InputError
        If there is not one curve per fiber.
    """
    if isinstance(initial, np.ndarray):
        initial = given(initial, problem.fibers, where="initial")
    curves = initial if isinstance(initial, tuple) else (initial,)
    if len(curves) != len(problem.fibers):
        raise InputError("initial", f"{len(problem.fibers)} curves, one per fiber", len(curves))
    return curves


def nodal_positions(initial: Initial, problem: Problem) -> Positions:
    """Return the initial positions at equally spaced points, (fiber, node, space).

    They are the nodes where the engine's are equally spaced.

    Raises
    ------
    InputError
        If there is not one curve per fiber, or if two fibers overlap.
    """
    sigma = np.linspace(0.0, 1.0, problem.engine.samples)
    curves = initial_curves(initial, problem)
    positions = np.stack([curve.at_fractions(sigma) for curve in curves])
    _refuse_overlap(positions, problem)
    return positions


def first_carry(stepper: AbstractStepper[C], initial: Initial) -> C:
    """Return the carry at time 0.

    Raises
    ------
    InputError
        For unusable shapes, or if no tensions can be found for them.
    """
    nodal_positions(initial, stepper.problem)
    try:
        return stepper.start(initial_curves(initial, stepper.problem))
    except TensionError as fault:
        raise InputError(
            "initial",
            "shapes whose tensions can be found",
            str(fault),
            "Set constraint.solver = 'krylov' or a larger constraint.tolerance.",
        ) from None


def _refuse_overlap(positions: Positions, problem: Problem) -> None:
    radii = np.stack(
        [
            2.0 * f.eps * f.length * np.sqrt(sigma * (1.0 - sigma))
            for f in problem.fibers
            for sigma in [np.linspace(0.0, 1.0, positions.shape[1])]
        ]
    )
    found = closest(positions, radii, problem.domain_at(0.0))
    if found.gap > 0.0:
        return
    one, other = sorted(found.fibers)
    raise InputError(
        "initial",
        "fibers whose surfaces do not overlap",
        f"fibers {one} and {other} at a centreline distance of {found.distance:.3g}",
        "Move them apart, or place them with kind = 'suspension' and a least_gap.",
    )
