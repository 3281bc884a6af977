"""The dataset of a sweep as one NetCDF file, which appears under its name when it is whole."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from stokesfibers.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def check_netcdf(file: Path | None) -> None:
    """Refuse a place where no file can be made, before any case has run.

    Raises
    ------
    InputError
        If the folder above is missing, or a folder is in the way.
    """
    if file is None:
        return
    if not file.parent.is_dir():
        hint = f"Make {file.parent} first."
        raise InputError("--netcdf", "a file in a folder that exists", str(file), hint)
    if file.is_dir():
        raise InputError("--netcdf", "a file", f"{file}, a folder")


def write_netcdf(data: xr.Dataset, file: Path) -> None:
    """Write the dataset to a file, replaced if it exists, once the new one is whole.

    Raises
    ------
    OSError
        If it cannot be written; an older file is as before then.
    """
    part = file.with_name(f".{file.name}.{os.getpid()}.partial")
    try:
        data.to_netcdf(part, engine="scipy")
        os.replace(part, file)
    finally:
        part.unlink(missing_ok=True)
