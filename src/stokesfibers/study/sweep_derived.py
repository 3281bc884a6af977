"""What follows from the cases of a sweep: what their numbers are in units of, and their strains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import Any

import numpy as np

from stokesfibers.core.variables import NATURAL_UNITS

_RATES = {
    "shear": "rate",
    "oscillatory_shear": "amplitude",
    "extension": "rate",
    "planar_extension": "rate",
}
_STRAIN = {
    "long_name": "strain of half a cycle",
    "units": "1",
    "symbol": r"\gamma",
}


def natural_units(held: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Return what the numbers of all cases are in units of, if that is their L, E and rate."""
    if not all(map(_is_natural, held)):
        return {}
    times = {_unit_of_time(tables.get("flow", {})) for tables in held}
    rate = times.pop() if len(times) == 1 else None
    return NATURAL_UNITS | ({} if rate is None else {"unit_of_time": rate})


def _is_natural(tables: Mapping[str, Any]) -> bool:
    """Return whether a case has fibers of L = 1 and E = 1, and mu_bar in place of the viscosity."""
    held = tables["fiber"]
    kinds = held if isinstance(held, list) else [held]
    ones = (kind.get(key, 1.0) for kind in kinds for key in ("length", "rigidity"))
    return "mu_bar" in tables["fluid"] and all(value == 1.0 for value in ones)


def _unit_of_time(flow: Mapping[str, Any]) -> str | None:
    """Return one of `NATURAL_RATES` if a flow has a rate and that is 1 or -1."""
    name = _RATES.get(flow.get("kind", ""))
    if name is None or abs(rate := flow.get(name, 1.0)) != 1.0:
        return None
    return f"1/{name}" if rate > 0.0 else f"1/|{name}|"


def strains(
    held: Sequence[Mapping[str, Any]], dims: Sequence[str], shape: Sequence[int]
) -> dict[str, Any]:
    """Return the coordinate ``flow_strain``, amplitude / (pi frequency) of oscillating shears.

    Parameters
    ----------
    held
        The tables of the cases.
    dims, shape
        Names and lengths of the sweep's dimensions.

    Returns
    -------
    dict
        The coordinate by its name; empty if a case has another flow, or if the strain does not
        follow from the place along a single dimension.
    """
    flows = [tables.get("flow", {}) for tables in held]
    if any(flow.get("kind") != "oscillatory_shear" for flow in flows):
        return {}
    found = [abs(flow.get("amplitude", 1.0)) / (pi * flow["frequency"]) for flow in flows]
    grid = np.array(found).reshape(shape)
    for k, dim in enumerate(dims):
        along = np.moveaxis(grid, k, 0).reshape(shape[k], -1)
        if np.ptp(along, axis=1).max() == 0.0 and np.ptp(along) > 0.0:
            return {"flow_strain": ((dim,), along[:, 0], dict(_STRAIN))}
    return {}
