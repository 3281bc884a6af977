"""A run as tables for spreadsheets: CSV files, and what their columns are beside them.

Numbers are written in full: reading them back gives the same bits.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.variables import Variable
from stokesfibers.plot import select
from stokesfibers.studio.export_target import write_manifest
from stokesfibers.studio.records import facts_of, needs_shapes, records

if TYPE_CHECKING:
    import xarray as xr

_ROWS = 4096  # about how many rows are in memory at once
Columns = dict[str, dict[str, str]]


def write_csv(data: xr.DataTree, folder: Path, *, every: int = 1) -> Iterator[int]:
    """Write the run as tables into `folder`; yield the number of each shape when it is written.

    Parameters
    ----------
    data
        The stored run.
    folder
        A folder that exists and is empty.
    every
        Write the shapes of each `every`-th record; observables and steps are written all.
    """
    needs_shapes(data)
    columns = {"positions.csv": _position_columns(data)}
    yield from _write_positions(data, folder / "positions.csv", every)
    columns["observables.csv"] = _write_group(data, folder / "observables.csv", fibers=False)
    columns["fibers.csv"] = _write_group(data, folder / "fibers.csv", fibers=True)
    columns["numerics.csv"] = _write_steps(data, folder / "numerics.csv")
    (folder / "columns.json").write_text(json.dumps(columns, indent=1), encoding="utf-8")
    write_manifest(folder, "csv", {"every": every})


def _write_positions(data: xr.DataTree, path: Path, every: int) -> Iterator[int]:
    facts = facts_of(data)
    fibers, nodes = facts.arclength.shape
    fiber = np.repeat(np.arange(fibers), nodes).tolist()
    node = np.tile(np.arange(nodes), fibers).tolist()
    s = facts.arclength.ravel().tolist()
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(_position_columns(data))
        for record in records(data, facts, every=every):
            xyz = record.position.reshape(-1, 3).T.tolist()
            tension = record.tension.ravel().tolist()
            time = [record.time] * len(s)
            out.writerows(zip(time, fiber, node, s, *xyz, tension, strict=True))
            yield record.number


def _position_columns(data: xr.DataTree) -> Columns:
    position = select.describe(data, "trajectory", "position")
    return {
        "time": _about(select.describe(data, "trajectory", "time")),
        "fiber": _counted("number of the fiber"),
        "node": _counted("number of the point along the fiber"),
        "s": _about(select.describe(data, "trajectory", "arclength")),
        **{axis: _about(position, f", {axis}") for axis in "xyz"},
        "tension": _about(select.describe(data, "trajectory", "tension")),
    }


def _write_group(data: xr.DataTree, path: Path, *, fibers: bool) -> Columns:
    """Write the observables with, or without, a value for each fiber; return the columns."""
    group = data["observables"].to_dataset()
    names = [
        str(n)
        for n, a in group.data_vars.items()
        if a.dims[:1] == ("time",) and ("fiber" in a.dims) == fibers
    ]
    each = group.sizes.get("fiber", 1) if fibers else 1
    if fibers and not names:
        return {}
    columns = {"time": _about(select.describe(data, "observables", "time"))}
    if fibers:
        columns["fiber"] = _counted("number of the fiber")
    for name in names:
        about = select.describe(data, "observables", name)
        columns |= {name + end: _about(about, end) for end in _suffixes(group[name], "fiber")}
    block = max(1, _ROWS // each)
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(columns)
        for start in range(0, group.sizes["time"], block):
            part = group.isel(time=slice(start, start + block))
            first = [part["time"].to_numpy()]
            rows = len(first[0]) * each
            if fibers:
                first = [np.repeat(first[0], each), np.tile(np.arange(each), len(first[0]))]
            out.writerows(_rows(first, [part[name].to_numpy() for name in names], rows))
    return columns


def _write_steps(data: xr.DataTree, path: Path) -> Columns:
    group = data["numerics"].to_dataset()
    columns = {"step": _counted("number of the step")}
    for name, array in group.data_vars.items():
        about = select.describe(data, "numerics", str(name))
        columns |= {f"{name}{end}": _about(about, end) for end in _suffixes(array, "step")}
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(columns)
        for start in range(0, group.sizes["step"], _ROWS):
            part = group.isel(step=slice(start, start + _ROWS))
            number = np.arange(start, start + part.sizes["step"])
            values = [array.to_numpy() for array in part.data_vars.values()]
            out.writerows(_rows([number], values, len(number)))
    return columns


def _rows(
    first: Sequence[NDArray[Any]], arrays: Sequence[NDArray[Any]], count: int
) -> Iterator[tuple[Any, ...]]:
    """Return rows of Python numbers: `first` as columns, then each array's components."""
    columns = [a.tolist() for a in first]
    for array in arrays:
        columns += array.reshape(count, -1).T.tolist()
    return zip(*columns, strict=True)


def _suffixes(array: xr.DataArray, leading: str) -> list[str]:
    """Return what tells the components of an array apart: "", "_x", "_xy", "_solve"."""
    dims = [str(d) for d in array.dims if d not in ("time", leading)]
    labels = [
        [str(v) for v in array[d].to_numpy()]
        if d in array.coords
        else [str(k) for k in range(array.sizes[d])]
        for d in dims
    ]
    joined = "" if all(d in ("i", "j", "space") for d in dims) else "_"
    return ["_" + joined.join(parts) if parts else "" for parts in product(*labels)]


def _about(variable: Variable, component: str = "") -> dict[str, str]:
    about: Mapping[str, str] = {
        "units": variable.unit,
        "symbol": variable.symbol,
        "meaning": variable.meaning,
    }
    return {**about, "component": component.strip(", _")} if component.strip(", _") else {**about}


def _counted(meaning: str) -> dict[str, str]:
    return {"units": "1", "symbol": "", "meaning": meaning}
