"""The fluid's velocity at any points, at one moment of a run: (5) plus the background flow.

A single fiber in free space is integrated to the surface. With several fibers or images the sums
of the paper's engine are used: (17), (18), far images by moments, and the blend to the centreline's
own velocity within 2 d_0. Fibers of the high-order engine are interpolated to its grid; for the
exact sum over images stand 100 of them on each side. Where the case asks for the Ewald sum it is
used, on modes (`observe.fast_velocity`).
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from stokesfibers.core.arrays import Nodal, Points, as_float
from stokesfibers.core.errors import InputError
from stokesfibers.core.parallel import Workers
from stokesfibers.observe.fast_velocity import fast_disturbance
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.problem.discretised import discrete_fibers
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.field import disturbance
from stokesfibers.slender.sampled import Shape
from stokesfibers.slender.suspension import Interaction, Scene
from stokesfibers.summation import AbstractImageSum, ExactImages, FastImages, ImageSum

_REACH = 100  # of the far images that stand for the exact sum; the rest is of its square


def fluid_velocity(
    problem: Problem, snapshot: Snapshot, points: Points, *, threads: int | None = None
) -> Points:
    """Return U at `points` of shape (..., 3), in units of length / time.

    Parameters
    ----------
    problem
        Gives the background flow, the viscosity and the domain.
    snapshot
        Shapes and tensions at one time.
    points
        Where. Inside a single fiber in free space the velocity is NaN.
    threads
        Threads to use, None for all cores.

    Raises
    ------
    InputError
        If `points` has no last axis of three.
    """
    points = as_float(points)
    if points.shape[-1:] != (3,):
        raise InputError("points", "an array of shape (..., 3)", f"shape {points.shape}")
    flat = np.ascontiguousarray(points.reshape(-1, 3))
    workers = Workers(threads)
    if isinstance(problem.image_sum, FastImages):
        added = -fast_disturbance(problem, snapshot, flat, workers)
    else:
        added = _plain_disturbance(problem, snapshot, flat, workers)
    velocity = problem.flow.velocity(flat, snapshot.time) + added / problem.drag
    return velocity.reshape(points.shape)


def _plain_disturbance(
    problem: Problem, snapshot: Snapshot, points: Points, workers: Workers
) -> Points:
    """Return 8 pi mu times what fibers add at `points` (point, 3), all pairs summed."""
    fibers, shapes, tension = _on_uniform_grids(problem, snapshot)
    interaction = Interaction.build(
        fibers,
        problem.domain,
        image_sum=_listed_images(problem),
        close_approach=problem.close_approach,
    )
    uniform = Snapshot(snapshot.time, fibers, shapes, tension, snapshot.surroundings)
    density = problem.load.density(uniform.loaded).transpose(0, 2, 1)
    if interaction.alone:
        fiber, shape = fibers[0], shapes[0]
        return disturbance(
            fiber, shape, fiber.elastic_force(shape, tension[0]) - density[0], points
        )
    scene = Scene(interaction, shapes, workers)
    centreline = scene.centreline_value(tension)
    added = -scene.fluid(points, scene.integrated_force(tension), centreline)
    if density.any():
        added += scene.fluid_loaded(points, np.ascontiguousarray(density))
    return added


def _listed_images(problem: Problem) -> AbstractImageSum:
    """Return the problem's image sum, or for the exact one the paper's about the centre of mass."""
    if isinstance(problem.image_sum, ExactImages):
        return ImageSum(reach=_REACH, about="centre_of_mass")
    return problem.image_sum


def _on_uniform_grids(
    problem: Problem, snapshot: Snapshot
) -> tuple[tuple[DiscreteFiber, ...], tuple[Shape, ...], Nodal]:
    """Return fibers, shapes and tensions on the paper's grid; interpolated if on another."""
    own = tuple(f for f in snapshot.fibers if isinstance(f, DiscreteFiber))
    if len(own) == len(snapshot.fibers):
        return own, snapshot.shapes, snapshot.tension
    fibers = discrete_fibers(problem, len(snapshot.fibers[0].grid.nodes) - 1)
    shapes, tension = [], []
    sampled = zip(snapshot.fibers, snapshot.shapes, snapshot.tension, strict=True)
    for discrete, (fiber, shape, pull) in zip(fibers, sampled, strict=True):
        parts = (getattr(shape, f.name) for f in fields(Shape))
        moved = (fiber.grid.interpolate(part.T, discrete.nodes).T for part in parts)
        shapes.append(Shape(*(np.ascontiguousarray(part) for part in moved)))
        tension.append(fiber.grid.interpolate(pull, discrete.nodes))
    return fibers, tuple(shapes), np.stack(tension)
