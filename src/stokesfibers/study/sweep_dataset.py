"""The dataset of a sweep: swept parameters are its coordinates, cases that failed are NaN."""

from __future__ import annotations

import json
import shutil
import uuid
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stokesfibers.config.keys import key_at
from stokesfibers.core.errors import StoreError
from stokesfibers.io.atomic import disk_errors
from stokesfibers.io.provenance import provenance
from stokesfibers.io.reader import open_run
from stokesfibers.study.sweep_axes import Axis
from stokesfibers.study.sweep_collect import reduced
from stokesfibers.study.sweep_derived import derived, natural_units
from stokesfibers.study.sweep_folder import DATASET, RUNS, UNREADABLE, State, SweepFolder, doubt_of
from stokesfibers.study.sweep_plan import Plan, SweepCase
from stokesfibers.study.sweep_values import short_names, toml_text

_WHAT = {
    "status": "how the case ended: done, failed, interrupted or waiting",
    "reason": "why it failed",
    "doubt": "why its result cannot be trusted",
    "run": "its run, below the folder of the sweep",
    "time_reached": "simulated time it reached",
    "wall_time": "computing time of its steps, without recording and checks",
}


def dataset(
    folder: SweepFolder, plan: Plan, known: Mapping[str, State] | None = None
) -> xr.Dataset:
    """Return the dataset of a sweep from what its runs hold now, finished or not.

    Parameters
    ----------
    folder, plan
        The sweep.
    known
        States by key of cases that have ended; a full disk may have kept them from being noted.
    """
    shape = tuple(len(axis.points) for axis in plan.axes)
    dims = tuple(axis.name for axis in plan.axes)
    ended = known or {}
    states = [ended.get(case.key) or folder.state(case) for case in plan.cases]
    found, walls, doubts = [], [], []
    for k, (case, state) in enumerate(zip(plan.cases, states, strict=True)):
        taken = _taken(folder, case, state, plan)
        found.append(taken.values)
        walls.append(taken.wall)
        doubts.append(taken.doubt)
        states[k] = taken.state
    held = {name: (dims, values.reshape(shape)) for name, values in _facts(folder, plan, states)}
    held["wall_time"] = (dims, np.array(walls).reshape(shape))
    held["doubt"] = (dims, _texts(doubts).reshape(shape))
    attributes = _attributes(plan, states) | {
        "doubtful": sum(d != "" and s.code == "done" for d, s in zip(doubts, states, strict=True))
    }
    coordinates = _coordinates(plan.axes)
    attributes["parameters"] = json.dumps(list(coordinates))  # stores do not keep their order
    coordinates |= derived(plan, dims, shape)
    data = xr.Dataset(held, coords=coordinates, attrs=attributes)
    for name, meaning in _WHAT.items():
        data[name].attrs["long_name"] = meaning
    data["wall_time"].attrs["units"] = "s"
    data["time_reached"].attrs["units"] = "time"
    return data.merge(_spread(found, dims, shape), combine_attrs="override")


def write_dataset(data: xr.Dataset, folder: Path) -> Path:
    """Write the dataset beside its place, then move it there; return the place.

    Raises
    ------
    StoreError
        If it cannot be written; the old one is kept then.
    """
    place, old = folder / DATASET, folder / f".{DATASET}.old"
    part = folder / f".{DATASET}.{uuid.uuid4().hex[:8]}.partial"
    with disk_errors(place):
        try:
            with warnings.catch_warnings():
                # Plain xarray looks for consolidated metadata first, in the standard or not.
                warnings.filterwarnings("ignore", message=".*Consolidated metadata.*")
                data.to_zarr(part, zarr_format=3, consolidated=True)
            if place.exists():
                place.rename(old)
            part.rename(place)
        except BaseException:
            shutil.rmtree(part, ignore_errors=True)
            if old.exists() and not place.exists():
                old.rename(place)
            raise
    shutil.rmtree(old, ignore_errors=True)
    return place


@dataclass(frozen=True)
class _Taken:
    """What the run of a case gives, and the case's state as it turned out."""

    state: State
    values: xr.Dataset | None = None
    wall: float = np.nan
    doubt: str = ""


def _taken(folder: SweepFolder, case: SweepCase, state: State, plan: Plan) -> _Taken:
    store, was = folder.store(case), state
    if state.code == "waiting" or not store.exists():
        return _Taken(state)
    if was.unreadable:  # it may have been put back from a copy
        state = State("done", was.time)
    try:
        with open_run(store) as run:
            wall = float(run["numerics"].to_dataset()["wall_time"].sum())
            values = reduced(run, plan.collect) if state.code == "done" else None
            doubts = doubt_of(run.attrs["status"])
    except (StoreError, OSError, LookupError, ValueError) as error:
        told = f"{UNREADABLE}: {str(error).rstrip('.')}"
        if state.code != "done":  # nothing to keep: what it comes to is not known yet
            return _Taken(State("failed", state.time, told, final=False))
        state = State("failed", state.time, f"{told}. 'sweep --retry' runs the case anew")
        values, wall, doubts = None, np.nan, ""
    if state.unreadable or was.unreadable:
        with suppress(OSError):  # a folder that may only be read
            folder.write_note(case, state if state.unreadable else None)
    return _Taken(state, values, wall, doubts)


def _facts(
    folder: SweepFolder, plan: Plan, states: Sequence[State]
) -> list[tuple[str, NDArray[Any]]]:
    runs = [f"{RUNS}/{folder.store(case).name}" for case in plan.cases]
    return [
        ("status", _texts([state.code for state in states])),
        ("reason", _texts([state.reason for state in states])),
        ("run", _texts(runs)),
        ("time_reached", np.array([state.time for state in states])),
    ]


def _attributes(plan: Plan, states: Sequence[State]) -> dict[str, Any]:
    codes = [state.code for state in states]
    whole = all(code in ("done", "failed") for code in codes)
    return {
        "status": "done" if whole else "interrupted",
        "cases": len(codes),
        "done": codes.count("done"),
        "failed": codes.count("failed"),
        "source": plan.source,
        "collect": json.dumps(plan.collect.to_table()),
        "provenance": json.dumps(provenance()),
        **natural_units([case.tables for case in plan.cases]),
    }


def _coordinates(axes: Sequence[Axis]) -> dict[str, Any]:
    """Return the swept values by short names, each along its axis."""
    short = short_names([path for axis in axes for path in axis.paths])
    found: dict[str, Any] = {}
    for axis in axes:
        if axis.labels:
            said = {"long_name": "name of the case"}
            found[axis.name] = ((axis.name,), _texts(axis.labels), said)
        for path in axis.paths:
            values = _column([point.get(path) for point in axis.points])
            found[short[path]] = ((axis.name,), values, {"path": path, **_said(path, values)})
    return found


def _said(path: str, values: NDArray[Any]) -> dict[str, str]:
    """Return meaning, unit and symbol of swept values; of text only what it means."""
    key = key_at(path)
    told = {} if key is None else key.attrs()
    return told if values.dtype != object else {k: v for k, v in told.items() if k == "long_name"}


def _column(values: list[Any]) -> NDArray[Any]:
    """Return swept values as numbers where all are, with NaN for None; else as text."""
    numbers = [isinstance(v, int | float) and not isinstance(v, bool) for v in values]
    if all(n or v is None for n, v in zip(numbers, values, strict=True)):
        if all(isinstance(v, int) for v in values):
            return np.array(values, dtype=np.int64)
        return np.array([np.nan if v is None else float(v) for v in values])
    texts = (v if isinstance(v, str) else "" if v is None else toml_text(v) for v in values)
    return _texts(list(texts))


def _texts(values: Sequence[str]) -> NDArray[Any]:
    return np.array(values, dtype=object)


def _spread(
    found: Sequence[xr.Dataset | None], dims: tuple[str, ...], shape: tuple[int, ...]
) -> xr.Dataset:
    """Return the cases' datasets as one with the sweep's dimensions in front.

    Where cases differ in length, the shorter are filled with NaN; if their times differ, each
    keeps its own, ``time`` along ``record``.
    """
    given = [(k, one) for k, one in enumerate(found) if one is not None]
    series = [one for _, one in given if "time" in one.dims]
    longest = max(series, key=lambda one: one.sizes["time"], default=None)
    alike = longest is None or all(one["time"].equals(longest["time"]) for one in series)
    if not alike:
        given = [(k, _with_own_times(one)) for k, one in given]
    spread: dict[str, Any] = {}
    labels: dict[str, xr.DataArray] = {}
    names = dict.fromkeys(name for _, one in given for name in one.data_vars)
    for name in names:
        having = {k: one[name] for k, one in given if name in one}
        spread[str(name)] = _filled(having, dims, shape)
        for values in having.values():
            labels |= {str(d): values[d] for d in values.dims if d in values.coords}
    held = {name: labels[name] for name in labels if _fits(labels[name], spread)}
    return xr.Dataset(spread, coords=held)


def _with_own_times(one: xr.Dataset) -> xr.Dataset:
    """Return the series with their times as a variable along ``record``."""
    if "time" not in one.dims:
        return one
    time = one["time"]
    plain = one.drop_vars("time").rename_dims(time="record")
    return plain.assign(time=("record", time.to_numpy(), time.attrs))


def _fits(label: xr.DataArray, spread: Mapping[str, Any]) -> bool:
    """Return whether a label is as long as the variables along it."""
    (dim,) = label.dims
    return all(v[1].shape[v[0].index(dim)] == label.size for v in spread.values() if dim in v[0])


def _filled(
    having: Mapping[int, xr.DataArray], dims: tuple[str, ...], shape: tuple[int, ...]
) -> tuple[tuple[str, ...], NDArray[Any], dict[str, Any]]:
    first = next(iter(having.values()))
    own = tuple(map(str, first.dims))
    sizes = np.max([values.shape for values in having.values()], axis=0).astype(int).tolist()
    whole = np.full((int(np.prod(shape)), *sizes), np.nan)
    for k, values in having.items():
        whole[(k, *(slice(n) for n in values.shape))] = values.to_numpy()
    return (*dims, *own), whole.reshape(*shape, *sizes), dict(first.attrs)
