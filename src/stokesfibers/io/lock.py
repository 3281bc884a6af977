"""One writer per run store: a locked file inside it.

The lock belongs to the open file, so it vanishes with the process that holds it, however that
ends. Where the file system has no such locks, as some that are mounted over a network, the name of
the holder in the file is the guard: a process that is gone from this machine is nobody, one on
another machine is believed.
"""

from __future__ import annotations

import errno
import os
import re
import socket
import sys
from contextlib import suppress
from pathlib import Path

from stokesfibers.core.errors import StoreError

if sys.platform != "win32":
    import fcntl

NAME = ".lock"
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
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
        fd = os.open(folder / NAME, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not _lock(fd):
                raise StoreError(
                    str(folder),
                    "a run that nothing else is writing",
                    f"one in use by {_holder(fd)}",
                    f"Wait until it ends, or stop it. If there is no such process, delete {NAME}.",
                )
            # The last holder may have removed the file between our open and our lock.
            if _same_file(fd, folder / NAME):
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


def _lock(fd: int) -> bool:
    if sys.platform == "win32":
        return True
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        return not _held(_holder(fd))
    return True


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
