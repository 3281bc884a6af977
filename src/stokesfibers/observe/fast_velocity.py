"""What fibers add to the fluid's velocity at any points, by the fast Ewald sum, (5).

The shapes of a moment are turned into the modes of the high-order engine first, exactly where they
come from it, by splines of order 7 where they are recorded points.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stokesfibers.core.arrays import Array, Points, as_float
from stokesfibers.core.parallel import Workers
from stokesfibers.numerics.chebyshev import ChebyshevGrid
from stokesfibers.numerics.legendre import gauss_legendre
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.problem.discretised import (
    SHOWN_PER_NODE,
    load_density,
    spectral_fibers,
    spectral_interaction,
)
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_forces import (
    elastic_forces,
    force_units,
    node_positions,
    resisted_forces,
)
from stokesfibers.summation import FastImages

_RECORDED_PER_NODE = 3
_LEAST, _MOST = 8, 48  # modes that recorded points are turned into
_ORDER = 7
_TOLERANCE = 1e-6


def fast_disturbance(
    problem: Problem, snapshot: Snapshot, points: Points, workers: Workers
) -> Points:
    """Return 8 pi mu times what fibers add at `points` (point, 3), with the sign of (6).

    The fluid moves with the background flow less this.
    """
    assert isinstance(problem.image_sum, FastImages)
    fibers, t = spectral_fibers(problem, _modes(snapshot)), snapshot.time
    fitted = [_fitted(snapshot, k, fiber) for k, fiber in enumerate(fibers)]
    modes, tensions = (np.stack(part) for part in zip(*fitted, strict=True))
    nodes, weights = node_positions(fibers, modes), np.stack([f.quadrature for f in fibers])
    load = np.ascontiguousarray(load_density(problem, nodes, weights, t).transpose(0, 2, 1))
    force = force_units(fibers) * elastic_forces(fibers, modes, tensions) - load
    resisted = resisted_forces(fibers, modes, force, workers)
    tolerance = problem.image_sum.tolerance or _TOLERANCE
    scene = spectral_interaction(problem, fibers, tolerance).scene(modes, t, workers)
    return scene.fluid(points, force, resisted)


def _modes(snapshot: Snapshot) -> int:
    grid = snapshot.fibers[0].grid
    points = len(grid.nodes)
    if isinstance(grid, ChebyshevGrid):
        return points // SHOWN_PER_NODE
    return 2 * int(np.clip(points // _RECORDED_PER_NODE, _LEAST, _MOST) // 2)


def _fitted(snapshot: Snapshot, k: int, fiber: SpectralFiber) -> tuple[Array, Array]:
    """Return position modes (3, N) and tension modes (N - 1,) of fiber k."""
    grid = snapshot.fibers[k].grid
    position = _between(grid, np.ascontiguousarray(snapshot.shapes[k].x.T), fiber.length)
    sigma, weight = gauss_legendre(2 * fiber.count)
    pull = _between(grid, snapshot.tension[k], fiber.length)(sigma)
    root = np.sqrt(weight)
    table = fiber.basis.tensions(sigma, 0)
    tension = np.linalg.lstsq(root[:, None] * table, root * pull, rcond=None)[0]
    return fiber.fit(position), as_float(tension / fiber.force_unit)


def _between(grid: object, values: Array, length: float) -> Callable[[Array], Array]:
    """Return nodal values (node, ...) as a function of fractions of the length."""
    if isinstance(grid, ChebyshevGrid):
        return lambda sigma: grid.interpolate(values, sigma * length)
    from scipy.interpolate import make_interp_spline  # slow to import

    at = np.linspace(0.0, 1.0, len(values))
    return make_interp_spline(at, values, k=min(_ORDER, len(values) - 1 - len(values) % 2))
