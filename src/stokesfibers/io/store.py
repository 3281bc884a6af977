"""The run store: a Zarr v3 folder that any reader can open at any moment of the run.

Data are written first; then one file, the marker (see `marker`), is replaced atomically and says
how much of the data is valid. A process killed at any moment, or a full disk, leaves the state of
the last commit. (After a power cut the data are as safe as the file system makes bytes that were
not waited for; what suffered is told by its checksum.)
"""

from __future__ import annotations

import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, Self, final

from stokesfibers.core.errors import StoreError
from stokesfibers.io import checkpoint as slots
from stokesfibers.io import lock, marker
from stokesfibers.io.atomic import disk_errors, write_atomic
from stokesfibers.io.checkpoint import Checkpoint
from stokesfibers.io.create import create_folder
from stokesfibers.io.integrity import refuse_damage
from stokesfibers.io.layout import ArrayLayout
from stokesfibers.io.records import RecordArray, RecordWriter, count_records


@final
class RunStore:
    """One run on disk. Make it with `RunStore.create` or `RunStore.open`.

    Attributes
    ----------
    path
        Folder of the store.
    """

    def __init__(self, path: Path, lock_fd: int | None) -> None:
        self.path = path
        self._unlock = None
        if lock_fd is not None:
            self._unlock = weakref.finalize(self, lock.release, lock_fd, path)
            self._unlock.atexit = False
        self._load()

    @classmethod
    def create(
        cls,
        path: str | Path,
        layout: Mapping[str, ArrayLayout],
        attributes: Mapping[str, Any],
        *,
        labels: Mapping[str, Sequence[str]] | None = None,
        overwrite: bool = False,
    ) -> Self:
        """Make a new run store and open it for writing.

        Parameters
        ----------
        path
            Folder to make; its parent must exist.
        layout
            All arrays, by ``"group/name"``.
        attributes
            Attributes of the root, JSON-ready.
        labels
            Names of the entries along a dimension, e.g. of ``stage``; those of ``space``, ``i``
            and ``j`` are x, y, z unless given.
        overwrite
            Replace a run that is there; anything else is never replaced.

        Raises
        ------
        StoreError
            If `path` exists and must not be replaced, its parent is missing, or writing fails.
            Nothing is left behind then.
        ValueError
            If the layout contradicts itself or the attributes are not JSON-ready.
        """
        where = Path(path).resolve()
        fd = create_folder(where, layout, attributes, labels or {}, overwrite=overwrite)
        return cls(where, fd)

    @classmethod
    def open(cls, path: str | Path, mode: Literal["r", "a"] = "r") -> Self:
        """Open an existing run, to read its state (``"r"``) or to add to it (``"a"``).

        Raises
        ------
        StoreError
            If there is no usable run of ours at `path`; with ``"a"`` also if another writer has
            it open, or if its checkpoint or another part is damaged.
        """
        where = Path(path).resolve()
        if mode == "r":
            return cls(where, None)
        if mode != "a":
            raise ValueError(f"mode must be 'r' or 'a', not {mode!r}")
        marker.read(where)
        with disk_errors(where):
            store = cls(where, lock.acquire(where))
        try:
            store.checkpoint()
            refuse_damage(where)
            # A kill may have come between the marker and the copies.
            with disk_errors(where):
                marker.write_copies(where, store._docs)
        except BaseException:
            store.close()
            raise
        return store

    def _load(self) -> None:
        docs, attributes = marker.read(self.path)
        self._docs: marker.Docs = docs
        self._marked = {key: attributes.get(key) for key in ("status", "checkpoint")}
        self._attributes = {k: v for k, v in attributes.items() if k not in marker.RESERVED}
        self._arrays = {
            path: RecordArray.from_doc(path, doc)
            for path, doc in marker.growing(self._docs).items()
        }
        self._writers = {p: RecordWriter(self.path, array) for p, array in self._arrays.items()}
        self._lengths = marker.lengths(self._docs)
        self._appended = dict(self._lengths)

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the root, without those of the store itself."""
        return dict(self._attributes)

    @property
    def status(self) -> dict[str, Any]:
        """Status as of the last commit."""
        return dict(self._marked["status"] or {})

    @property
    def lengths(self) -> dict[str, int]:
        """Number of valid (committed) records of each group that grows."""
        return dict(self._lengths)

    @property
    def names(self) -> frozenset[str]:
        """What can be appended, as ``"group/name"``."""
        return frozenset(self._arrays)

    def set_attributes(self, attributes: Mapping[str, Any]) -> None:
        """Add or replace attributes of the root; valid from the next commit on."""
        self._attributes.update(marker.user_attributes(attributes))

    def append(self, records: Mapping[str, Any]) -> None:
        """Add records behind those there; they are valid from the next `commit` on.

        Parameters
        ----------
        records
            Arrays of shape (record, ...) by ``"group/name"``. Of each group named, all arrays
            that grow, with the same number of records.

        Raises
        ------
        ValueError
            If arrays are missing, unknown or do not fit; nothing is written then.
        StoreError
            As of `commit`: chunks that are full are written at once.
        """
        self._check_writable()
        unknown = records.keys() - self._arrays.keys()
        if unknown:
            raise ValueError(f"not arrays that grow in this store: {sorted(unknown)}")
        ready = {path: self._arrays[path].prepare(values) for path, values in records.items()}
        counts = count_records(self._arrays, ready)
        with disk_errors(self.path):
            for path, values in ready.items():
                self._writers[path].put(self._appended[path.split("/")[0]], values)
        for group, count in counts.items():
            self._appended[group] += count

    def commit(self, status: Mapping[str, Any], checkpoint: Checkpoint | None = None) -> None:
        """Make all that was appended valid, with a status and, if given, a new checkpoint.

        Raises
        ------
        ValueError
            If status or checkpoint cannot be stored, or the checkpoint's arrays changed.
        StoreError
            If writing fails; the store then holds the last state, or the new one, as a whole,
            and the call can be repeated.
        """
        self._check_writable()
        marked = {**self._marked, "status": marker.json_ready(marker.finite(status), "status")}
        with disk_errors(self.path):
            for writer in self._writers.values():
                writer.flush()
        docs = self._docs
        if checkpoint is not None:
            with disk_errors(self.path):
                docs, marked["checkpoint"] = slots.write_next(
                    self.path, checkpoint, docs, last=marked["checkpoint"], lengths=self._appended
                )
        self._mark(docs, marked, self._appended)

    def truncate(self, lengths: Mapping[str, int], status: Mapping[str, Any] | None = None) -> None:
        """Drop the records behind the first ones; valid at once.

        Parameters
        ----------
        lengths
            Records to keep, by group. Groups not named keep all that was committed; what was
            appended since is dropped everywhere.
        status
            Of what is kept; None leaves the status as it is.

        Raises
        ------
        ValueError
            If a length is not in reach, or less than the checkpoint goes with.
        """
        self._check_writable()
        least = (self._marked["checkpoint"] or {}).get("lengths", {})
        for group, length in lengths.items():
            have = self._lengths.get(group, -1)
            if not least.get(group, 0) <= length <= have:
                raise ValueError(
                    f"group {group} cannot be cut to {length} records: it has {have}, and the "
                    f"checkpoint goes with {least.get(group, 0)}"
                )
        kept, marked = {**self._lengths, **lengths}, dict(self._marked)
        if status is not None:
            marked["status"] = marker.json_ready(marker.finite(status), "status")
        # The copies first: they must never call valid what is overwritten later.
        with disk_errors(self.path):
            marker.write_copies(self.path, marker.with_lengths(self._docs, kept))
        self._mark(self._docs, marked, kept)

    def checkpoint(self) -> Checkpoint | None:
        """Return the last checkpoint, or None if none was taken.

        Raises
        ------
        StoreError
            If its bytes are not those that were written.
        """
        while True:
            entry = self._marked["checkpoint"]
            if entry is None:
                return None
            try:
                arrays = slots.read_slot(self.path, entry["slot"], self._docs)
                if slots.digest(arrays, entry["meta"]) != entry["sha256"]:
                    raise slots.damaged(
                        self.path, f"checksum of slot {entry['slot']} does not match"
                    )
                return Checkpoint(arrays, entry["meta"], entry["lengths"])
            except StoreError:
                # While we read, a live run may have moved on and reused the slot.
                if self._unlock is not None:
                    raise
                self._load()
                if self._marked["checkpoint"] == entry:
                    raise

    def close(self) -> None:
        """Let other writers in; what was not committed is dropped."""
        if self._unlock is not None and self._unlock.alive:
            # Only a convenience for readers, so not worth an error on a full disk.
            with suppress(OSError):
                marker.write_copies(self.path, self._docs)
            self._unlock()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _check_writable(self) -> None:
        if self._unlock is None or not self._unlock.alive:
            raise StoreError(str(self.path), "a store open for writing", "one closed or read-only")

    def _mark(
        self,
        docs: marker.Docs,
        marked: Mapping[str, dict[str, Any] | None],
        lengths: Mapping[str, int],
    ) -> None:
        docs = marker.with_lengths(docs, lengths)
        data = marker.encode(docs, {**self._attributes, **marked})
        with disk_errors(self.path):
            write_atomic(self.path / marker.NAME, data, sync=True)
        self._docs, self._marked = docs, dict(marked)
        self._lengths, self._appended = dict(lengths), dict(lengths)
