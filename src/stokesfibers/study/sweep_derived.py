"""What follows from the cases of a sweep: what numbers are in units of, strains, and eta."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import NATURAL_UNITS
from stokesfibers.flow import FLOWS, Extension, OscillatoryShear, PlanarExtension, Shear
from stokesfibers.flow.period import strain_of_half_a_cycle
from stokesfibers.problem.groups import eta
from stokesfibers.study.sweep_plan import Plan, load_case

_RATES = {
    Shear.kind: "rate",
    OscillatoryShear.kind: "amplitude",
    Extension.kind: "rate",
    PlanarExtension.kind: "rate",
}
_SAID = {
    "flow_strain": {
        "long_name": "strain of half a cycle",
        "units": "1",
        "symbol": r"\gamma",
        "derived": "amplitude / (pi frequency)",
    },
    "eta": {
        "long_name": "effective viscosity",
        "units": "1",
        "symbol": r"\bar\mu / |c|",
        "derived": "mu_bar / abs(c), c = log(eps^2 e)",
    },
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


def derived(
    plan: Plan, dims: Sequence[str], shape: Sequence[int]
) -> dict[str, tuple[tuple[str, ...], NDArray[np.float64], dict[str, str]]]:
    """Return coordinates that follow from the cases, along the dimensions that they depend on.

    These are ``flow_strain``, amplitude / (pi frequency) of oscillating shears, and ``eta``,
    mu_bar / abs(c) of fibers of one kind in a flow with a rate. Each is there if all cases have it,
    and not all the same.

    Parameters
    ----------
    plan
        The sweep.
    dims, shape
        Names and lengths of its dimensions.
    """
    flows = [case.tables.get("flow", {}) for case in plan.cases]
    values = {"flow_strain": [strain_of_half_a_cycle(flow) for flow in flows], "eta": _etas(plan)}
    found = {}
    for name, known in values.items():
        if None in known:
            continue
        grid = np.array(known, dtype=np.float64).reshape(shape)
        own = [k for k in range(len(dims)) if np.ptp(grid, axis=k).any()]
        if own:
            first = grid[tuple(slice(None) if k in own else 0 for k in range(len(dims)))]
            found[name] = (tuple(dims[k] for k in own), first, dict(_SAID[name]))
    return found


def _etas(plan: Plan) -> list[float | None]:
    try:
        held = [load_case(case, Path(plan.folder), allow_python=False) for case in plan.cases]
    except InputError:  # it has a Python file, which is not run to say what follows
        return [None]
    return [
        eta(one.problem, one.problem.kinds[0])
        if len(one.problem.kinds) == 1 and one.problem.flow.rate_scale() > 0.0
        else None
        for one in held
    ]
