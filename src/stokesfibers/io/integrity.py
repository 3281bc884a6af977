"""Whether a store is whole: what is damaged, and what is lost with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stokesfibers.core.errors import StoreError
from stokesfibers.io import marker
from stokesfibers.io.chunks import ChunkFile, chunk_files, fault_of
from stokesfibers.io.layout import CHECKPOINT, GROWING

MISSING = "is missing"


@dataclass(frozen=True)
class Damage:
    """One chunk that cannot be read.

    Attributes
    ----------
    chunk
        Path of its file in the store.
    array
        ``"group/name"`` of the array it is of.
    fault
        What is wrong with it, e.g. ``"does not match its checksum"``.
    records
        First record that is lost with it, and the one behind the last.
    times
        First and last time that is lost, where the times themselves can be read; else None.
    """

    chunk: str
    array: str
    fault: str
    records: tuple[int, int]
    times: tuple[float, float] | None = None

    def __str__(self) -> str:
        first, last = self.records
        lost = f"records {first} to {last - 1} of {self.array}"
        if self.times is not None:
            lost += f", t = {self.times[0]:.6g} to {self.times[1]:.6g}"
        return f"{self.chunk} {self.fault}: {lost}"


def damages(path: Path) -> tuple[Damage, ...]:
    """Return what is damaged in the store at `path`: each chunk with valid values is read once.

    Checkpoints have a checksum of their own, see `RunStore.checkpoint`.

    Raises
    ------
    StoreError
        If there is no usable run of ours at `path`.
    """
    docs, _ = marker.read(path)
    found = [
        (chunk, fault)
        for name, doc in docs.items()
        if doc["node_type"] == "array" and not name.startswith(f"{CHECKPOINT}/")
        for chunk in chunk_files(name, doc)
        if (fault := _fault(path, chunk))
    ]
    lost = {chunk.name for chunk, _ in found}
    return tuple(
        Damage(c.name, c.array, fault, c.records, _times(path, docs, c, lost)) for c, fault in found
    )


def refuse_damage(path: Path) -> None:
    """Raise StoreError if a chunk of the store at `path` was changed.

    What is missing is let pass: who deleted it knows, and its records read as NaN.
    """
    found = [d for d in damages(path) if d.fault != MISSING]
    if found:
        more = f" and {len(found) - 1} more" if len(found) > 1 else ""
        raise StoreError(
            str(path),
            "a store without damage",
            f"{found[0]}{more}",
            "Put the files back from a copy, or delete them: their records then read as NaN, and "
            f"the run goes on. 'stokesfibers show {path}' lists them; the rest can be read.",
        )


def _fault(path: Path, chunk: ChunkFile) -> str:
    try:
        data = chunk.read(path)
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    return MISSING if data is None else fault_of(data, chunk)


def _times(
    path: Path, docs: Mapping[str, Mapping[str, Any]], chunk: ChunkFile, lost: set[str]
) -> tuple[float, float] | None:
    """Return the first and last time of the records of `chunk`, if they can be read."""
    name = f"{chunk.array.split('/')[0]}/time"
    if name not in docs or docs[chunk.array]["dimension_names"][:1] not in [[g] for g in GROWING]:
        return None
    found = []
    for record in (chunk.records[0], chunk.records[1] - 1):
        own = next(c for c in chunk_files(name, docs[name]) if record < c.records[1])
        data = None if own.name in lost else own.read(path)
        if data is None:
            return None
        values = np.frombuffer(data, "<f8", own.size // 8)
        found.append(float(values[record - own.records[0]]))
    return found[0], found[1]
