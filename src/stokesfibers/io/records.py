"""Records of one array that grows, written in place into its chunk files.

The chunk files follow the Zarr v3 specification (codec ``bytes``, chunk keys ``c/0/0...``), so
zarr reads them. A record is written behind the valid ones and never over them: a kill at any
moment leaves the valid bytes untouched.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.io.atomic import write_at


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
    """

    path: str
    tail: tuple[int, ...]
    dtype: np.dtype[Any]
    per_chunk: int

    @classmethod
    def from_doc(cls, path: str, doc: Mapping[str, Any]) -> RecordArray:
        """Return the array that the Zarr metadata `doc` describes."""
        chunk_shape = doc["chunk_grid"]["configuration"]["chunk_shape"]
        dtype = np.dtype(doc["data_type"]).newbyteorder("<")
        return cls(path, tuple(doc["shape"][1:]), dtype, chunk_shape[0])

    def prepare(self, values: object) -> NDArray[Any]:
        """Return `values` as they will be stored; ValueError if they do not fit."""
        given = np.asarray(values)
        if given.ndim == 0 or given.shape[1:] != self.tail:
            raise ValueError(f"{self.path}: expected shape (n, *{self.tail}), got {given.shape}")
        if not np.can_cast(given.dtype, self.dtype, "same_kind"):
            raise ValueError(f"{self.path}: cannot store {given.dtype} as {self.dtype.name}")
        return np.ascontiguousarray(given, dtype=self.dtype)

    def write(self, folder: Path, start: int, values: NDArray[Any]) -> None:
        """Write `values` (from `prepare`) as the records from `start` on; OSError if it fails."""
        size = self.dtype.itemsize * math.prod(self.tail)
        if size == 0:
            return
        data = memoryview(values.tobytes())
        stop = start + len(values)
        for chunk in range(start // self.per_chunk, -(-stop // self.per_chunk)):
            first = max(start, chunk * self.per_chunk)
            last = min(stop, (chunk + 1) * self.per_chunk)
            write_at(
                folder / self.path / "/".join(["c", str(chunk), *["0"] * len(self.tail)]),
                (first - chunk * self.per_chunk) * size,
                data[(first - start) * size : (last - start) * size],
                self.per_chunk * size,
            )


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
