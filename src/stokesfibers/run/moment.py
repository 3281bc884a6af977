"""A carry as observables see it."""

from __future__ import annotations

from math import pi

from stokesfibers.observe.snapshot import Snapshot, Surroundings
from stokesfibers.problem.problem import Problem
from stokesfibers.stepping.base import AbstractStepper, C


def surroundings(problem: Problem, t: float) -> Surroundings:
    """Return domain, external force, flow and viscosity of a problem at time t."""
    viscosity = problem.drag / (8.0 * pi)
    return Surroundings(problem.domain_at(t), problem.load, problem.flow, viscosity)


def snapshot(stepper: AbstractStepper[C], carry: C, t: float | None = None) -> Snapshot:
    """Return shapes and tensions of `carry`, or at a time of its last step, with surroundings."""
    view = stepper.view(carry, stepper.time(carry) if t is None else t)
    return Snapshot.of(view, surroundings(stepper.problem, view.time))
