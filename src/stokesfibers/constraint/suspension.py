"""The coupled line-tension equations (26), (27) of all fibers, assembled once per moment."""

from __future__ import annotations

import numpy as np

from stokesfibers.constraint.coupled import AbstractTensionSolver, CoupledSystem
from stokesfibers.constraint.line_tension import tension_system
from stokesfibers.core.arrays import Array, Nodal
from stokesfibers.core.parallel import Workers
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.sampled import Shape
from stokesfibers.slender.suspension import Scene


def own_systems(
    fibers: tuple[DiscreteFiber, ...],
    shapes: tuple[Shape, ...],
    stretching: Array,
    *,
    drag: float,
    beta: float,
    workers: Workers,
) -> tuple[Array, Array]:
    """Return the single-fiber systems (22) of all fibers, (fiber, m, m) and (fiber, m)."""
    count, m = len(fibers), fibers[0].grid.intervals - 1
    matrices, right = np.empty((count, m, m)), np.empty((count, m))

    def fill(k: int) -> None:
        matrices[k], right[k] = tension_system(
            fibers[k], shapes[k], stretching[k], drag=drag, beta=beta
        )

    workers.for_each(count, fill)
    return matrices, right


def solve_coupled(
    scene: Scene,
    own: Array,
    right: Array,
    *,
    start: Nodal,
    solver: AbstractTensionSolver,
    buffer: Array | None = None,
) -> tuple[Nodal, int]:
    """Return the tensions (fiber, node) of (27) and the number of iterations.

    Parameters
    ----------
    scene
        The fibers as sources.
    own, right
        The single-fiber systems of `own_systems`.
    start
        First guess, (fiber, node).
    solver
        How to solve.
    buffer
        Memory for the influence of tensions, (fiber, m, fiber, m); overwritten.
    """
    bending = scene.stretching(scene.integrated_force(None), scene.bending_value)
    influence = scene.influence(buffer)
    system = CoupledSystem(own, influence, right - bending[:, 1:-1], scene.workers)
    tension = np.zeros_like(start)
    tension[:, 1:-1], iterations = solver.solve(system, start[:, 1:-1])
    return tension, iterations
