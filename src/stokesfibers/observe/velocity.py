"""The fluid's velocity at any points, at one moment of a run: (5) plus the background flow."""

from __future__ import annotations

from stokesfibers.core.arrays import Points, as_float
from stokesfibers.core.errors import InputError
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.field import disturbance


def fluid_velocity(problem: Problem, snapshot: Snapshot, points: Points) -> Points:
    """Return U at `points` of shape (..., 3), in units of length / time; NaN inside a fiber.

    Parameters
    ----------
    problem
        Gives the background flow and the viscosity.
    snapshot
        Shapes and tensions at one time.
    points
        Where.

    Raises
    ------
    InputError
        If `points` has no last axis of three.
    """
    points = as_float(points)
    if points.shape[-1:] != (3,):
        raise InputError("points", "an array of shape (..., 3)", f"shape {points.shape}")
    flat = points.reshape(-1, 3)
    velocity = problem.flow.velocity(flat, snapshot.time)
    for fiber, shape, tension in zip(
        snapshot.fibers, snapshot.shapes, snapshot.tension, strict=True
    ):
        force = fiber.elastic_force(shape, tension)
        velocity = velocity + disturbance(fiber, shape, force, flat) / problem.drag
    return velocity.reshape(points.shape)
