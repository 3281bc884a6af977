"""A run in the formats of other tools: VTK, netCDF, CSV and Rerun, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.io.reader import open_run
from stokesfibers.studio.export_csv import write_csv
from stokesfibers.studio.export_netcdf import arrays_of, netcdf_library, write_netcdf
from stokesfibers.studio.export_target import Target, written
from stokesfibers.studio.export_vtk import vtk_library, write_vtk
from stokesfibers.studio.records import count_of, facts_of, needs_shapes
from stokesfibers.studio.view_recording import Look, rerun_library, write_rrd

if TYPE_CHECKING:
    import xarray as xr

PathLike = str | os.PathLike[str]
_FOLDERS = ("vtk", "csv")
Progress = Callable[[str, int, int], None]
"""Called with the format, how many parts are done, and how many there are."""


@dataclass(frozen=True)
class _Job:
    """One format to be written: where, what must be installed, and how."""

    name: str
    target: Target
    library: Callable[[], object]
    parts: int
    write: Callable[[Path], Iterator[int]]


def export_run(
    run: PathLike,
    *,
    vtk: PathLike | None = None,
    netcdf: PathLike | None = None,
    csv: PathLike | None = None,
    rrd: PathLike | None = None,
    wrap: bool = False,
    every: int = 1,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> tuple[Path, ...]:
    """Write a stored run in other formats; return what was made.

    All of it appears when all of it is whole: after an error nothing of it is there, and what was
    there before is untouched. A run in progress can be exported too; what is complete is written.

    Parameters
    ----------
    run
        The run's folder.
    vtk
        Folder for VTK poly data: ``fibers.pvd`` and ``cell.pvd`` open as time series in ParaView.
    netcdf
        File for the whole tree as netCDF-4 groups; `every` does not thin it.
    csv
        Folder for tables: positions, observables, fibers and numerics, with ``columns.json``.
    rrd
        File for a Rerun recording, as `view_run` shows it.
    wrap
        VTK: shift whole fibers by periods so that their middle points lie in the periodic cell.
    every
        Take the shapes of each `every`-th record.
    overwrite
        Replace files, and folders that hold nothing but an earlier export.
    progress
        Called after each part.

    Raises
    ------
    InputError
        If no format is asked for, a place cannot be used, or the run holds no shapes.
    MissingExtraError
        If a library is not installed; nothing is written then.
    """
    source = Path(run)
    data = open_run(source)
    needs_shapes(data)
    checks.whole("every", every, 1)
    places = {"vtk": vtk, "netcdf": netcdf, "csv": csv, "rrd": rrd}
    asked = {k: Path(v) for k, v in places.items() if v is not None}
    jobs = _jobs(data, asked, name=source.resolve().name, wrap=wrap, every=every)
    _check(jobs, source, overwrite=overwrite)
    with written([job.target for job in jobs]):
        for job in jobs:
            for done, _ in enumerate(job.write(job.target.partial), start=1):
                if progress is not None:
                    progress(job.name, done, job.parts)
    return tuple(job.target.place for job in jobs)


def _jobs(
    data: xr.DataTree, asked: Mapping[str, Path], *, name: str, wrap: bool, every: int
) -> list[_Job]:
    """Return what is to be written, in the order of the options."""
    shapes, arrays = count_of(facts_of(data), every), arrays_of(data)
    ways: dict[str, tuple[str, Callable[[], object], int, Callable[[Path], Iterator[int]]]] = {
        "vtk": ("VTK", vtk_library, shapes, partial(write_vtk, data, wrap=wrap, every=every)),
        "netcdf": ("netCDF", netcdf_library, arrays, partial(write_netcdf, data)),
        "csv": ("CSV", _nothing, shapes, partial(write_csv, data, every=every)),
        "rrd": (
            "Rerun",
            rerun_library,
            shapes,
            partial(write_rrd, data, name=name, look=Look(every=every)),
        ),
    }
    jobs = []
    for option, place in asked.items():
        target = Target(f"--{option}", place, folder=option in _FOLDERS)
        said, library, parts, write = ways[option]
        jobs.append(_Job(said, target, library, parts, write))
    return jobs


def _check(jobs: list[_Job], run: Path, *, overwrite: bool) -> None:
    """Refuse before anything is written what could not be finished."""
    if not jobs:
        formats = "--vtk, --netcdf, --csv or --rrd"
        raise InputError("export", f"at least one of {formats}", "none")
    places = [job.target.place.resolve() for job in jobs]
    for k, job in enumerate(jobs):
        if places[k] in places[:k]:
            raise InputError(job.target.option, "a place of its own", str(job.target.place))
        job.target.check(run, overwrite=overwrite)
        job.library()


def _nothing() -> None:
    """Stand for the library of a format that needs none."""
