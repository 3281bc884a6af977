"""Records of one array that grows, in chunk files that are replaced as a whole.

The chunk files follow the Zarr v3 specification (codecs ``bytes`` and ``crc32c``, chunk keys
``c/0/0...``), so zarr reads them and refuses those that were changed. New records are added behind
the valid ones to a copy in memory, and the file is replaced atomically: a kill at any moment leaves
the valid records, and a checksum that fits. Stores of format version 1 have no checksums.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import StoreError
from stokesfibers.io.atomic import write_atomic
from stokesfibers.io.chunks import ChunkFile, fault_of, sealed


@dataclass(frozen=True)
class RecordArray:
    """An array that grows.

    Attributes
    ----------
    path
        Path in the store, ``"group/name"``.
    tail
        Shape of one record.
    dtype
        Type as stored, little-endian.
    per_chunk
        Records per chunk file.
    sealed
        Whether chunk files end with a checksum.
    """

    path: str
    tail: tuple[int, ...]
    dtype: np.dtype[Any]
    per_chunk: int
    sealed: bool

    @classmethod
    def from_doc(cls, path: str, doc: Mapping[str, Any]) -> RecordArray:
        """Return the array that the Zarr metadata `doc` describes."""
        chunk_shape = doc["chunk_grid"]["configuration"]["chunk_shape"]
        dtype = np.dtype(doc["data_type"]).newbyteorder("<")
        return cls(path, tuple(doc["shape"][1:]), dtype, chunk_shape[0], sealed(doc))

    @property
    def record_bytes(self) -> int:
        """Size of one record."""
        return self.dtype.itemsize * math.prod(self.tail)

    def prepare(self, values: object) -> NDArray[Any]:
        """Return `values` as they will be stored; ValueError if they do not fit."""
        given = np.asarray(values)
        if given.ndim == 0 or given.shape[1:] != self.tail:
            raise ValueError(f"{self.path}: expected shape (n, *{self.tail}), got {given.shape}")
        if not np.can_cast(given.dtype, self.dtype, "same_kind"):
            raise ValueError(f"{self.path}: cannot store {given.dtype} as {self.dtype.name}")
        return np.ascontiguousarray(given, dtype=self.dtype)

    def chunk(self, number: int) -> ChunkFile:
        """Return the chunk file of this number."""
        name = "/".join([self.path, "c", str(number), *["0"] * len(self.tail)])
        first = number * self.per_chunk
        size = self.per_chunk * self.record_bytes
        return ChunkFile(name, self.path, size, self.sealed, (first, first + self.per_chunk))


class RecordWriter:
    """Adds records to one array.

    Parameters
    ----------
    folder
        The store.
    array
        Which array.
    """

    def __init__(self, folder: Path, array: RecordArray) -> None:
        self.array = array
        self._folder = folder
        self._held: dict[int, bytearray] = {}  # chunks by number, the newest stays
        self._dirty: set[int] = set()

    def put(self, start: int, values: NDArray[Any]) -> None:
        """Hold `values` (from `prepare`) as the records from `start` on; full chunks are written.

        Raises
        ------
        OSError
            If writing fails; the call can be repeated.
        StoreError
            If the chunk that is to be gone on with is damaged.
        """
        array, size = self.array, self.array.record_bytes
        if size == 0 or not len(values):
            return
        data, stop = memoryview(values.tobytes()), start + len(values)
        for number in range(start // array.per_chunk, -(-stop // array.per_chunk)):
            begin = number * array.per_chunk
            first, last = max(start, begin), min(stop, begin + array.per_chunk)
            held = self._chunk(number, keeps=first > begin)
            held[(first - begin) * size : (last - begin) * size] = data[
                (first - start) * size : (last - start) * size
            ]
            self._dirty.add(number)
            if last == begin + array.per_chunk:
                self._write(number)

    def flush(self) -> None:
        """Write what is held; OSError if it fails, and the call can be repeated."""
        for number in sorted(self._dirty):
            self._write(number)
        newest = max(self._held, default=0)
        self._held = {number: held for number, held in self._held.items() if number == newest}

    def _chunk(self, number: int, *, keeps: bool) -> bytearray:
        """Return the bytes of a chunk to change; those on disk if records before them stay."""
        if number not in self._held:
            chunk = self.array.chunk(number)
            found = chunk.read(self._folder) if keeps else None
            if found is not None and (fault := fault_of(found, chunk)):
                raise StoreError(
                    str(self._folder),
                    "an intact chunk to go on with",
                    f"'{chunk.name}', which {fault}",
                    "Put the file back from a copy, or delete it: its records then read as NaN.",
                )
            held = bytearray(chunk.filling(self.array.dtype) if keeps else chunk.size)
            if found is not None:
                held[:] = found[: chunk.size]
            self._held[number] = held
        return self._held[number]

    def _write(self, number: int) -> None:
        chunk = self.array.chunk(number)
        file = self._folder / chunk.name
        data = chunk.seal(bytes(self._held[number]))
        try:
            write_atomic(file, data)
        except FileNotFoundError:
            file.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(file, data)
        self._dirty.discard(number)


def count_records(
    arrays: Mapping[str, RecordArray], values: Mapping[str, NDArray[Any]]
) -> dict[str, int]:
    """Return how many records `values` adds to each group.

    Raises
    ------
    ValueError
        If not all `arrays` of a group get the same number of records.
    """
    counts: dict[str, int] = {}
    for group in {path.split("/")[0] for path in values}:
        paths = [path for path in arrays if path.startswith(f"{group}/")]
        missing = [path for path in paths if path not in values]
        if missing:
            raise ValueError(f"records of group {group} lack {missing}")
        numbers = {len(values[path]) for path in paths}
        if len(numbers) > 1:
            raise ValueError(f"records of group {group} differ in number: {sorted(numbers)}")
        counts[group] = numbers.pop()
    return counts
