"""Fibers as VTK poly data: one file for each time, and collections that ParaView plays.

Point data: tension, curvature, arclength, tangent (``orientation``), radius, fiber number, and the
velocity where it is stored. Cell data, one cell a fiber: elastic energy, length and its error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import MissingExtraError
from stokesfibers.plot.geometry import curvature, wrapped
from stokesfibers.studio.export_target import write_manifest
from stokesfibers.studio.records import (
    PerFiber,
    Record,
    RunFacts,
    facts_of,
    needs_shapes,
    per_fiber,
    records,
)
from stokesfibers.studio.shapes import EDGES, cell_box, cell_corners, tangents

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]

_UNITS = {
    "tension": "force",
    "curvature": "length^-1",
    "arclength": "length",
    "radius": "length",
    "velocity": "length time^-1",
    "elastic_energy": "force length",
    "length": "length",
    "TimeValue": "time",
}


def vtk_library() -> Any:
    """Return what of the vtk package is needed.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        from vtkmodules import vtkCommonCore, vtkCommonDataModel, vtkIOXML
        from vtkmodules.util import numpy_support
    except ImportError as error:
        raise MissingExtraError("vtk", "vtk", "The export to VTK") from error
    return _Vtk(vtkCommonCore, vtkCommonDataModel, vtkIOXML, numpy_support)


@dataclass(frozen=True)
class _Vtk:
    core: Any
    model: Any
    xml: Any
    arrays: Any


def write_vtk(
    data: xr.DataTree, folder: Path, *, wrap: bool = False, every: int = 1
) -> Iterator[int]:
    """Write the run's shapes into `folder`; yield the number of each record when it is written.

    Parameters
    ----------
    data
        The stored run.
    folder
        A folder that exists and is empty.
    wrap
        Whether whole fibers are shifted by periods so that their middle points lie in the cell.
    every
        Write each `every`-th record.
    """
    vtk = vtk_library()
    needs_shapes(data)
    facts = facts_of(data)
    extra = {name: per_fiber(data, name) for name in ("elastic_energy", "length_error")}
    times: list[tuple[float, int]] = []
    box: Floats | None = None
    for record in records(data, facts, every=every):
        shape = wrapped(record.position, facts.lengths, record.offset) if wrap else record.position
        made = _fibers(vtk, facts, record, shape)
        _add_cell_data(vtk, made, facts, time=record.time, extra=extra)
        _save(vtk, made, folder / f"fibers_{record.number:06d}.vtp")
        if facts.lengths.any():
            # free directions keep the limits of the first record, or the outline would breathe
            box = cell_box(facts.lengths, shape) if box is None else box
            cell = _cell(vtk, facts, record, box)
            _save(vtk, cell, folder / f"cell_{record.number:06d}.vtp")
        times.append((record.time, record.number))
        yield record.number
    for name in ("fibers", "cell") if box is not None else ("fibers",):
        _write_collection(folder / f"{name}.pvd", name, times)
    write_manifest(folder, "vtk", {"wrapped": wrap, "every": every, "units": _UNITS})


def _fibers(vtk: _Vtk, facts: RunFacts, record: Record, shape: Floats) -> Any:
    fibers, nodes = shape.shape[:2]
    made = vtk.model.vtkPolyData()
    _set_points(vtk, made, shape.reshape(-1, 3))
    starts = np.arange(0, fibers * nodes + 1, nodes)
    made.SetLines(_cells(vtk, starts, np.arange(fibers * nodes)))
    _add_time(vtk, made, record.time)
    values = {
        "tension": record.tension,
        "curvature": curvature(record.position),
        "arclength": facts.arclength,
        "fiber": np.repeat(np.arange(fibers), nodes),
        "orientation": tangents(record.position, facts.arclength),
        "radius": facts.radius,
        "velocity": record.velocity,
    }
    for name, array in values.items():
        if array is not None:
            _add(vtk, made.GetPointData(), name, array)
    made.GetPointData().SetActiveScalars("tension")
    return made


def _add_cell_data(
    vtk: _Vtk, made: Any, facts: RunFacts, *, time: float, extra: dict[str, PerFiber | None]
) -> None:
    held = made.GetCellData()
    _add(vtk, held, "fiber", np.arange(len(facts.arclength)))
    _add(vtk, held, "length", facts.fiber_length)
    for name, series in extra.items():
        if series is not None:
            _add(vtk, held, name, series.at(time))


def _cell(vtk: _Vtk, facts: RunFacts, record: Record, box: Floats) -> Any:
    made = vtk.model.vtkPolyData()
    _set_points(vtk, made, cell_corners(box, facts.lengths, record.offset))
    made.SetLines(_cells(vtk, np.arange(0, 2 * len(EDGES) + 1, 2), EDGES.ravel()))
    _add_time(vtk, made, record.time)
    return made


def _set_points(vtk: _Vtk, made: Any, points: Floats) -> None:
    held = vtk.core.vtkPoints()
    held.SetDataTypeToDouble()
    held.SetData(_array(vtk, points))
    made.SetPoints(held)


def _cells(vtk: _Vtk, starts: NDArray[np.intp], points: NDArray[np.intp]) -> Any:
    """Return cells whose k-th holds points[starts[k] : starts[k + 1]]."""
    made = vtk.model.vtkCellArray()
    made.SetData(*(_array(vtk, part.astype(np.int64), ids=True) for part in (starts, points)))
    return made


def _add_time(vtk: _Vtk, made: Any, time: float) -> None:
    # ParaView takes a field of this name for the time of the file
    _add(vtk, made.GetFieldData(), "TimeValue", np.array([time]))


def _add(vtk: _Vtk, held: Any, name: str, values: NDArray[Any]) -> None:
    vector = name in ("orientation", "velocity")
    flat = values.reshape(-1, 3) if vector else values.reshape(-1)
    made = _array(vtk, flat)
    made.SetName(name)
    if name in _UNITS:
        made.GetInformation().Set(vtk.core.vtkDataArray.UNITS_LABEL(), _UNITS[name])
    for k in range(3 if vector else 0):
        made.SetComponentName(k, "xyz"[k])
    held.AddArray(made)


def _array(vtk: _Vtk, values: NDArray[Any], *, ids: bool = False) -> Any:
    kind = vtk.core.VTK_ID_TYPE if ids else None
    # VTK keeps its own copy: it would not keep the NumPy array alive
    return vtk.arrays.numpy_to_vtk(np.ascontiguousarray(values), deep=True, array_type=kind)


def _save(vtk: _Vtk, made: Any, path: Path) -> None:
    writer = vtk.xml.vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(made)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToZLib()
    if not writer.Write() or writer.GetErrorCode():
        reason = vtk.core.vtkErrorCode.GetStringFromErrorCode(writer.GetErrorCode())
        raise OSError(0, f"VTK could not write it ({reason})", str(path))


def _write_collection(path: Path, name: str, times: list[tuple[float, int]]) -> None:
    rows = "\n".join(
        f'    <DataSet timestep="{time!r}" group="" part="0" '
        f"file={quoteattr(f'{name}_{number:06d}.vtp')}/>"
        for time, number in times
    )
    path.write_text(
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" '
        f'byte_order="LittleEndian">\n  <Collection>\n{rows}\n  </Collection>\n</VTKFile>\n',
        encoding="utf-8",
    )
