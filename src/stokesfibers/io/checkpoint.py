"""Checkpoints: named arrays in two slots that take turns, with a checksum.

The slot that counts is named by the marker, so the last checkpoint stays whole until the next
one is. The bytes of a slot are one plain chunk file per array.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import StoreError
from stokesfibers.io import marker
from stokesfibers.io.atomic import write_at
from stokesfibers.io.layout import CHECKPOINT, checkpoint_docs

_DTYPES = ("float64", "int64")


@dataclass(frozen=True)
class Checkpoint:
    """All that is needed to go on with a run.

    Attributes
    ----------
    arrays
        float64 or int64 arrays by name; names, shapes and types stay the same over a run.
    meta
        Anything else, as JSON-ready values.
    lengths
        Number of valid records of each group when it was taken; filled in by the store.
    """

    arrays: Mapping[str, NDArray[Any]]
    meta: Mapping[str, Any] = field(default_factory=dict)
    lengths: Mapping[str, int] = field(default_factory=dict)


def prepare(arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return the arrays as little-endian C-contiguous ones; ValueError for another type."""
    ready = {}
    for name, values in arrays.items():
        values = np.asarray(values)
        if values.dtype.name not in _DTYPES:
            raise ValueError(f"checkpoint array {name}: {values.dtype}, not one of {_DTYPES}")
        # Not ascontiguousarray: it would make a scalar one-dimensional.
        ready[name] = np.asarray(values, dtype=values.dtype.newbyteorder("<"), order="C")
    return ready


def digest(arrays: Mapping[str, NDArray[Any]], meta: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the names, types, shapes and bytes of `arrays`, and of `meta`."""
    total = hashlib.sha256(json.dumps(meta, sort_keys=True).encode())
    for name in sorted(arrays):
        values = arrays[name]
        total.update(f"\n{name} {values.dtype.name} {values.shape}\n".encode())
        total.update(values.tobytes())
    return total.hexdigest()


def write_slot(folder: Path, slot: int, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write `arrays` to a slot that does not count; `folder` is the store. OSError if it fails."""
    for name, values in arrays.items():
        if values.size:
            data = memoryview(values.tobytes())
            write_at(_chunk(folder, name, slot, values.ndim), 0, data, len(data))


def write_next(
    folder: Path,
    checkpoint: Checkpoint,
    docs: marker.Docs,
    *,
    last: Mapping[str, Any] | None,
    lengths: Mapping[str, int],
) -> tuple[marker.Docs, dict[str, Any]]:
    """Write a checkpoint to the slot that does not count.

    Returns
    -------
    The metadata of the whole store, with that of the checkpoint, and the marker's entry for it, as
    `last` is for the one before: None for none.

    Raises
    ------
    ValueError
        If it cannot be stored, or its arrays changed since the last one.
    OSError
        If writing fails.
    """
    arrays = prepare(checkpoint.arrays)
    meta = marker.json_ready(checkpoint.meta, "checkpoint meta")
    if last is None:
        docs = {**docs, **checkpoint_docs(arrays)}
    else:
        check_unchanged(arrays, docs)
    slot = 0 if last is None else 1 - last["slot"]
    write_slot(folder, slot, arrays)
    if last is None:
        write_slot(folder, 1, arrays)  # the other slot must not show fill values to readers
    digested = {"slot": slot, "sha256": digest(arrays, meta), "meta": meta}
    return docs, {**digested, "lengths": dict(lengths)}


def read_slot(
    folder: Path, slot: int, docs: Mapping[str, Mapping[str, Any]]
) -> dict[str, NDArray[Any]]:
    """Return the arrays of a slot; `docs` is the metadata of the whole store.

    Raises
    ------
    StoreError
        If a file is missing or of the wrong size.
    """
    arrays = {}
    for name, (shape, dtype) in _stored(docs).items():
        chunk = _chunk(folder, name, slot, len(shape))
        try:
            data = b"" if 0 in shape else chunk.read_bytes()
            values = np.frombuffer(data, dtype.newbyteorder("<")).reshape(shape)
        except (OSError, ValueError) as error:
            raise damaged(folder, f"array '{name}' cannot be read ({error})") from error
        arrays[name] = values.astype(dtype)
    return arrays


def check_unchanged(
    arrays: Mapping[str, NDArray[Any]], docs: Mapping[str, Mapping[str, Any]]
) -> None:
    """Raise ValueError if names, shapes or types of `arrays` are not those stored so far."""
    stored = _stored(docs)
    given = {name: (values.shape, np.dtype(values.dtype.name)) for name, values in arrays.items()}
    changed = sorted(n for n in stored.keys() | given.keys() if stored.get(n) != given.get(n))
    if changed:
        raise ValueError(f"names, shapes and types of checkpoints must stay: {changed} changed")


def _stored(
    docs: Mapping[str, Mapping[str, Any]],
) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    return {
        path.split("/")[1]: (tuple(doc["shape"][1:]), np.dtype(doc["data_type"]))
        for path, doc in docs.items()
        if doc["node_type"] == "array" and path.startswith(f"{CHECKPOINT}/")
    }


def damaged(folder: Path, what: str) -> StoreError:
    """Return the error for a checkpoint that cannot be used."""
    return StoreError(
        str(folder),
        "an intact checkpoint",
        f"a damaged one: {what}",
        "The run cannot be resumed; its records can still be read, with open_run.",
    )


def _chunk(folder: Path, name: str, slot: int, ndim: int) -> Path:
    return folder / CHECKPOINT / name / "/".join(["c", str(slot), *["0"] * ndim])
