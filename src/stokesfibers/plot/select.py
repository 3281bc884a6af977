"""Reading a stored run for a figure: arrays with clear errors, labels, records to draw."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import Variable, lookup

if TYPE_CHECKING:
    import xarray as xr

MOST_RECORDS = 8
"""Most records that a figure draws by itself."""
MOST_FIBERS = 8
"""Most fibers that get a line of their own; it is the number of colours of the palette."""
_EVENT = 0.1  # share of the peak energy above which a record belongs to the bending event
_MOSTLY = 0.5  # share of the run above which fibers bend all along, and there is no event
_VISIBLE_BEND = 0.05  # curvature times length; the sagitta is then 0.6 % of the length

Records = NDArray[np.intp]


def has(data: xr.DataTree, group: str, name: str) -> bool:
    """Return whether the run stores ``group/name`` with at least one value."""
    return group in data.children and name in data[group] and data[group][name].size > 0


def read(data: xr.DataTree, group: str, name: str) -> xr.DataArray:
    """Return the stored array ``group/name`` (not loaded yet if the store is lazy).

    Raises
    ------
    InputError
        If the run does not hold it, or holds no value of it.
    """
    if has(data, group, name):
        return data[group].to_dataset()[name]
    there = sorted(str(n) for n in data[group].variables) if group in data.children else []
    hint = f"The group holds: {', '.join(there)}." if there else f"There is no group {group}."
    raise InputError(f"{group}.{name}", "an array with at least one record", "none", hint)


def numbers(data: xr.DataTree, group: str, name: str) -> NDArray[np.float64]:
    """Return the values of ``group/name``; errors as `read`."""
    return values(read(data, group, name))


def values(array: xr.DataArray) -> NDArray[np.float64]:
    """Return the array's values as float64."""
    return np.asarray(array.to_numpy(), dtype=np.float64)


def describe(data: xr.DataTree, group: str, name: str) -> Variable:
    """Return name, symbol, unit and meaning of ``group/name``.

    They come from the registry; what the store says beside the array goes first, so that a
    run converted to other units, or a user's own observable, is labelled rightly.

    Raises
    ------
    InputError
        If neither the registry nor the store describes it.
    """
    attrs = data[group][name].attrs if has(data, group, name) else {}
    try:
        known = lookup(group, name)
    except KeyError:
        if not {"symbol", "long_name"} <= set(attrs):
            raise InputError(
                f"{group}.{name}", "a registered variable", "an unknown name"
            ) from None
        known = Variable(name, "observables", ("time",), "1", "", "")
    return replace(
        known,
        unit=str(attrs.get("units", known.unit)),
        symbol=str(attrs.get("symbol", known.symbol)),
        meaning=str(attrs.get("long_name", known.meaning)),
    )


def unit_text(variable: Variable) -> str:
    """Return the unit in square brackets with a space before it; empty for a pure number."""
    raised = re.sub(r"\^(-?\d+)", r"$^{\1}$", variable.unit)
    return "" if variable.unit == "1" else f" [{raised}]"


def axis_label(variable: Variable, longest: int = 40) -> str:
    """Return meaning, symbol and unit for an axis, on two lines if longer than `longest`.

    A unit that only repeats the meaning (time in units of time) is left out.
    """
    unit = "" if variable.unit == variable.meaning else unit_text(variable)
    printed = re.sub(r"\\[a-zA-Z]+|[{}_^$]", "", variable.meaning + variable.symbol + unit)
    long = len(printed) > longest
    return f"{variable.meaning}{chr(10) if long else ' '}${variable.symbol}${unit}"


def pick_fibers(count: int, fibers: Sequence[int] | int | None) -> Records:
    """Return the numbers of the fibers to draw, all of them for None.

    Raises
    ------
    InputError
        If none is asked for, or a number is not one of 0 ... count - 1.
    """
    if fibers is None:
        return np.arange(count)
    asked = np.atleast_1d(np.asarray(fibers))
    whole = np.issubdtype(asked.dtype, np.integer)
    if asked.size == 0 or not whole or asked.min() < 0 or asked.max() >= count:
        there = f"fiber numbers from 0 to {count - 1}" if count > 1 else "0, the only fiber"
        raise InputError("fiber", there, ", ".join(str(k) for k in asked.tolist()) or "none")
    return asked.astype(np.intp)


def pick_records(data: xr.DataTree, times: ArrayLike | None, most: int = MOST_RECORDS) -> Records:
    """Return the numbers of the trajectory's records to draw.

    Parameters
    ----------
    data
        The stored run.
    times
        Times asked for; the nearest stored record stands for each, once. None picks up to
        `most` records: spread over the stretch of the run where the elastic energy is at least
        a tenth of its peak, the peak included; spread over the whole run, with its first and
        last record, if no fiber bends visibly, the energy is not stored, or fibers are bent from
        the start or for more than half of the run.

    Raises
    ------
    InputError
        If a time lies outside the stored range or none is given.
    """
    stored = numbers(data, "trajectory", "time")
    if times is None:
        return _default_records(data, stored, most)
    asked = np.atleast_1d(np.asarray(times, dtype=np.float64))
    first, last = float(stored[0]), float(stored[-1])
    slack = 1e-9 * max(abs(first), abs(last))
    inside = (asked >= first - slack) & (asked <= last + slack)
    if asked.size == 0 or not np.all(inside):
        raise InputError(
            "times",
            f"times between {first:.6g} and {last:.6g}, the stored range",
            "none" if asked.size == 0 else f"{asked[~inside][0]:.6g}",
        )
    nearest = [int(np.argmin(np.abs(stored - t))) for t in asked]
    return np.array(list(dict.fromkeys(nearest)), dtype=np.intp)


@dataclass(frozen=True)
class Chosen:
    """Records to draw.

    Attributes
    ----------
    records
        Their numbers.
    times
        Their times.
    """

    records: Records
    times: NDArray[np.float64]


def choose(data: xr.DataTree, times: ArrayLike | None, most: int = MOST_RECORDS) -> Chosen:
    """Return the records to draw with their times; parameters and errors as `pick_records`."""
    records = pick_records(data, times, most)
    return Chosen(records, numbers(data, "trajectory", "time")[records])


def snapshot(data: xr.DataTree, time: float | None) -> tuple[int, float]:
    """Return number and time of the record nearest to `time`, by default the last.

    Raises
    ------
    InputError
        If the time lies outside the stored range.
    """
    stored = numbers(data, "trajectory", "time")
    chosen = choose(data, [stored[-1] if time is None else time])
    return int(chosen.records[0]), float(chosen.times[0])


def positions(data: xr.DataTree, record: int) -> NDArray[np.float64]:
    """Return the centrelines of one record, (fiber, node, 3).

    Raises
    ------
    InputError
        If some are not finite.
    """
    array = read(data, "trajectory", "position").isel(time=record)
    whole = values(array.transpose("fiber", "node", "space"))
    if not np.isfinite(whole).all():
        raise InputError("trajectory.position", "finite positions", "others in this record")
    return whole


def plane_directions(plane: str) -> list[int]:
    """Return the numbers of the two directions of a plane and of the one across it.

    Raises
    ------
    InputError
        If the plane is not two different letters of x, y, z.
    """
    if len(plane) != 2 or plane[0] == plane[1] or not set(plane) <= set("xyz"):
        raise InputError("plane", "two different letters of x, y, z", plane)
    across, up = ("xyz".index(letter) for letter in plane)
    return [across, up, 3 - across - up]


def time_label(data: xr.DataTree) -> str:
    """Return the label of an axis, a legend or a bar of times."""
    group = "trajectory" if has(data, "trajectory", "time") else "observables"
    return axis_label(describe(data, group, "time"))


def at_time(data: xr.DataTree, time: float) -> str:
    """Return ``t = ...`` with the unit, unless that only repeats the meaning."""
    variable = describe(data, "trajectory", "time")
    unit = "" if variable.unit == variable.meaning else f" {variable.unit}"
    return f"${variable.symbol} = {digits(time)}${unit}"


def digits(value: float) -> str:
    """Return a number in six digits for a formula; very small and large ones as 2 x 10^-5."""
    plain = f"{value:.6g}"
    if plain.lstrip("-").startswith("0.000"):
        plain = f"{value:.5e}"
    if "e" not in plain:
        return plain
    mantissa, power = plain.split("e")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return rf"{mantissa}\times10^{{{int(power)}}}"


def number_text(value: float) -> str:
    """Return a number for a legend: as it is, or a formula if it needs a power of ten."""
    written = digits(value)
    return f"${written}$" if "times" in written else written


def _default_records(data: xr.DataTree, stored: NDArray[np.float64], most: int) -> Records:
    energy = energy_at(data, stored)
    if len(stored) <= most:
        return np.arange(len(stored))
    if energy is None:
        return _even(len(stored), most)
    peak = int(np.argmax(energy))
    bent = np.flatnonzero(energy >= _EVENT * energy[peak])
    if bent[0] == 0 or stored[bent[-1]] - stored[bent[0]] > _MOSTLY * (stored[-1] - stored[0]):
        return _even(len(stored), most)
    size = max(most, len(bent))
    picked = _spread(np.sort(np.argsort(-energy, kind="stable")[:size]), most)
    if peak not in picked:
        picked[np.argmin(np.abs(picked - peak))] = peak
    return picked


def _spread(candidates: Records, most: int) -> Records:
    return candidates[np.round(np.linspace(0, len(candidates) - 1, most)).astype(np.intp)]


def _even(count: int, most: int) -> Records:
    """Return records from the first to the last, at even distances if a few fewer have them."""
    fitting = (m for m in range(most, most // 2, -1) if (count - 1) % (m - 1) == 0)
    return _spread(np.arange(count), next(fitting, most))


def energy_at(data: xr.DataTree, times: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the total elastic energy at `times`, or None where it tells nothing."""
    if not has(data, "observables", "elastic_energy"):
        return None
    if has(data, "observables", "largest_curvature") and has(data, "trajectory", "arclength"):
        bend = numbers(data, "observables", "largest_curvature")
        length = float(np.max(numbers(data, "trajectory", "arclength")))
        if not np.nanmax(bend, initial=0.0) * length > _VISIBLE_BEND:
            return None
    stored = read(data, "observables", "elastic_energy")
    total = values(total_over_rest(stored, "time"))
    energy = np.interp(times, numbers(data, "observables", "time"), np.nan_to_num(total))
    return energy if np.max(energy) > 0.0 else None


def total_over_rest(array: xr.DataArray, kept: str) -> xr.DataArray:
    """Return the sum of `array` over all axes but `kept`."""
    return array.sum([d for d in array.dims if d != kept], skipna=False)
