"""What a figure of a sweep shows: one variable, cut to its axis, its lines and its panels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.plot import sweep_notes as notes
from stokesfibers.plot.sweep_along import Along, Floats, along, label_of
from stokesfibers.plot.sweep_select import SERIES, chosen, dimension, divisor, stay
from stokesfibers.plot.sweep_units import (
    bracketed,
    in_natural_units,
    natural_scales,
    naturally,
    quotient,
)

if TYPE_CHECKING:
    import xarray as xr

_SEED = "seed"


@dataclass(frozen=True)
class Cut:
    """A variable as it is drawn.

    Attributes
    ----------
    label
        Of the vertical axis.
    x
        The horizontal axis.
    lines, panels
        The second and the third parameter, if there are.
    places, values, errors, doubtful : (panel, line, x)
        Where along the axis, what is drawn, with standard errors where there are, and which
        results are doubtful.
    series
        Whether x is the time.
    held
        The parameters that stay at a value, as ``symbol = value``.
    notes
        What a reader of the figure should know, in sentences.
    """

    label: str
    x: Along
    lines: Along | None
    panels: Along | None
    places: Floats
    values: Floats
    errors: Floats | None
    doubtful: NDArray[np.bool_]
    series: bool
    held: tuple[str, ...]
    notes: tuple[str, ...]

    def derived(self, data: xr.Dataset) -> list[str]:
        """Return what coordinates of `data` that it is drawn along follow from, in sentences."""
        named = [one.parameter for one in (self.x, self.lines, self.panels) if one is not None]
        held = [data[name] for name in named if name in data.coords]
        return [f"{c.name} is {c.attrs['derived']}" for c in held if "derived" in c.attrs]


def cut(
    data: xr.Dataset,
    name: str | None,
    *,
    x: str | None = None,
    at: Mapping[str, Any] | None = None,
    per: str | None = None,
    by: str | None = None,
) -> Cut:
    """Return what `stokesfibers.plot.sweep` draws; parameters and errors are the same."""
    name, places, parts = chosen(data, name, at or {})
    data = data.isel(places)
    at = {one: value for one, value in (at or {}).items() if one not in places}
    swept = [str(d) for d in data["status"].dims]
    below = None if per is None else divisor(data, per, swept)
    _, held = stay(in_natural_units(data), swept, at)
    data, _ = stay(data, swept, at)
    swept = [d for d in swept if d in data.dims]
    along_x, x = x, None if x is None else dimension(data, x, [*swept, *SERIES], "x")
    taken = _taken(data, name, below)
    taken.found.attrs = naturally(taken.found.attrs, natural_scales(data))
    data = in_natural_units(data)
    series = [d for d in SERIES if d in taken.found.dims]
    time = data["time"] if series else None
    if _SEED in swept and x != _SEED and (len(swept) > 1 or series):
        time = None if time is None else _common(time)
        taken = taken.over(_SEED)
        swept.remove(_SEED)
    axis = _axis(data, swept, x, series)
    found, order = taken.found, _order(taken.found, swept, axis)
    places = time if time is not None else _places(data, axis, along_x)
    values, doubtful = _grid(found, found, order), _grid(taken.doubt, found, order).astype(bool)
    if not np.isfinite(values).any():
        raise InputError("name", "a variable with a known value", f"{name}, of which none is known")
    named = None if by is None else _named(data, by, order)
    panels, lines = (
        None if dim is None else along(data, dim, by if dim == named else None) for dim in order[:2]
    )
    there, share = _grid(places, found, order), _share_of_run(data, name, found, order)
    said = [*notes.at_an_end(data, name)]
    plain = time is None and along(data, axis, along_x).numbers is not None
    if share is not None and plain:
        said += notes.jumps(share, there, values, (along(data, axis, along_x), lines, panels))
    said += [*notes.alike_ones(values, name), *notes.doubtful_ones(values, doubtful, bool(series))]
    return Cut(
        label=label_of(found, name),
        x=_time_axis(time) if time is not None else along(data, axis, along_x),
        lines=lines,
        panels=panels,
        places=there,
        values=values,
        errors=None if taken.error is None else _grid(taken.error, found, order),
        doubtful=doubtful,
        series=time is not None,
        held=(*parts, *held),
        notes=tuple(said),
    )


def _named(data: xr.Dataset, by: str, order: tuple[str | None, str | None, str]) -> str:
    """Return the dimension of the lines or panels that are named by a coordinate."""
    left = [d for d in order[:2] if d]
    if by in data.coords and data[by].dims == (order[2],):
        told = f"{by!r}, which runs along the axis"
        raise InputError("by", "a coordinate of lines or panels", told, f"Take x = '{by}'.")
    if not left:
        raise InputError("by", "a figure with several lines or panels", "one with one line")
    return dimension(data, by, left, "by")


def _share_of_run(
    data: xr.Dataset,
    name: str,
    found: xr.DataArray,
    order: tuple[str | None, str | None, str],
) -> Floats | None:
    """Return when in its run each value was taken, 0 to 1 (panel, line, x); None of means."""
    when = data.get(f"{name}_time")
    if (
        when is None
        or "time_reached" not in data
        or any(n > 1 for dim, n in when.sizes.items() if dim not in order)
    ):
        return None
    return _grid(when / data["time_reached"], found, order)


@dataclass(frozen=True)
class _Taken:
    """A variable on its way into a figure: values, standard errors, and which are doubtful."""

    found: xr.DataArray
    error: xr.DataArray | None
    doubt: xr.DataArray

    def over(self, dim: str) -> _Taken:
        """Return the mean along `dim`; that of seeds has an error, and a doubt if one is missing.

        Fibers of one suspension are not independent, so that their mean has no error.
        """
        found, error, doubt = self.found, None, self.doubt
        if dim not in found.dims:
            return self
        mean, missing = found.mean(dim, keep_attrs=True), found.isnull()
        if found.sizes[dim] > 1:
            said = str(found.attrs.get("long_name", found.name))
            join = " and" if ", mean " in said else ", mean over"
            mean.attrs["long_name"] = f"{said}{join} {dim}s"
        if dim == _SEED:
            doubt = doubt | (missing & mean.notnull())
            error = found.std(dim, ddof=1) / np.sqrt(found.notnull().sum(dim))
            error = error if found.sizes[dim] > 1 else self.error
        return _Taken(mean, error, doubt.any(dim) if dim in doubt.dims else doubt)


def _taken(data: xr.Dataset, name: str, over: xr.DataArray | None) -> _Taken:
    """Return the variable, the mean over fibers if there are, over the divisor if there is one."""
    found, doubt = data[name].copy(deep=False), (data["doubt"] != "") & (data["status"] == "done")
    error = data.get(f"{name}_error") if name.endswith("_mean") else None
    settled = data.get(f"{name}_settled")
    if settled is not None:
        unsettled = settled == 0.0
        doubt = doubt | (unsettled.any("fiber") if "fiber" in unsettled.dims else unsettled)
    if over is not None:
        attrs = dict(found.attrs)
        below = over.attrs.get("symbol", rf"\mathrm{{{over.name}}}".replace("_", " "))
        if attrs.get("symbol"):
            attrs["symbol"] = f"{bracketed(attrs['symbol'])} / {below}"
        else:
            attrs["long_name"] = f"{attrs.get('long_name', name)} / {over.name}"
        if "units" in attrs:
            attrs["units"] = quotient(attrs["units"], over.attrs.get("units", "1"))
        found = (found / over).assign_attrs(attrs).rename(name)
        error = None if error is None else error / abs(over)
    return _Taken(found, error, doubt).over("fiber")


def _time_axis(time: xr.DataArray) -> Along:
    return Along(
        str(time.dims[-1]), "time", tuple(time.to_numpy().ravel()), "$t$", label_of(time, "time")
    )


def _places(data: xr.Dataset, dim: str, name: str | None) -> xr.DataArray:
    """Return where values lie along a swept dimension: at its numbers, or one after another."""
    import xarray as xr

    if name in data.coords and data[name].ndim > 1:
        return data[name]
    numbers = along(data, dim, name).numbers
    return xr.DataArray(
        np.arange(data.sizes[dim], dtype=float) if numbers is None else numbers, dims=dim
    )


def _order(found: xr.DataArray, swept: list[str], axis: str) -> tuple[str | None, str | None, str]:
    """Return the dimensions of panels and lines, of which the larger is that of lines, and axis."""
    rest = [d for d in swept if d != axis and found.sizes[d] > 1]
    rest.sort(key=lambda d: -found.sizes[d])
    if len(rest) > 2:
        more = f"Stay at a value of one of {', '.join(rest)}."
        raise InputError("at", "three parameters at most", f"{len(rest) + 1}", more)
    lines, panels = (rest[k] if len(rest) > k else None for k in range(2))
    return panels, lines, axis


def _grid(
    held: xr.DataArray, found: xr.DataArray, order: tuple[str | None, str | None, str]
) -> NDArray[Any]:
    """Return the values of `held` (panel, line, x), repeated along what it does not depend on."""
    dims = [d for d in order if d is not None]
    held = held.isel({d: 0 for d in held.dims if d not in dims})
    lacking = {d: found.sizes[d] for d in dims if d not in held.dims}
    whole = held.drop_vars(held.coords).expand_dims(lacking).transpose(*dims).to_numpy()
    return whole.reshape([1] * (3 - len(dims)) + list(whole.shape))


def _common(time: xr.DataArray) -> xr.DataArray:
    """Return the times that all seeds share; InputError if they do not."""
    if _SEED not in time.dims:
        return time
    low, high = time.min(_SEED), time.max(_SEED)
    if bool((high - low > 1e-9 * abs(high)).any()):
        raise InputError(
            "at", "a seed, such as seed = 0", "none", "The seeds were recorded at different times."
        )
    return high.assign_attrs(time.attrs)


def _axis(data: xr.Dataset, swept: list[str], x: str | None, series: list[str]) -> str:
    """Return the dimension along the horizontal axis."""
    if series:
        if x not in (None, *series):
            raise InputError("x", "time, since the variable is a series", repr(x))
        return series[0]
    if not swept:
        raise InputError("at", "a parameter to draw along", "a single case")
    if x in SERIES:
        raise InputError("x", f"a swept parameter: {', '.join(swept)}", repr(x))
    return x or max(swept, key=lambda d: (along(data, d).numbers is not None, data.sizes[d]))
