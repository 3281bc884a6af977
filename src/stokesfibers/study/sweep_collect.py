"""What a sweep keeps of each case in its dataset: the table [collect] of a sweep file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from math import ceil, floor
from typing import Any, Self, cast

import numpy as np
import xarray as xr

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table, build, did_you_mean
from stokesfibers.core.variables import lookup, registered
from stokesfibers.flow.base import to_dict as flow_to_dict
from stokesfibers.flow.period import period_of
from stokesfibers.observe.averages import LEAST_IN_A_PERIOD, block_average, flow_period
from stokesfibers.observe.observables import recorded
from stokesfibers.observe.snapshot import Snapshot, Surroundings
from stokesfibers.problem.problem import Problem
from stokesfibers.run.moment import surroundings

_LEAST_RECORDS = 4
_SETTLED = "whether the mean has settled: 1 yes, 0 no, the error is too small"
_AVERAGED = (("time",), ("time", "fiber"))  # what has a mean over time: numbers, of fibers too
_ROUNDING = 1e-6  # of an interval or a period
_LISTS = ("series", "final", "largest", "smallest", "mean")
_NUMBERS = ("largest", "smallest", "mean")  # of components these would be of one at a time


@dataclass(frozen=True)
class Collect:
    """Which observables become variables of the dataset, and in what form.

    Attributes
    ----------
    series
        At all recorded times.
    final
        At the last recorded time.
    largest, smallest
        Over time, with the time where it is; of each fiber by itself; numbers only.
    mean
        Time averages with their standard error by blocks, of each fiber by itself; numbers only.
    after
        Largest, smallest and mean count from this time on.
    block
        Length of the blocks in time; by default long enough by itself.
    order
        The lists in the order of the sweep file.
    """

    series: tuple[str, ...] = ()
    final: tuple[str, ...] = ()
    largest: tuple[str, ...] = ()
    smallest: tuple[str, ...] = ()
    mean: tuple[str, ...] = ()
    after: float = 0.0
    block: float | None = None
    order: tuple[str, ...] = field(default=_LISTS, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        known = {v.name: v for v in registered("observables") if v.name != "time"}
        for key in _LISTS:
            names = getattr(self, key)
            if isinstance(names, str) or not isinstance(names, list | tuple):
                raise InputError(key, "a list of names of observables", names)
            for name in names:
                if name not in known:
                    hint = did_you_mean(str(name), known)
                    raise InputError(key, f"names among {', '.join(known)}", repr(name), hint)
            object.__setattr__(self, key, tuple(dict.fromkeys(names)))
        checks.non_negative("after", self.after)
        if self.block is not None:
            checks.positive("block", self.block)

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Self:
        """Return what [collect] says; InputError if it says nothing to collect."""
        found = build(cls, table, "collect")
        if not found.names:
            example = 'For example: [collect] final = ["elastic_energy"]'
            raise InputError("collect", f"one of {', '.join(_LISTS)}", "nothing", example)
        given = (key for key in table if key in _LISTS)
        object.__setattr__(found, "order", tuple(dict.fromkeys((*given, *_LISTS))))
        return found

    def to_table(self) -> Table:
        """Return the table that `from_table` takes, in the same order."""
        rest = (f.name for f in fields(self) if f.init and f.name not in _LISTS)
        held = {name: asdict(self)[name] for name in (*self.order, *rest)}
        return {
            key: list(value) if isinstance(value, tuple) else value for key, value in held.items()
        }

    @property
    def names(self) -> tuple[str, ...]:
        """All observables that are asked for."""
        return tuple(dict.fromkeys(name for key in _LISTS for name in getattr(self, key)))

    @property
    def variables(self) -> frozenset[str]:
        """Names of the variables that these become."""
        extremes = {f"{n}_{key}" for key in ("largest", "smallest") for n in getattr(self, key)}
        means = {f"{n}_mean{end}" for n in self.mean for end in ("", "_error", "_settled")}
        times = {f"{name}_time" for name in extremes}
        return frozenset(
            {*self.series, *(f"{n}_final" for n in self.final)} | extremes | times | means
        )

    def check(self, problem: Problem, until: float, interval: float) -> None:
        """Raise InputError if a run of `problem` cannot give what is asked for.

        Parameters
        ----------
        problem
            What the run solves.
        until, interval
            End of the run, and the time between its records of observables.
        """
        setting = cast(Snapshot, _Setting(problem.fibers, surroundings(problem, 0.0)))
        held = recorded(setting)
        for name in self.names:
            if name not in held:
                expected = f"observables that this case records: {', '.join(held)}"
                raise InputError("collect", expected, repr(name))
        self._check_numbers(held)
        if self.after > until:
            raise InputError("collect.after", f"a time before the end, {until:g}", self.after)
        records = (until - self.after) / interval
        if self.mean and records < _LEAST_RECORDS * max(1.0, (self.block or 0.0) / interval):
            raise InputError(
                "collect.mean",
                "times for at least four blocks of records",
                f"{max(0, int(records + 1e-9))} records of observables after t = {self.after:g}",
                "Set a smaller record.observables_every, collect.after or collect.block.",
            )
        self._check_periods(period_of(flow_to_dict(problem.flow)), until, interval)

    def _check_numbers(self, held: Iterable[str]) -> None:
        """Raise InputError if components have no largest, smallest or mean; `held` is recorded."""
        numbers = [name for name in held if lookup("observables", name).dims in _AVERAGED]
        numbers.remove("time")
        for key in _NUMBERS:
            for name in getattr(self, key):
                if name not in numbers:
                    hint = did_you_mean(name, numbers)
                    expected = f"numbers: {', '.join(numbers)}"
                    raise InputError(f"collect.{key}", expected, repr(name), hint)

    def _check_periods(self, period: float | None, until: float, interval: float) -> None:
        """Raise InputError if means in an oscillating flow would not be over whole periods."""
        if period is None or not self.mean:
            return
        first, last = ceil(self.after / interval - _ROUNDING), floor(until / interval + _ROUNDING)
        periods = floor((last - first + 1) * interval / period + _ROUNDING)
        block = max(1, round((self.block or 0.0) / period))
        if periods // block < _LEAST_RECORDS:
            blocks = f" in blocks of {block * period:.6g}" if block > 1 else ""
            raise InputError(
                "collect.mean",
                f"times for at least four whole periods of the flow, {period:.6g} each{blocks}",
                f"{until - self.after:.6g} after t = {self.after:g}",
                "Set a later stepping.until, or an earlier collect.after.",
            )
        if period < LEAST_IN_A_PERIOD * interval * (1.0 - _ROUNDING):
            raise InputError(
                "collect.mean",
                f"at least {LEAST_IN_A_PERIOD} records in each period of the flow, {period:.6g}",
                f"one each {interval:.6g}",
                "Set a smaller record.observables_every.",
            )


@dataclass(frozen=True)
class _Setting:
    """What `recorded` reads of a snapshot: nothing of it depends on the shapes."""

    fibers: tuple[Any, ...]
    surroundings: Surroundings


def reduced(run: xr.DataTree, collect: Collect) -> xr.Dataset:
    """Return what `collect` asks of one finished run; without what the run does not hold."""
    observables = run["observables"].to_dataset()
    kept = [name for name in collect.names if name in observables]
    observables = observables[kept].load()
    found: dict[str, xr.DataArray] = {}
    for name in kept:
        values = observables[name]
        if name in collect.series:
            found[name] = values
        if name in collect.final:
            found[f"{name}_final"] = _said(values.isel(time=-1, drop=True), "at the end")
        late = values.sel(time=values["time"] >= collect.after)
        if not late.sizes["time"]:  # a condition ended the run before
            late = xr.full_like(values.isel(time=[-1]), np.nan, dtype=float)
        for key in ("largest", "smallest"):
            if name in getattr(collect, key):
                found |= _extreme(late, key)
        if name in collect.mean:
            found |= _mean(late, collect.block, flow_period(run))
    return xr.Dataset(found)


def _extreme(values: xr.DataArray, key: str) -> dict[str, xr.DataArray]:
    name, sign = str(values.name), 1.0 if key == "largest" else -1.0
    ranked = (sign * values).fillna(-np.inf)
    place = ranked.argmax("time")
    chosen = values.isel(time=place).drop_vars("time")
    time = values["time"].isel(time=place).drop_vars("time").where(np.isfinite(chosen))
    meaning = lookup("observables", name).meaning.removeprefix(f"{key} ")
    when = f"time of the {key} {meaning}"
    return {
        f"{name}_{key}": _said(chosen, f"{key} over time"),
        f"{name}_{key}_time": time.assign_attrs(units="time", long_name=when),
    }


def _mean(
    values: xr.DataArray, block: float | None, period: float | None
) -> dict[str, xr.DataArray]:
    name, time = str(values.name), values["time"].to_numpy()
    plain = values.isel(time=0, drop=True)
    columns = values.transpose("time", ...).to_numpy().reshape(len(time), -1).T
    found = [_average(time, column, block, period) for column in columns]
    mean, error, settled = (
        xr.full_like(plain, np.nan, dtype=float).copy(data=np.reshape(part, plain.shape))
        for part in zip(*found, strict=True)
    )
    settled.attrs = {"long_name": _SETTLED}
    return {
        f"{name}_mean": _said(mean, "mean over time"),
        f"{name}_mean_error": _said(error, "standard error of the mean"),
        f"{name}_mean_settled": settled,
    }


def _average(
    time: Array, values: Array, block: float | None, period: float | None
) -> tuple[float, float, float]:
    """Return mean, error and whether it has settled; NaN where there is no mean."""
    try:
        found = block_average(time, values, block=block, period=period)
    except InputError:  # values that are not finite, or a run that a condition ended early
        return np.nan, np.nan, np.nan
    return found.mean, found.error, float(found.settled)


def _said(values: xr.DataArray, how: str) -> xr.DataArray:
    meaning = values.attrs.get("long_name", values.name)
    return values.assign_attrs(long_name=f"{meaning}, {how}")
