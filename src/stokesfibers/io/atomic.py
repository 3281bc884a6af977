"""Writing files so that a kill or a full disk never spoils what was valid before.

Two ways only. `write_atomic` replaces a whole file in one step. `write_at` writes into a file of
fixed size at an offset; the caller guarantees that no valid byte lies there.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from stokesfibers.core.errors import StoreError

_FULL = (errno.ENOSPC, errno.EDQUOT)
_BINARY = getattr(os, "O_BINARY", 0)


@contextmanager
def disk_errors(path: Path) -> Iterator[None]:
    """Turn any OSError raised inside into a StoreError about the store at `path`."""
    try:
        yield
    except OSError as error:
        code = errno.errorcode.get(error.errno or 0, "unknown errno")
        hint = (
            "Free some space, then resume the run; what was committed before is intact."
            if error.errno in _FULL
            else "What was committed before is intact; mend the cause, then resume the run."
        )
        got = f"'{error.strerror or error}' ({code})"
        raise StoreError(str(path), "to write to the run store", got, hint) from error


def write_atomic(path: Path, data: bytes, sync: bool = False) -> None:
    """Replace the file `path` by `data`; readers see the old file or the new one, never a part.

    Parameters
    ----------
    path
        File to replace or make; its folder must exist. One writer at a time.
    data
        The whole new content.
    sync
        Wait until the content is on the disk before the file is replaced.

    Raises
    ------
    OSError
        If writing fails; the old file is untouched then.
    """
    part = path.with_name(f".{path.name}.partial")
    try:
        fd = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | _BINARY, 0o666)
        try:
            _write(fd, memoryview(data))
            if sync:
                os.fsync(fd)
        finally:
            os.close(fd)
        os.replace(part, path)
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def write_at(path: Path, offset: int, data: memoryview, size: int) -> None:
    """Write `data` at byte `offset` of the file `path`, which is made `size` bytes long.

    The rest of the file keeps what it holds; what was never written reads as zero. Folders are
    made as needed. Not atomic: only for bytes that no reader takes for valid yet.

    Raises
    ------
    OSError
        If writing fails; bytes outside the range are untouched then.
    """
    flags = os.O_WRONLY | os.O_CREAT | _BINARY
    try:
        fd = os.open(path, flags, 0o666)
    except FileNotFoundError:
        path.parent.mkdir(parents=True, exist_ok=True)
        fd = os.open(path, flags, 0o666)
    try:
        os.ftruncate(fd, size)
        os.lseek(fd, offset, os.SEEK_SET)
        _write(fd, data)
    finally:
        os.close(fd)


def _write(fd: int, data: memoryview) -> None:
    while data:
        data = data[os.write(fd, data) :]
