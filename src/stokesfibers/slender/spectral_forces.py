"""What each fiber in Legendre modes has at its nodes by itself: positions, forces, velocities."""

from __future__ import annotations

import numpy as np

from stokesfibers.core.arrays import Array, Positions
from stokesfibers.core.parallel import Workers
from stokesfibers.slender.spectral import SpectralFiber


def force_units(fibers: tuple[SpectralFiber, ...]) -> Array:
    """Return E / L^3 of each fiber, (fiber, 1, 1), what forces of the modes are in units of."""
    return np.array([f.rigidity / f.length**3 for f in fibers])[:, None, None]


def node_positions(fibers: tuple[SpectralFiber, ...], modes: Array) -> Positions:
    """Return the positions of the nodes, (fiber, node, space), from modes (fiber, 3, N)."""
    lengths = np.array([f.length for f in fibers])[:, None, None]
    x = lengths * np.matmul(modes, fibers[0].tables[0].T)
    return np.ascontiguousarray(x.transpose(0, 2, 1))


def elastic_forces(fibers: tuple[SpectralFiber, ...], modes: Array, tensions: Array) -> Array:
    """Return -(T x_s)_s + E x_ssss of (9) at the nodes, (fiber, 3, N), in units of E / L^3.

    Parameters
    ----------
    fibers
        All with as many nodes.
    modes, tensions
        Position modes (fiber, 3, N) and tension modes (fiber, N - 1), as in a `State`.
    """
    xs, xss, xssss = (np.matmul(modes, table.T) for table in fibers[0].tables[1:])
    tension, slope = (np.matmul(tensions, table.T) for table in fibers[0].tension_tables)
    return xssss - slope[:, None] * xs - tension[:, None] * xss


def resisted_forces(
    fibers: tuple[SpectralFiber, ...], modes: Array, force: Array, workers: Workers
) -> Array:
    """Return (Lambda + K_delta)[force] of each fiber at its nodes, both (fiber, 3, N)."""
    force = np.ascontiguousarray(force)
    resisted = np.empty_like(force)

    def one(k: int) -> None:
        resisted[k], _ = fibers[k].mobility_velocity(np.ascontiguousarray(modes[k]), force[k])

    workers.for_each(len(fibers), one)
    return resisted
