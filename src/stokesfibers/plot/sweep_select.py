"""What of a sweep's dataset is asked for: a variable, parameters that stay, a divisor."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import did_you_mean
from stokesfibers.plot.sweep_along import Along, along, kind_of, labels_along

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


def _meant(name: str, names: list[str]) -> str:
    """Return the one of `names` that `name` means, or `name`.

    These are ``smallest_gap_largest`` for ``largest_smallest_gap``, and for ``smallest_gap`` if
    only one number was collected of it.
    """
    taken, _, quantity = name.partition("_")
    turned = f"{quantity}_{taken}" if taken in _TAKEN else name
    numbers = [f"{name}_{one}" for one in _TAKEN if f"{name}_{one}" in names]
    found = [one for one in (name, turned) if one in names]
    return [*found, *(numbers if len(numbers) == 1 else ()), name][0]


def checked(data: xr.Dataset, name: str | None) -> str:
    """Return the name of a variable that can be drawn, by default the first collected one.

    Raises
    ------
    InputError
        If it cannot, or no case is done that could give one.
    """
    names = drawable(data)
    if name is not None:
        name = _meant(name, names)
    if name is None and (not names or names[0] in _OWN):
        got = f"none of {data['status'].size} done"
        raise InputError("name", "a sweep with a case that is done, and numbers collected", got)
    if name is not None and name not in names:
        hint = did_you_mean(name, names)
        if name in data and np.issubdtype(data[name].dtype, np.number):
            parts = sorted({*map(str, data[name].dims)} - {*map(str, data["status"].dims), *SERIES})
            one = ", ".join(f"{dim} = {_components(data, dim)[-1]}" for dim in parts)
            hint = f"It has components: stay at one, such as {one}."
        raise InputError("name", f"one of {', '.join(names)}", repr(name), hint)
    return name or names[0]


def chosen(
    data: xr.Dataset, name: str | None, at: Mapping[str, Any]
) -> tuple[str, dict[str, int], tuple[str, ...]]:
    """Return the `checked` variable, where its fiber or components in `at` are, and what these are.

    Raises
    ------
    InputError
        If it cannot be drawn, or has no such fiber or component.
    """
    places, held = {}, []
    for dim in [one for one in at if one in data.dims and not _is_swept(data, one)]:
        there, value = _components(data, dim), _bare(str(at[dim]))
        if value not in there:
            raise InputError("at", f"{dim} to be one of {_listed(there)}", repr(value))
        places[dim] = there.index(value)
        held.append(f"{dim} {value}" if dim == "fiber" else value)
    name = checked(data.isel(places), name)
    for dim in places:
        if dim not in data[name].dims:
            raise InputError("at", f"a swept parameter, {name} having no {dim}", repr(dim))
    return name, places, tuple(held)


def _is_swept(data: xr.Dataset, dim: str) -> bool:
    return dim in (*data["status"].dims, *SERIES)


def _components(data: xr.Dataset, dim: str) -> list[str]:
    """Return the names of components, or numbers of fibers from 0."""
    named = dim in data.coords and data[dim].dtype.kind not in "iuf"
    return (
        [str(one) for one in data[dim].to_numpy()]
        if named
        else list(map(str, range(data.sizes[dim])))
    )


def _listed(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 4 else f"{names[0]} to {names[-1]}"


def stay(
    data: xr.Dataset, swept: list[str], at: Mapping[str, Any]
) -> tuple[xr.Dataset, tuple[str, ...]]:
    """Return the dataset at the values asked for, the nearest of each, and what these are.

    Raises
    ------
    InputError
        If a name or value is none of the sweep, or does not tell one place of its dimension.
    """
    asked: dict[str, dict[str, Any]] = {}
    for name, value in at.items():
        asked.setdefault(dimension(data, name, swept, "at"), {})[name] = value
    held = []
    for dim, wanted in asked.items():
        there = {name: _direction(data, dim, name) for name in wanted}
        fits = [_nearest(there[name], name, value) for name, value in wanted.items()]
        places = np.flatnonzero(np.logical_and.reduce(fits))
        if len(places) != 1:
            said = ", ".join(f"{name} = {value}" for name, value in wanted.items())
            along_it = ", ".join(str(c.name) for c in data.coords.values() if c.dims == (dim,))
            got = f"{said}, which fits {len(places) or 'no'} values of {dim}"
            raise InputError("at", f"values of one case, by {along_it}", got)
        place = int(places[0])
        data = data.isel({dim: place})
        held += [one.said(place) for one in there.values()]
    return data, tuple(held)


def left_of(data: xr.Dataset, at: Mapping[str, Any]) -> list[int]:
    """Return the numbers of the cases, from 0 in the order of the grid, that `at` leaves."""
    status = data["status"]
    swept = [str(d) for d in status.dims]
    numbers = np.arange(status.size).reshape(status.shape)
    wanted = {name: value for name, value in at.items() if name not in data.dims or name in swept}
    left, _ = stay(data.assign(case=(swept, numbers)), swept, wanted)
    return left["case"].to_numpy().ravel().tolist()


def _direction(data: xr.Dataset, dim: str, name: str) -> Along:
    """Return the values along a dimension by the name of one of its coordinates."""
    names = [str(c.name) for c in labels_along(data, dim, name)]
    if name not in names and len(names) > 1:
        raise InputError("at", f"one of {', '.join(names)}", repr(name))
    return along(data, dim, name)


def dimension(data: xr.Dataset, name: str, dims: list[str], where: str) -> str:
    """Return the dimension of that name, or along which the coordinate of that name runs.

    Along an axis (`where` is ``"x"``) a coordinate may depend on several; it is drawn along the
    longest of these, and other lines have other places.
    """
    if name in dims:
        return name
    own = [d for d in dims if d not in SERIES]
    known = {
        str(c): sorted(map(str, held.dims), key=lambda d: -held.sizes[d])
        for c, held in data.coords.items()
        if {*held.dims} <= {*own} and (held.ndim == 1 or (held.ndim and where == "x"))
    }
    if name in known:
        return known[name][0]
    names = own + [c for c in known if c not in own]
    if where == "at":
        names += sorted({*map(str, data.dims)} - {*names, *SERIES})
    hint = did_you_mean(name, names)
    raise InputError(where, f"a swept parameter: {', '.join(names)}", repr(name), hint)


def _nearest(there: Along, name: str, value: Any) -> NDArray[np.bool_]:
    """Return where the value is, or what is nearest to it."""
    numbers = there.numbers
    if numbers is None:
        text = _bare(str(value).lower() if isinstance(value, bool) else str(value))
        whole = [text in map(_bare, said) for said in zip(there.values, there.texts, strict=True)]
        found = whole if any(whole) else [text == kind_of(str(one)) for one in there.values]
        if not any(found):
            raise InputError("at", f"{name} to be one of {', '.join(there.texts)}", repr(value))
        return np.array(found)
    try:
        away = np.abs(numbers - float(value))
        return away == np.nanmin(away)
    except (TypeError, ValueError):
        raise InputError("at", f"a number for {name}", repr(value)) from None


def _bare(text: str) -> str:
    """Return a text without spaces and brackets: lists may be typed as ``2,2,1``."""
    return re.sub(r"[\s\[\]]", "", text)


def divisor(data: xr.Dataset, per: str, swept: list[str]) -> xr.DataArray:
    """Return the numbers of a swept parameter that values are to be divided by."""
    dim = dimension(data, per, swept, "per")
    held = data[per] if per in data.coords else data[dim]
    if not np.issubdtype(held.dtype, np.number) or not bool((held != 0).all()):
        raise InputError("per", "a parameter that is a number and not zero", repr(per))
    return held
