"""A filament whose own turns near each other: the error of its own velocity, Lambda f + K f.

The filament is coiled once, with a slope that sets how near the turns come. Its finite-part
operator is that of its own nodes, or of more nodes, as runs have it where a filament nears itself.
The error is that of what as many Legendre modes as nodes hold of the velocity. The reference has
many more nodes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments.close_pair_curves import Filament
from stokesfibers.experiments.contact_scenes import smooth_force
from stokesfibers.numerics.legendre import legendre_values
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.spectral import SpectralFiber

EPS = 1e-3
NODES = (24, 32, 48, 64)
WAYS = {"its nodes alone": 1.0, "more nodes": 1e-8}
"""What the operator is evaluated on, and the tolerance that a fiber then has for itself."""
_MANY = 384
_TURN = 180.0  # 6 radians
_APART = 0.4  # arclength from which on a part is another turn
_POINTS = np.linspace(0.01, 0.99, 99)


def own_errors(slopes: Sequence[float]) -> xr.Dataset:
    """Return the least distance of the turns by slope, and errors by way, nodes and slope."""
    distance = np.zeros(len(slopes))
    error = np.zeros((len(WAYS), len(NODES), len(slopes)))
    for k, slope in enumerate(slopes):
        coil = _coil(slope)
        distance[k] = _least_distance(coil)
        exact = _velocity(coil, _MANY, 1.0)
        for j, nodes in enumerate(NODES):
            held = legendre_values(_POINTS, nodes) @ exact[:, :nodes].T
            for i, tolerance in enumerate(WAYS.values()):
                found = legendre_values(_POINTS, nodes) @ _velocity(coil, nodes, tolerance).T
                error[i, j, k] = np.abs(found - held).max() / np.abs(held).max()
    return xr.Dataset(
        {
            "own_distance": (("slope",), distance),
            "own_error": (("own_way", "own_nodes", "slope"), error),
        },
        coords={"own_way": list(WAYS), "own_nodes": list(NODES), "slope": list(slopes)},
    )


def _coil(slope: float) -> Filament:
    rise = np.polynomial.Polynomial([0.0, 0.0, 0.0, 1.0 / 3.0, -1.0 / 2.0, 1.0 / 5.0])
    return Filament.build(lambda s: _TURN * rise(s), lambda s: np.full_like(s, slope), 0.5, 0.0)


def _least_distance(coil: Filament) -> float:
    s = np.linspace(0.0, 1.0, 801)
    x = coil.sample(s).x
    apart = np.linalg.norm(x[:, :, None] - x[:, None], axis=0)
    return float(apart[np.abs(s[:, None] - s) > _APART].min())


def _velocity(coil: Filament, nodes: int, tolerance: float) -> Array:
    """Return the Legendre coefficients of the velocity, (3, N)."""
    fiber = SpectralFiber.build(
        1.0, EPS, rigidity=1.0, nodes=nodes, mobility=NonLocal(), tolerance=tolerance
    )
    modes = fiber.fit(lambda s: coil.sample(s).x.T)
    force = np.ascontiguousarray(smooth_force(fiber.sigma))
    return fiber.mobility_velocity(modes, force)[0] @ fiber.to_legendre.T
