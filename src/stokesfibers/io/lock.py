"""One writer per run store: a locked file inside it.

The lock belongs to the open file, so it vanishes with the process that holds it, however that
ends. Where the file system has no such locks, as some that are mounted over a network, the file
itself is the guard, and whoever makes it is the holder, whose name it bears: a process that is gone
from this machine is nobody, one on another machine is believed.
"""

from __future__ import annotations

import errno
import os
import re
import socket
import sys
import time
import uuid
from contextlib import suppress
from pathlib import Path

from stokesfibers.core.errors import StoreError

if sys.platform != "win32":
    import fcntl

NAME = ".lock"
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
_NAMING_SECONDS = 0.5
_HOLDER = re.compile(r"process (\d+) on (\S+)")


def acquire(folder: Path) -> int:
    """Lock `folder` for writing and return the descriptor that holds the lock.

    Raises
    ------
    StoreError
        If another writer holds it, in this process or another.
    OSError
        If the lock file cannot be made.
    """
    while True:
        fd, made = _opened(folder / NAME)
        try:
            locked = _lock(fd)
            if locked is False or (locked is None and not made and _held(_named(fd))):
                raise StoreError(
                    str(folder),
                    "a run that nothing else is writing",
                    f"one in use by {_holder(fd)}",
                    f"Wait until it ends, or stop it. If there is no such process, delete {NAME}.",
                )
            if locked is None and not made:  # its holder is gone; one who sees that makes it anew
                _discard(fd, folder / NAME)
            # The last holder may have removed the file between our open and our lock.
            elif _same_file(fd, folder / NAME):
                with suppress(OSError):
                    os.ftruncate(fd, 0)
                    os.write(fd, f"process {os.getpid()} on {socket.gethostname()}".encode())
                return fd
        except BaseException:
            os.close(fd)
            raise
        os.close(fd)


def release(fd: int, folder: Path) -> None:
    """Give up the lock `fd` on `folder` and remove its file."""
    # Removed while still locked: whoever opened it meanwhile notices, see `acquire`.
    with suppress(OSError):
        if _same_file(fd, folder / NAME):
            (folder / NAME).unlink()
    os.close(fd)


def _opened(path: Path) -> tuple[int, bool]:
    """Open the lock file, and say whether this made it."""
    while True:
        with suppress(FileExistsError):
            return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666), True
        with suppress(FileNotFoundError):  # its holder has just removed it
            return os.open(path, os.O_RDWR), False


def _lock(fd: int) -> bool | None:
    """Lock the file; return whether nobody else has, None if there are no locks here."""
    if sys.platform == "win32":
        return True
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        return None
    return True


def _named(fd: int) -> str:
    """Return the holder; whoever has just made the file gets time to write its name."""
    end = time.monotonic() + _NAMING_SECONDS
    while _HOLDER.fullmatch(_holder(fd)) is None and time.monotonic() < end:
        time.sleep(_NAMING_SECONDS / 10.0)
    return _holder(fd)


def _discard(fd: int, path: Path) -> None:
    """Remove the file that `fd` is, but not one that somebody has put in its place."""
    if not _same_file(fd, path):
        return
    # Moved first: between the look and the move it may have been replaced.
    aside = path.with_name(f"{path.name}.{uuid.uuid4().hex[:8]}")
    with suppress(FileNotFoundError):
        path.rename(aside)
        if _same_file(fd, aside):
            aside.unlink()
        else:
            aside.rename(path)


def _held(holder: str) -> bool:
    """Return whether the holder that a lock file names may still be there."""
    named = _HOLDER.fullmatch(holder)
    if named is None:
        return False
    if named[2] != socket.gethostname():
        return True
    try:
        os.kill(int(named[1]), 0)
    except ProcessLookupError:
        return False
    except OSError:  # another user's
        return True
    return True


def _same_file(fd: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(fd), path.stat())
    except FileNotFoundError:
        return False


def _holder(fd: int) -> str:
    with suppress(OSError):
        os.lseek(fd, 0, os.SEEK_SET)
        text = os.read(fd, 200).decode(errors="replace")
        if text:
            return text
    return "another process"
