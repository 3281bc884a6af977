"""One direction of a sweep's figure: its values, and how they and their meaning are written."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.variables import Variable
from stokesfibers.plot import select

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]
_FEW_DIGITS, _MANY_DIGITS = 3, 6
_LEAST_POINTS, _LEAST_RATIO = 3, 4.0  # for a logarithmic axis of values that grow by factors
_PLAIN = (1e-3, 1e4)
_TAKEN = {
    "largest over time": "largest",
    "smallest over time": "smallest",
    "at the end": "final",
    "mean over time": "mean",
}
_KIND = re.compile(r'\{kind = "(\w+)"(.*)\}')
_SPREAD = 30.0  # largest over smallest positive value from which a scale is logarithmic


@dataclass(frozen=True)
class Along:
    """One direction of a figure: the horizontal axis, the lines or the panels.

    Attributes
    ----------
    name
        Its dimension in the dataset.
    parameter
        Name of the coordinate along it, or of several with commas.
    values
        The values along it, numbers or texts.
    symbol
        What to call a value, with dollar signs if it is a formula.
    label
        Meaning, symbol and unit.
    unit
        Unit in brackets, a space before it; empty for pure numbers.
    """

    name: str
    parameter: str
    values: tuple[Any, ...]
    symbol: str
    label: str
    unit: str = ""

    @property
    def numbers(self) -> Floats | None:
        """The values as numbers; None if they are texts."""
        if any(isinstance(value, str) for value in self.values):
            return None
        return np.array(self.values, dtype=np.float64)

    @property
    def texts(self) -> list[str]:
        """The values as they are written: as short as tells them apart."""
        if self.numbers is None:
            return _kinds([str(value) for value in self.values])
        large = bool((np.nan_to_num(self.numbers, nan=np.inf) >= _PLAIN[1]).all())
        write = power_text if large or (self.is_log and not plain(self.values)) else _plain
        few = [write(float(v), _FEW_DIGITS) for v in self.values]
        apart = len(set(few)) == len(set(self.values))
        return few if apart else [write(float(v), _MANY_DIGITS) for v in self.values]

    @property
    def is_log(self) -> bool:
        """Whether numbers spread, or are spaced, as on a logarithmic scale."""
        return is_log(self.numbers) or _grows_by_factors(self.numbers)

    def said(self, k: int) -> str:
        """Return ``symbol = value [unit]`` of the value of number `k`."""
        return f"{self.symbol} = {self.texts[k]}{self.unit}"

    def plainly(self, k: int) -> str:
        """Return ``name = value`` of the value of number `k`, as a command line takes it."""
        value = self.texts[k] if self.numbers is None else f"{self.values[k]:.6g}"
        return f"{self.parameter} = {value}"


def plain(values: Iterable[float]) -> bool:
    """Return whether numbers on a logarithmic scale need no powers of ten."""
    known = [value for value in values if np.isfinite(value)]
    return not known or (_PLAIN[0] <= min(known) and max(known) < _PLAIN[1])


def is_log(values: Floats | None) -> bool:
    """Return whether values are better seen on a logarithmic scale."""
    known = np.empty(0) if values is None else values[np.isfinite(values)]
    return bool(known.size and known.min() > 0.0 and known.max() > _SPREAD * known.min())


def _grows_by_factors(values: Floats | None) -> bool:
    """Return whether ratios of neighbours differ less than their distances do."""
    known = np.empty(0) if values is None else np.unique(values[np.isfinite(values)])
    if len(known) < _LEAST_POINTS or known[0] <= 0.0 or known[-1] < _LEAST_RATIO * known[0]:
        return False
    steps, ratios = np.diff(known), np.diff(np.log(known))
    return bool(ratios.std() / ratios.mean() < 0.5 * steps.std() / steps.mean())


def kind_of(text: str) -> str | None:
    """Return the kind of a table written as text; None of other texts."""
    match = _KIND.fullmatch(text)
    return match[1] if match else None


def _kinds(texts: list[str]) -> list[str]:
    """Return tables by their kinds where these tell them apart, else with their other keys."""
    kinds = [kind for kind in map(kind_of, texts) if kind]
    if len(set(kinds)) == len(texts):
        return [kind.replace("_", " ") for kind in kinds]
    return [_KIND.sub(r"\1\2", text) for text in texts]


def _plain(value: float, digits: int) -> str:
    return select.number_text(float(f"{value:.{digits}g}")) if np.isfinite(value) else "none"


def power_text(value: float, digits: int) -> str:
    """Return a number as a formula with a power of ten."""
    if not np.isfinite(value):
        return "none"
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    plain = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    factor = "" if plain == "1" else rf"{plain}\times"
    return f"${factor}10^{{{int(power)}}}$"


def labels_along(data: xr.Dataset, dim: str, name: str | None = None) -> list[xr.DataArray]:
    """Return the coordinates that run along `dim`, in the order of the sweep's file.

    Of those that follow from others, such as ``flow_strain``, only the one that is named.
    """
    place = {one: k for k, one in enumerate(json.loads(data.attrs.get("parameters", "[]")))}
    there = [
        c
        for c in data.coords.values()
        if c.dims == (dim,) and ("derived" not in c.attrs or c.name == name)
    ]
    return sorted(there, key=lambda c: place.get(c.name, len(place)))


def along(data: xr.Dataset, dim: str, name: str | None = None) -> Along:
    """Return a direction of the figure; its coordinate may have another name than `dim`.

    Where several run along it, `name` is taken, or one that tells all cases apart, or all as texts.
    """
    if name in data.coords and data[name].ndim > 1:  # eta of each mu_bar and slenderness
        return _of(data[name], dim)
    labels = labels_along(data, dim, name)
    apart = [c for c in labels if len(np.unique(c)) == c.size]
    apart.sort(key=lambda c: not np.issubdtype(c.dtype, np.number))
    named = [c for c in labels if c.name == (name or dim)]
    if len(labels) > 1 and not (named or apart):
        return _together(data, dim, [str(c.name) for c in labels])
    return _of((named or apart or labels or [data[dim]])[0], dim)


def _of(held: xr.DataArray, dim: str) -> Along:
    called = str(held.name)
    symbol = f"${held.attrs['symbol']}$" if held.attrs.get("symbol") else called
    unit = select.unit_text(_variable(held, called))
    values = tuple(held.to_numpy().ravel().tolist())
    return Along(dim, called, values, symbol, label_of(held, called), unit)


def _together(data: xr.Dataset, dim: str, names: list[str]) -> Along:
    """Return a direction of which each value is one of every parameter along it."""
    each = [along(data, dim, name) for name in names]
    texts = tuple(map(", ".join, zip(*(one.texts for one in each), strict=True)))
    symbol = ", ".join(one.symbol for one in each)
    label = ", ".join(f"{one.symbol}{one.unit}" for one in each)
    return Along(dim, ", ".join(names), texts, symbol, label)


def label_of(held: xr.DataArray, name: str) -> str:
    """Return meaning, symbol and unit; what was taken of a quantity before it, of seeds below."""
    attrs = held.attrs
    meaning, _, taken = str(attrs.get("long_name", name.replace("_", " "))).partition(", ")
    first, _, rest = taken.partition(", ")
    first, _, others = first.partition(" and ")
    if first in _TAKEN:
        word = _TAKEN[first]
        taken = ", ".join(filter(None, [f"mean over {others}" if others else "", rest]))
        meaning = f"{word} {meaning.removeprefix(f'{word} ')}"
    if not attrs.get("symbol"):
        return f"{meaning}{select.unit_text(_variable(held, name))}\n{taken}".strip()
    return f"{select.axis_label(_variable(held, name, meaning))}\n{taken}".strip()


def _variable(held: xr.DataArray, name: str, meaning: str = "") -> Variable:
    attrs = held.attrs
    units, symbol = attrs.get("units", "1"), attrs.get("symbol", "")
    return Variable(name, "observables", (), units, symbol, meaning)
