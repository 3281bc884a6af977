"""What of a sweep's dataset is asked for: a variable, parameters that stay, a divisor."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import did_you_mean
from stokesfibers.plot.sweep_along import Along, along

if TYPE_CHECKING:
    import xarray as xr

SERIES = ("time", "record")
"""Dimensions of series: of common times, or of each case's own."""
_OWN = ("time_reached", "wall_time")
_TAKEN = ("largest", "smallest", "final", "mean")
_OF_MEANS = ("_mean_error", "_mean_settled")


def drawable(data: xr.Dataset) -> list[str]:
    """Return the names of the variables that can be drawn, the likeliest first."""
    plain = {*map(str, data["status"].dims), "fiber", *SERIES}
    numeric = [
        str(name)
        for name, held in data.data_vars.items()
        if np.issubdtype(held.dtype, np.number)
        and not str(name).endswith(_OF_MEANS)
        and name not in SERIES
        and {*map(str, held.dims)} <= plain
    ]
    asked = _asked(data)
    place = {name: k for k, name in enumerate(asked)}
    return sorted(numeric, key=lambda n: (_late(data, n), place.get(n, len(asked))))


def collected(data: xr.Dataset) -> list[str]:
    """Return the names of what was collected and is one number for each case, or each fiber."""
    return [name for name in drawable(data) if not any(_late(data, name))]


def _late(data: xr.Dataset, name: str) -> tuple[bool, bool, bool]:
    return name in _OWN, name.endswith("_time"), bool({*SERIES} & {*data[name].dims})


def _asked(data: xr.Dataset) -> list[str]:
    """Return the names of what the sweep file asked for, in its order."""
    lists = json.loads(data.attrs.get("collect", "{}"))
    return [
        name if key == "series" else f"{name}_{key}"
        for key, names in lists.items()
        if isinstance(names, list)
        for name in names
    ]


def _turned(name: str | None) -> str | None:
    """Return ``smallest_gap_largest`` for ``largest_smallest_gap``; other names as they are."""
    taken, _, quantity = (name or "").partition("_")
    return f"{quantity}_{taken}" if taken in _TAKEN and quantity else name


def checked(data: xr.Dataset, name: str | None) -> str:
    """Return the name of a variable that can be drawn, by default the first collected one.

    Raises
    ------
    InputError
        If it cannot, or no case is done that could give one.
    """
    names = drawable(data)
    if name not in names:
        name = _turned(name)
    if name is None and (not names or names[0] in _OWN):
        got = f"none of {data['status'].size} done"
        raise InputError("name", "a sweep with a case that is done, and numbers collected", got)
    if name is not None and name not in names:
        hint = did_you_mean(name, names)
        if name in data and np.issubdtype(data[name].dtype, np.number):
            parts = ", ".join(
                map(str, {*map(str, data[name].dims)} - {*map(str, data["status"].dims)})
            )
            hint = f"It has components ({parts}): draw one in Python."
        raise InputError("name", f"one of {', '.join(names)}", repr(name), hint)
    return name or names[0]


def stay(
    data: xr.Dataset, swept: list[str], at: Mapping[str, Any]
) -> tuple[xr.Dataset, tuple[str, ...]]:
    """Return the dataset at the values asked for, the nearest of each, and what these are."""
    held = []
    for name, value in at.items():
        dim = dimension(data, name, swept, "at")
        there = along(data, dim)
        if name != dim:
            there = replace(there, values=tuple(data[name].to_numpy().tolist()), symbol=name)
        place = _nearest(there, name, value)
        data = data.isel({dim: place})
        held.append(there.said(place))
    return data, tuple(held)


def dimension(data: xr.Dataset, name: str, dims: list[str], where: str) -> str:
    """Return the dimension of that name, or along which the coordinate of that name runs."""
    if name in dims:
        return name
    if name in data.coords and data[name].ndim == 1 and str(data[name].dims[0]) in dims:
        return str(data[name].dims[0])
    names = [d for d in dims if d not in SERIES]
    hint = did_you_mean(name, names)
    raise InputError(where, f"a swept parameter: {', '.join(names)}", repr(name), hint)


def _nearest(there: Along, name: str, value: Any) -> int:
    numbers = there.numbers
    if numbers is None:
        text = str(value).lower() if isinstance(value, bool) else str(value)
        if text not in there.values:
            raise InputError("at", f"{name} to be one of {', '.join(there.texts)}", repr(value))
        return there.values.index(text)
    try:
        return int(np.nanargmin(np.abs(numbers - float(value))))
    except (TypeError, ValueError):
        raise InputError("at", f"a number for {name}", repr(value)) from None


def divisor(data: xr.Dataset, per: str, swept: list[str]) -> xr.DataArray:
    """Return the numbers of a swept parameter that values are to be divided by."""
    dim = dimension(data, per, swept, "per")
    held = data[per] if per in data.coords else data[dim]
    if not np.issubdtype(held.dtype, np.number) or not bool((held != 0).all()):
        raise InputError("per", "a parameter that is a number and not zero", repr(per))
    return held
