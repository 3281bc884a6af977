"""What fibers add to the fluid's velocity at any points, by the fast Ewald sum, (5).

The shapes of a moment are turned into the modes of the high-order engine first, exactly where they
come from it, by splines of order 7 where they are recorded points.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stokesfibers.core.arrays import Array, Points, as_float
from stokesfibers.core.parallel import Workers
from stokesfibers.load import LoadedState
from stokesfibers.numerics.chebyshev import ChebyshevGrid
from stokesfibers.numerics.legendre import gauss_legendre
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.spectral import SpectralFiber, by_kind
from stokesfibers.slender.spectral_ewald import EwaldInteraction
from stokesfibers.summation import FastImages

_SHOWN_PER_NODE = 4  # Chebyshev points of a shape per mode, as the high-order engine shows it
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
    count = _modes(snapshot)
    kinds = by_kind(problem.fibers, count, problem.mobility)
    fibers = tuple(kinds[kind] for kind in problem.fibers)
    modes, force = [], []
    for k, fiber in enumerate(fibers):
        own, tension = _fitted(snapshot, k, fiber)
        modes.append(own)
        force.append(fiber.force(own, tension, fiber.sigma * fiber.length))
    pushed = np.stack(force) - _load(problem, snapshot.time, fibers, modes)
    resisted = [f.mobility_velocity(m, g)[0] for f, m, g in zip(fibers, modes, pushed, strict=True)]
    interaction = EwaldInteraction.build(
        fibers,
        problem.domain_at,
        close_approach=problem.close_approach,
        tolerance=problem.image_sum.tolerance or _TOLERANCE,
    )
    scene = interaction.scene(np.stack(modes), snapshot.time, workers)
    return scene.fluid(points, pushed, np.stack(resisted))


def _load(
    problem: Problem, t: float, fibers: tuple[SpectralFiber, ...], modes: list[Array]
) -> Array:
    """Return the external force per length at the nodes, (fiber, 3, N)."""
    x = [f.position(m, f.sigma * f.length).T for f, m in zip(fibers, modes, strict=True)]
    weights = np.stack([fiber.quadrature for fiber in fibers])
    radii = np.array([fiber.eps * fiber.length for fiber in fibers])
    state = LoadedState(np.stack(x), weights, radii, problem.domain_at(t), t)
    return np.ascontiguousarray(problem.load.density(state).transpose(0, 2, 1))


def _modes(snapshot: Snapshot) -> int:
    grid = snapshot.fibers[0].grid
    points = len(grid.nodes)
    if isinstance(grid, ChebyshevGrid):
        return points // _SHOWN_PER_NODE
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
