"""What follows from the cases of a sweep: what their numbers are in units of, and their strains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stokesfibers.core.variables import NATURAL_UNITS
from stokesfibers.flow import FLOWS, Extension, OscillatoryShear, PlanarExtension, Shear
from stokesfibers.flow.period import strain_of_half_a_cycle

_RATES = {
    Shear.kind: "rate",
    OscillatoryShear.kind: "amplitude",
    Extension.kind: "rate",
    PlanarExtension.kind: "rate",
}
_STRAIN = {
    "long_name": "strain of half a cycle",
    "units": "1",
    "symbol": r"\gamma",
    "derived": "amplitude / (pi frequency)",
}
"""A coordinate with the attribute ``derived`` is drawn along only where it is named."""


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
    kind = flow.get("kind", "")
    if kind not in _RATES:
        return None
    name = _RATES[kind]
    rate = flow.get(name, getattr(FLOWS[kind], name))
    if abs(rate) != 1.0:
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
    found = [strain_of_half_a_cycle(tables.get("flow", {})) for tables in held]
    if None in found:
        return {}
    grid = np.array(found, dtype=np.float64).reshape(shape)
    for k, dim in enumerate(dims):
        along = np.moveaxis(grid, k, 0).reshape(shape[k], -1)
        if np.ptp(along, axis=1).max() == 0.0 and np.ptp(along) > 0.0:
            return {"flow_strain": ((dim,), along[:, 0], dict(_STRAIN))}
    return {}
