"""A filament whose own turns near each other: the error of its own velocity, Lambda f + K f.

The filament is coiled once, with a slope that sets how near the turns come. Its finite-part
operator integrates over its own nodes and has no rule for the approach. The error is the change
against many more nodes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments.close_pair_curves import Filament
from stokesfibers.experiments.contact_rules import SpectralSource
from stokesfibers.experiments.contact_scenes import smooth_force

EPS = 1e-3
NODES = (24, 32, 48, 64)
_MANY = 128
_TURN = 180.0  # 6 radians
_APART = 0.4  # arclength from which on a part is another turn
_POINTS = np.linspace(0.01, 0.99, 99)


def own_errors(slopes: Sequence[float]) -> xr.Dataset:
    """Return the least distance of the turns by slope, and errors by nodes and slope."""
    distance = np.zeros(len(slopes))
    error = np.zeros((len(NODES), len(slopes)))
    for k, slope in enumerate(slopes):
        coil = _coil(slope)
        distance[k] = _least_distance(coil)
        exact = _velocity(coil, _MANY)
        for j, nodes in enumerate(NODES):
            off = np.abs(_velocity(coil, nodes) - exact).max()
            error[j, k] = off / np.abs(exact).max()
    return xr.Dataset(
        {"own_distance": (("slope",), distance), "own_error": (("own_nodes", "slope"), error)},
        coords={"own_nodes": list(NODES), "slope": list(slopes)},
    )


def _coil(slope: float) -> Filament:
    rise = np.polynomial.Polynomial([0.0, 0.0, 0.0, 1.0 / 3.0, -1.0 / 2.0, 1.0 / 5.0])
    return Filament.build(lambda s: _TURN * rise(s), lambda s: np.full_like(s, slope), 0.5, 0.0)


def _least_distance(coil: Filament) -> float:
    s = np.linspace(0.0, 1.0, 801)
    x = coil.sample(s).x
    apart = np.linalg.norm(x[:, :, None] - x[:, None], axis=0)
    return float(apart[np.abs(s[:, None] - s) > _APART].min())


def _velocity(coil: Filament, nodes: int) -> Array:
    source = SpectralSource.of(coil, eps=EPS, nodes=nodes)
    force = np.ascontiguousarray(smooth_force(source.fiber.sigma))
    return source.fiber.between_nodes(
        source.fiber.mobility_velocity(source.modes, force)[0], _POINTS
    )
