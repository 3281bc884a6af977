"""A folder of zarr's in which a changed chunk has a name. Slow to import, as zarr's stores are."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import final

from zarr.abc.store import ByteRequest
from zarr.core.buffer import Buffer, BufferPrototype
from zarr.storage import LocalStore

from stokesfibers.io import marker
from stokesfibers.io.chunks import ChunkFile, chunk_files, refuse_damaged
from stokesfibers.io.layout import CHECKPOINT


@final
class CheckedStore(LocalStore):
    """The folder of a run, to read.

    Parameters
    ----------
    root
        The folder.
    docs
        Zarr metadata of everything in it, by path.
    """

    def __init__(self, root: Path, docs: marker.Docs) -> None:
        super().__init__(root, read_only=True)
        self._chunks: dict[str, ChunkFile] = {
            chunk.name: chunk
            for name, doc in docs.items()
            if doc["node_type"] == "array" and not name.startswith(f"{CHECKPOINT}/")
            for chunk in chunk_files(name, doc)
        }

    async def get(
        self,
        key: str,
        prototype: BufferPrototype | None = None,
        byte_range: ByteRequest | None = None,
    ) -> Buffer | None:
        """Return the bytes of `key`, looked at before zarr decodes them."""
        found = await super().get(key, prototype, byte_range)
        chunk = self._chunks.get(key)
        if chunk is None or byte_range is not None:
            return found
        if found is None:
            first, last = chunk.records
            lost = f"records {first} to {last - 1} of {chunk.array} read as NaN"
            warnings.warn(f"{self.root}: {key} is missing; {lost}", stacklevel=2)
        else:
            refuse_damaged(self.root, found.to_bytes(), chunk)
        return found
