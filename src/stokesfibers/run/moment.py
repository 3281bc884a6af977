"""A carry as observables see it."""

from __future__ import annotations

from math import pi

from stokesfibers.observe.snapshot import Snapshot, Surroundings
from stokesfibers.problem.problem import Problem
from stokesfibers.stepping.paper import Carry, PaperStepper


def surroundings(problem: Problem) -> Surroundings:
    """Return domain, external force, flow and viscosity of a problem."""
    return Surroundings(problem.domain, problem.load, problem.flow, problem.drag / (8.0 * pi))


def snapshot(stepper: PaperStepper, carry: Carry) -> Snapshot:
    """Return shapes and tensions of `carry` with what surrounds them."""
    return Snapshot.take(
        stepper.time(carry.step),
        stepper.fibers,
        carry.positions,
        carry.tension,
        surroundings=surroundings(stepper.problem),
    )
