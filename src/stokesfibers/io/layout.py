"""What a run store holds, and the Zarr files that say so.

The files are made by zarr itself, in memory; the store then writes them to disk in its own safe
way. Arrays of numbers are uncompressed: their chunks are plain little-endian bytes, with a checksum
behind them that any reader of Zarr looks at.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import BytesCodec, Crc32cCodec
from zarr.storage import MemoryStore

from stokesfibers.core.variables import Variable
from stokesfibers.io.chunks import fill_value

GROWING = ("time", "step")
"""Dimensions that grow during a run."""
CHECKPOINT = "checkpoint"
"""Group that only the store itself writes."""

_CHUNK_BYTES = 32 * 1024  # written anew with each commit until it is full
# Some versions of xarray turn numbers with such a unit into timedelta64.
_TIME_WORDS = ("days", "hours", "minutes", "seconds", "milliseconds", "microseconds", "nanoseconds")
_LABELS: dict[str, Sequence[str]] = dict.fromkeys(("space", "i", "j"), ("x", "y", "z"))
_AS_IS: dict[str, Any] = {
    "serializer": BytesCodec(endian="little"),
    # Otherwise a chunk of zeros is left out, and with it the sign of -0.0.
    "config": {"write_empty_chunks": True},
}


@dataclass(frozen=True)
class ArrayLayout:
    """One array of a run store.

    Attributes
    ----------
    variable
        What it holds. It grows if its first axis is ``time`` or ``step``.
    shape_tail
        Shape of one record, for an array that grows.
    fixed
        The values, for an array that does not grow.
    """

    variable: Variable
    shape_tail: tuple[int, ...] = ()
    fixed: NDArray[Any] | None = None

    @property
    def grows(self) -> bool:
        """True if records are appended to it."""
        return any(name in GROWING for name in self.variable.dims[:1])

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape at the start of the run."""
        return (0, *self.shape_tail) if self.fixed is None else self.fixed.shape


def layout_files(
    layout: Mapping[str, ArrayLayout], labels: Mapping[str, Sequence[str]]
) -> dict[str, bytes]:
    """Return the Zarr files of a run without records, by their path in the store.

    Parameters
    ----------
    layout
        Arrays by ``"group/name"``.
    labels
        Names of the entries along a dimension; ``space``, ``i`` and ``j`` are x, y, z by default.

    Raises
    ------
    ValueError
        If the layout contradicts itself.
    """
    labels = {**_LABELS, **labels}
    sizes = _check(layout, labels)
    files: dict[str, Any] = {}
    root = zarr.create_group(MemoryStore(store_dict=files))
    for group, dims in sizes.items():
        node = root.create_group(group)
        for name in sorted(dims.keys() & labels.keys()):
            _add_labels(node, name, labels[name])
        for key, array in layout.items():
            if key.startswith(f"{group}/"):
                _add_array(node, array)
    return {path: value.to_bytes() for path, value in files.items()}


def checkpoint_docs(arrays: Mapping[str, NDArray[Any]]) -> dict[str, dict[str, Any]]:
    """Return the Zarr metadata, by path, of a checkpoint: two slots, one chunk for each."""
    files: dict[str, Any] = {}
    node = zarr.create_group(MemoryStore(store_dict=files)).create_group(CHECKPOINT)
    for name, values in arrays.items():
        node.create_array(
            name,
            shape=(2, *values.shape),
            chunks=(1, *(max(1, n) for n in values.shape)),
            dtype=values.dtype,
            fill_value=0,
            compressors=None,  # the checksum of a checkpoint is in the marker
            dimension_names=["slot", *(f"{name}_axis{k}" for k in range(values.ndim))],
            **_AS_IS,
        )
    return {
        path.removesuffix("/zarr.json"): json.loads(value.to_bytes())
        for path, value in files.items()
        if path.startswith(f"{CHECKPOINT}/")
    }


def chunk_length(record_bytes: int) -> int:
    """Return how many records share a chunk (a file): 32 KiB of them, at least one."""
    return max(1, _CHUNK_BYTES // max(1, record_bytes))


def _add_array(node: zarr.Group, array: ArrayLayout) -> None:
    variable = array.variable
    dtype = np.dtype(variable.dtype)
    shape = array.shape
    chunks = tuple(max(1, n) for n in shape)
    if array.grows:
        chunks = (chunk_length(dtype.itemsize * math.prod(array.shape_tail)), *chunks[1:])
    made = node.create_array(
        variable.name,
        shape=shape,
        chunks=chunks,
        dtype=dtype,
        fill_value=fill_value(dtype),
        compressors=[Crc32cCodec()],
        attributes=dict(variable.attrs()),
        dimension_names=list(variable.dims),
        **_AS_IS,
    )
    if array.fixed is not None:
        made[...] = array.fixed.astype(dtype, casting="same_kind")


def _add_labels(node: zarr.Group, name: str, labels: Sequence[str]) -> None:
    made = node.create_array(
        name,
        shape=(len(labels),),
        chunks=(len(labels),),
        dtype=str,
        fill_value="",
        dimension_names=[name],
        compressors=None,
    )
    made[...] = np.array(labels, dtype=object)


def _check(
    layout: Mapping[str, ArrayLayout], labels: Mapping[str, Sequence[str]]
) -> dict[str, dict[str, int]]:
    """Return the size of every dimension by group; growing ones are 0."""
    sizes: dict[str, dict[str, int]] = {}
    for key, array in layout.items():
        variable = array.variable
        if key != f"{variable.group}/{variable.name}" or variable.group == CHECKPOINT:
            raise ValueError(f"{key} cannot hold the variable {variable.group}/{variable.name}")
        if array.grows == (array.fixed is not None):
            raise ValueError(f"{key}: values must be given if, and only if, it does not grow")
        if len(array.shape) != len(variable.dims):
            raise ValueError(f"{key}: shape {array.shape} does not fit axes {variable.dims}")
        if variable.unit in _TIME_WORDS:
            raise ValueError(f"{key}: unit '{variable.unit}' is changed by xarray; use 's' or such")
        known = sizes.setdefault(variable.group, {})
        for name, size in zip(variable.dims, array.shape, strict=True):
            if known.setdefault(name, size) != size:
                raise ValueError(f"{key}: {size} along '{name}', but {known[name]} before")
            if name in labels and len(labels[name]) != size:
                raise ValueError(f"{key}: {size} along '{name}', but labels {labels[name]}")
    for group, known in sizes.items():
        if all(name in known for name in GROWING):
            raise ValueError(f"group {group} cannot grow along both {GROWING}")
    return sizes
