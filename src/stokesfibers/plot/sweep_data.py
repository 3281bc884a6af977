"""What a figure of a sweep shows: one variable, cut to its axis, its lines and its panels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import did_you_mean
from stokesfibers.core.variables import Variable
from stokesfibers.plot import select

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]

_OWN = ("time_reached", "wall_time")
_OF_MEANS = ("_mean_error", "_mean_settled")
_SEED = "seed"
_SERIES = ("time", "record")
_SPREAD = 30.0  # largest over smallest positive value from which a scale is logarithmic


@dataclass(frozen=True)
class Along:
    """One direction of a figure: the horizontal axis, the lines or the panels.

    Attributes
    ----------
    name
        Its dimension in the dataset.
    values
        The values along it, numbers or texts.
    symbol
        What to call a value, with dollar signs if it is a formula.
    label
        Meaning, symbol and unit.
    """

    name: str
    values: tuple[Any, ...]
    symbol: str
    label: str

    @property
    def numbers(self) -> Floats | None:
        """The values as numbers; None if they are texts."""
        if any(isinstance(value, str) for value in self.values):
            return None
        return np.array(self.values, dtype=np.float64)

    @property
    def texts(self) -> list[str]:
        """The values as they are written."""
        written = _power if is_log(self.numbers) else select.number_text
        return [v if isinstance(v, str) else written(float(v)) for v in self.values]

    def said(self, k: int) -> str:
        """Return ``symbol = value`` of the value of number `k`."""
        return f"{self.symbol} = {self.texts[k]}"


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
    values, errors, doubtful : (panel, line, x)
        What is drawn, with standard errors where there are, and which results are doubtful.
    series
        Whether x is the time.
    """

    label: str
    x: Along
    lines: Along | None
    panels: Along | None
    values: Floats
    errors: Floats | None
    doubtful: NDArray[np.bool_]
    series: bool


def drawable(data: xr.Dataset) -> list[str]:
    """Return the names of the variables that can be drawn, the likeliest first."""
    numeric = [
        str(name)
        for name, held in data.data_vars.items()
        if np.issubdtype(held.dtype, np.number) and not str(name).endswith(_OF_MEANS)
    ]
    plain = [n for n in numeric if n not in (*_OWN, *_SERIES) and not {"i", "j"} & {*data[n].dims}]
    late = {n: (n.endswith("_time"), bool({*_SERIES} & {*data[n].dims})) for n in plain}
    return [*sorted(plain, key=lambda n: late[n]), *(n for n in _OWN if n in numeric)]


def cut(data: xr.Dataset, name: str | None, *, x: str | None, at: Mapping[str, Any]) -> Cut:
    """Return what `stokesfibers.plot.sweep` draws; parameters and errors are the same."""
    swept = [str(d) for d in data["status"].dims]
    names = drawable(data)
    if not names:
        raise InputError("name", "a dataset that holds numbers", "none", "See [collect].")
    name = names[0] if name is None else name
    if name not in names:
        raise InputError("name", f"one of {', '.join(names)}", name, did_you_mean(name, names))
    data = _stay(data, swept, at)
    swept = [d for d in swept if d in data.dims]
    found, doubt = data[name], (data["doubt"] != "") & (data["status"] == "done")
    error = data.get(f"{name}_error") if name.endswith("_mean") else None
    found, error, doubt = _averaged(found, error, doubt, "fiber")
    if _SEED in swept and x != _SEED and (len(swept) > 1 or {*_SERIES} & {*found.dims}):
        found, error, doubt = _averaged(found, error, doubt, _SEED)
        swept.remove(_SEED)
    own = [str(d) for d in found.dims if d not in swept]
    series = own[:1] if own and own[0] in _SERIES else []
    if own != series:
        raise InputError("name", "numbers, one for each case", f"{name} with {', '.join(own)}")
    axis = _axis(data, swept, x, series)
    rest = [d for d in swept if d != axis and found.sizes[d] > 1]
    rest.sort(key=lambda d: -found.sizes[d])
    if len(rest) > 2:
        more = f"Stay at a value of one of {', '.join(rest)}."
        raise InputError("at", "three parameters at most", f"{len(rest) + 1}", more)
    lines, panels = (rest[k] if len(rest) > k else None for k in range(2))
    order = [d for d in (panels, lines, axis) if d is not None]
    shape = [1] * (3 - len(order)) + [found.sizes[d] for d in order]

    def grid(held: xr.DataArray) -> NDArray[Any]:
        dims = [d for d in order if d in held.dims]
        values = held.isel({d: 0 for d in held.dims if d not in order}).transpose(*dims).to_numpy()
        wide = values if axis in dims or not series else np.repeat(values[..., None], shape[-1], -1)
        return wide.reshape(shape)

    values = grid(found)
    if not np.isfinite(values).any():
        raise InputError("name", "a variable with a known value", f"{name}, of which none is known")
    time = data["time"] if series else None
    return Cut(
        label=_label(found, name),
        x=along(data, axis, time),
        lines=None if lines is None else along(data, lines),
        panels=None if panels is None else along(data, panels),
        values=values,
        errors=None if error is None else grid(error),
        doubtful=grid(doubt).astype(bool),
        series=bool(series),
    )


def is_log(values: Floats | None) -> bool:
    """Return whether values are better seen on a logarithmic scale."""
    known = np.empty(0) if values is None else values[np.isfinite(values)]
    return bool(known.size and known.min() > 0.0 and known.max() > _SPREAD * known.min())


def _power(value: float) -> str:
    """Return a number as a formula with a power of ten."""
    mantissa, power = f"{value:.5e}".split("e")
    plain = mantissa.rstrip("0").rstrip(".")
    factor = "" if plain == "1" else rf"{plain}\times"
    return f"${factor}10^{{{int(power)}}}$"


def along(data: xr.Dataset, dim: str, time: xr.DataArray | None = None) -> Along:
    """Return a direction of the figure; its coordinate may have another name than `dim`."""
    if time is not None and dim in _SERIES:
        held = time.isel({d: 0 for d in time.dims if d != dim})
        return Along(dim, tuple(held.to_numpy().tolist()), "$t$", _label(held, "time"))
    labels = [c for c in data.coords.values() if c.dims == (dim,)]
    named = [c for c in labels if c.name == dim]
    numeric = [c for c in labels if np.issubdtype(c.dtype, np.number)]
    held = (named or numeric or labels or [data[dim]])[0]
    values = tuple(held.to_numpy().tolist())
    symbol = f"${held.attrs['symbol']}$" if held.attrs.get("symbol") else str(held.name)
    return Along(dim, values, symbol, _label(held, str(held.name)))


def _label(held: xr.DataArray, name: str) -> str:
    """Return meaning, symbol and unit; what was taken of a quantity, behind a comma, below."""
    attrs = held.attrs
    meaning, _, taken = str(attrs.get("long_name", name.replace("_", " "))).partition(", ")
    if not attrs.get("symbol"):
        return f"{meaning}\n{taken}".strip()
    variable = Variable(name, "observables", (), attrs.get("units", "1"), attrs["symbol"], meaning)
    return f"{select.axis_label(variable)}\n{taken}".strip()


def _stay(data: xr.Dataset, swept: list[str], at: Mapping[str, Any]) -> xr.Dataset:
    """Return the dataset at the values asked for, the nearest of each parameter."""
    for name, value in at.items():
        if name not in swept:
            hint = did_you_mean(name, swept)
            raise InputError("at", f"a swept parameter: {', '.join(swept)}", repr(name), hint)
        there = along(data, name)
        numbers = there.numbers
        if numbers is None:
            if str(value) not in there.values:
                known = ", ".join(there.texts)
                raise InputError("at", f"{name} to be one of {known}", repr(value))
            place = there.values.index(str(value))
        else:
            try:
                place = int(np.nanargmin(np.abs(numbers - float(value))))
            except (TypeError, ValueError):
                raise InputError("at", f"a number for {name}", repr(value)) from None
        data = data.isel({name: place})
    return data


def _averaged(
    found: xr.DataArray, error: xr.DataArray | None, doubt: xr.DataArray, dim: str
) -> tuple[xr.DataArray, xr.DataArray | None, xr.DataArray]:
    """Return the mean along `dim` with its standard error; a mean with a doubtful part is so."""
    if dim not in found.dims:
        return found, error, doubt
    attrs, count = found.attrs, found.notnull().sum(dim)
    mean = found.mean(dim, keep_attrs=True)
    if found.sizes[dim] > 1:
        said = str(attrs.get("long_name", found.name))
        join = " and" if ", mean " in said else ", mean over"
        mean.attrs["long_name"] = f"{said}{join} {dim}s"
        error = found.std(dim, ddof=1) / np.sqrt(count)
    return mean, error, doubt.any(dim) if dim in doubt.dims else doubt


def _axis(data: xr.Dataset, swept: list[str], x: str | None, series: list[str]) -> str:
    """Return the dimension along the horizontal axis."""
    if series:
        if x not in (None, *series):
            raise InputError("x", "time, since the variable is a series", repr(x))
        return series[0]
    if not swept:
        raise InputError("at", "a parameter to draw along", "a single case")
    if x is not None:
        if x not in swept:
            hint = did_you_mean(x, swept)
            raise InputError("x", f"a swept parameter: {', '.join(swept)}", repr(x), hint)
        return x
    return max(swept, key=lambda d: (along(data, d).numbers is not None, data.sizes[d]))
