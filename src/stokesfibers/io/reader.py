"""Reading a run as labelled data; values that were changed on the disk are refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.io import marker

if TYPE_CHECKING:
    import xarray


def open_run(path: str | Path) -> xarray.DataTree:
    """Open a run for reading, lazily, as a tree of labelled datasets.

    A chunk whose bytes are not those that were written raises StoreError, with its name, when its
    values are asked for. One that is missing gives NaN, -1 for whole numbers, and a warning.

    Raises
    ------
    StoreError
        If there is no usable run of ours at `path`.
    """
    where = Path(path)
    docs, _ = marker.read(where)
    # Slow to import, and a run in progress does not need it.
    import xarray

    from stokesfibers.io.checked import CheckedStore

    return xarray.open_datatree(CheckedStore(where, docs), engine="zarr")  # type: ignore[arg-type]


def read_array(path: str | Path, name: str) -> NDArray[Any]:
    """Return all values of one array of a run, ``"group/name"``, without labels or their libraries.

    Raises
    ------
    StoreError
        If there is no usable run of ours at `path`, or values were changed on the disk.
    """
    where = Path(path)
    docs, _ = marker.read(where)
    import zarr  # slow to import

    from stokesfibers.io.checked import CheckedStore

    return np.asarray(zarr.open_array(CheckedStore(where, docs), path=name, mode="r")[...])
