"""Growth rates of a straight fiber that a flow compresses along itself: an eigenvalue problem.

Planar extension at unit rate, the fiber (length 1, rigidity 1) on the compressive axis, a small
deflection y in the plane of the flow. About the straight fiber (20) becomes

    mu_bar (y_t - y) = -M (y_ssss - (T y_s)_s) + D[y] T_s,    M' T_s = mu_bar (s - 1/2),

with M and M' the operator Lambda + K_delta across and along the fiber, and T = 0 at the ends. D is
what a tilt of the fiber changes in the velocity across it under a force along it,

    D[y] g = b y_s g + int ((y(s) - y(s')) / u g(s') - y_s g(s)) / sqrt(u^2 + delta^2) ds',

u = s - s'. Moving and turning the fiber as a whole grow at rates 1 and 2 and are left out.
"""

from __future__ import annotations

import numpy as np

from stokesfibers.core.arrays import Array, as_float
from stokesfibers.slender.mobility import AbstractMobility
from stokesfibers.slender.spectral import SpectralFiber

_RIGID = 2  # the first modes: mean position and mean tangent


def linearised(fiber: SpectralFiber) -> tuple[Array, Array]:
    """Return what bending and compression do: modes of y change at (B / mu_bar + C) y.

    Parameters
    ----------
    fiber
        Of unit length and rigidity.

    Returns
    -------
    tuple
        B and C, (N - 2, N - 2), acting on the bending modes; rigid motion follows from them.
    """
    s, local = fiber.sigma, fiber.local
    values, slopes, curvatures, fourth = fiber.tables
    weights, unit = fiber.weights.finite, np.eye(fiber.count)
    across = weights + local.a * unit
    along = 2.0 * weights + (local.a + local.b) * unit
    pull = np.linalg.solve(along, s - 0.5)  # T_s / mu_bar
    modes, *_ = np.linalg.lstsq(fiber.tension_tables[1], pull, rcond=None)
    tension = fiber.tension_tables[0] @ modes
    tensile = tension[:, None] * curvatures + pull[:, None] * slopes
    chords = weights * pull / (s[:, None] - s + unit) * (1.0 - unit)
    tilting = chords.sum(axis=1)[:, None] * values - chords @ values
    tilting += ((weights.diagonal() + local.b) * pull)[:, None] * slopes
    moved = np.linalg.solve(
        values, np.stack([-across @ fourth, values + across @ tensile + tilting])
    )
    return moved[0, _RIGID:, _RIGID:], moved[1, _RIGID:, _RIGID:]


def straight_fiber(mobility: AbstractMobility, eps: float, nodes: int) -> SpectralFiber:
    """Return a fiber of unit length and rigidity for `linearised`."""
    return SpectralFiber.build(1.0, eps, rigidity=1.0, nodes=nodes, mobility=mobility)


def leading(fiber: SpectralFiber, mu_bar: float) -> tuple[float, Array]:
    """Return the largest growth rate, over the rate of extension, and its bending modes (N - 2,).

    Raises
    ------
    ValueError
        If the mode oscillates.
    """
    bending, compressing = linearised(fiber)
    rates, vectors = np.linalg.eig(bending / mu_bar + compressing)
    first = int(np.argmax(np.real(rates)))
    if abs(np.imag(rates[first])) > 1e-9 * abs(rates[first]):
        raise ValueError(f"an oscillating mode, {rates[first]}")
    return float(np.real(rates[first])), as_float(np.real(vectors[:, first]))


def thresholds(fiber: SpectralFiber, count: int = 1) -> Array:
    """Return the lowest `count` mu_bar at which a mode neither grows nor decays, (count,)."""
    bending, compressing = linearised(fiber)
    # -B^-1 C, whose eigenvalues are 1 / mu_bar: the modes that bend least come first
    found = np.linalg.eigvals(np.linalg.solve(bending, -compressing))
    real = as_float(np.real(found[np.abs(np.imag(found)) <= 1e-9 * np.abs(found)]))
    return np.sort(1.0 / real[real > 0.0])[:count]
