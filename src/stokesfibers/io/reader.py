"""Reading a run as labelled data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from stokesfibers.io import marker

if TYPE_CHECKING:
    import xarray


def open_run(path: str | Path) -> xarray.DataTree:
    """Open a run for reading, lazily, as a tree of labelled datasets.

    Raises
    ------
    StoreError
        If there is no usable run of ours at `path`.
    """
    marker.read(Path(path))
    # Slow to import, and a run in progress does not need it.
    import xarray

    return xarray.open_datatree(path, engine="zarr")
