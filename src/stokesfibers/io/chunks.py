"""Chunk files and their checksums: CRC-32C behind the bytes, as Zarr's codec of that name."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import google_crc32c  # of zarr, whose codec it is
import numpy as np

from stokesfibers.core.errors import StoreError

CODEC = "crc32c"
SEAL = 4
"""Bytes of the checksum."""


@dataclass(frozen=True)
class ChunkFile:
    """One chunk of an array, as a file.

    Attributes
    ----------
    name
        Path in the store.
    array
        Path of its array, ``"group/name"``.
    size
        Bytes of its values.
    sealed
        Whether a checksum follows them.
    records
        First record and the one behind the last, along the first axis.
    """

    name: str
    array: str
    size: int
    sealed: bool
    records: tuple[int, int]

    def read(self, folder: Path) -> bytes | None:
        """Return the bytes of the file, or None if there is none."""
        try:
            return (folder / self.name).read_bytes()
        except FileNotFoundError:
            return None

    def seal(self, values: bytes) -> bytes:
        """Return the bytes of the file that holds `values`."""
        return values + _checksum(values) if self.sealed else values

    def filling(self, dtype: np.dtype[Any]) -> bytes:
        """Return values that nobody takes for results: those of a chunk that was lost."""
        return np.full(self.size // dtype.itemsize, fill_value(dtype), dtype).tobytes()


def fill_value(dtype: np.dtype[Any]) -> float | int:
    """Return what stands for a value that is not there."""
    return float("nan") if dtype.kind == "f" else -1


def sealed(doc: Mapping[str, Any]) -> bool:
    """Return whether the chunks of the array with the Zarr metadata `doc` have checksums."""
    return any(codec["name"] == CODEC for codec in doc["codecs"])


def fault_of(data: bytes, chunk: ChunkFile) -> str:
    """Return what is wrong with the bytes of a chunk file, e.g. ``"is ..."``; empty if nothing."""
    whole = chunk.size + (SEAL if chunk.sealed else 0)
    if len(data) != whole:
        return f"has {len(data)} bytes instead of {whole}"
    if chunk.sealed and _checksum(data[: chunk.size]) != data[chunk.size :]:
        return "does not match its checksum"
    return ""


def chunk_files(path: str, doc: Mapping[str, Any]) -> Iterator[ChunkFile]:
    """Yield the chunk files that hold valid values of an array of numbers; `doc` is its metadata.

    Only arrays that are cut along their first axis, as all of a run are.
    """
    shape = tuple(doc["shape"])
    chunks = tuple(doc["chunk_grid"]["configuration"]["chunk_shape"])
    if 0 in shape or doc["data_type"] == "string":
        return
    size = np.dtype(doc["data_type"]).itemsize * math.prod(chunks)
    for k in range(-(-shape[0] // chunks[0]) if shape else 1):
        name = "/".join([path, "c", *([str(k), *["0"] * (len(shape) - 1)] if shape else [])])
        first = k * chunks[0] if shape else 0
        last = min(shape[0], first + chunks[0]) if shape else 1
        yield ChunkFile(name, path, size, sealed(doc), (first, last))


def refuse_damaged(folder: Path, data: bytes, chunk: ChunkFile) -> None:
    """Raise StoreError, with the name of the chunk, if its bytes are not those written."""
    fault = fault_of(data, chunk)
    if fault:
        first, last = chunk.records
        raise StoreError(
            str(folder),
            f"intact values of '{chunk.array}'",
            f"the damaged chunk '{chunk.name}', which {fault} (records {first} to {last - 1})",
            f"'stokesfibers show {folder}' tells what is lost; the rest can be read.",
        )


def _checksum(values: bytes) -> bytes:
    return int(google_crc32c.value(values)).to_bytes(SEAL, "little")
