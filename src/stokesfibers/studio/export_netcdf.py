"""A run as one netCDF-4 file: the whole tree as groups, copied block by block."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stokesfibers.core.errors import MissingExtraError

if TYPE_CHECKING:
    import xarray as xr

_BLOCK_BYTES = 4 * 2**20


def netcdf_library() -> Any:
    """Return the package h5netcdf.

    Raises
    ------
    MissingExtraError
        If it, or h5py, is not installed.
    """
    try:
        import h5netcdf
        import h5py  # noqa: F401 - h5netcdf writes through it, but does not require it
    except ImportError as error:
        package = "h5py" if error.name == "h5py" else "h5netcdf"
        raise MissingExtraError(package, "netcdf", "The export to netCDF") from error
    return h5netcdf


def write_netcdf(data: xr.DataTree, path: Path) -> Iterator[int]:
    """Write the run to the new file `path`; yield after each array, with its number.

    ``xarray.open_datatree(path)`` gives the same values, names and attributes back. Attributes
    that are tables (of the root: status and checkpoint) are written as JSON.

    Parameters
    ----------
    data
        The stored run.
    """
    done = 0
    with netcdf_library().File(path, "w") as file:
        for name, node in data.to_dict().items():
            group = file if name == "/" else file.create_group(name.strip("/"))
            group.attrs.update(_plain(node.attrs))
            group.dimensions = {str(d): int(n) for d, n in node.sizes.items()}
            for key, variable in node.variables.items():
                _copy(group, str(key), variable)
                yield done
                done += 1


def arrays_of(data: xr.DataTree) -> int:
    """Return how many arrays `write_netcdf` writes."""
    return sum(len(node.variables) for node in data.to_dict().values())


def _copy(group: Any, name: str, variable: xr.Variable) -> None:
    text = variable.dtype.kind in "TOU"
    kind = np.dtype("O") if text else variable.dtype
    dims = tuple(str(d) for d in variable.dims)
    options: dict[str, Any] = {}
    if text:
        kind = _text_type()
    elif variable.size:
        options = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    made = group.create_variable(name, dims, kind, **options)
    made.attrs.update(_plain(variable.attrs))
    if not variable.size:
        return
    if text:
        made[...] = np.array(variable.to_numpy(), dtype=object)
        return
    row = max(1, variable.size // variable.shape[0]) * variable.dtype.itemsize
    chunk = int(variable.encoding.get("preferred_chunks", {}).get(dims[0], 1))
    block = chunk * max(1, _BLOCK_BYTES // (chunk * row))
    for start in range(0, variable.shape[0], block):
        made[start : start + block] = variable[start : start + block].to_numpy()


def _text_type() -> Any:
    import h5py

    return h5py.string_dtype()


def _plain(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Return attributes as netCDF can hold them."""
    return {
        str(k): v if isinstance(v, str | int | float) and not isinstance(v, bool) else json.dumps(v)
        for k, v in attributes.items()
    }
