"""The lock: one writer, and none once that process is gone."""

from __future__ import annotations

import errno
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from stokesfibers.core.errors import StoreError
from stokesfibers.io import lock

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such locks")

HOLDER = """
import sys
from pathlib import Path
from stokesfibers.io import lock
lock.acquire(Path(sys.argv[1]))
print("held", flush=True)
sys.stdin.read()
"""


def test_lock_goes_with_its_process(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(StoreError, match=f"in use by process {holder.pid} on "):
            lock.acquire(tmp_path)
        assert (tmp_path / lock.NAME).exists()
        holder.kill()
        holder.wait()
    fd = lock.acquire(tmp_path)
    with pytest.raises(StoreError, match="in use by process"):
        lock.acquire(tmp_path)
    lock.release(fd, tmp_path)
    assert list(tmp_path.iterdir()) == []
    lock.release(lock.acquire(tmp_path), tmp_path)


def test_lock_on_a_removed_file_does_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = lock._lock
    tries = []

    def slow(fd: int) -> bool | None:
        # As if the last holder let go, and removed the file, after ours was opened.
        if not tries:
            (tmp_path / lock.NAME).unlink()
        tries.append(fd)
        return real(fd)

    monkeypatch.setattr(lock, "_lock", slow)
    fd = lock.acquire(tmp_path)
    assert len(tries) == 2
    assert (tmp_path / lock.NAME).exists()
    with pytest.raises(StoreError, match="in use"):
        lock.acquire(tmp_path)
    lock.release(fd, tmp_path)


@pytest.fixture
def no_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system without locks, as some that are mounted over a network."""

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(lock.fcntl, "flock", refuse)


@pytest.mark.usefixtures("no_locks")
def test_without_locks_only_who_makes_the_file_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # As if another had made it, and not yet written its name when ours was opened.
    (tmp_path / lock.NAME).touch()
    pauses = []

    def named_meanwhile(seconds: float) -> None:
        pauses.append(seconds)
        (tmp_path / lock.NAME).write_text(f"process {os.getpid()} on {socket.gethostname()}")

    monkeypatch.setattr(lock.time, "sleep", named_meanwhile)
    with pytest.raises(StoreError, match=f"in use by process {os.getpid()} on "):
        lock.acquire(tmp_path)
    assert len(pauses) == 1


@pytest.mark.parametrize("when", ["before the look", "after the look"])
@pytest.mark.usefixtures("no_locks")
def test_without_locks_two_who_find_a_dead_holder_do_not_both_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    file, real = tmp_path / lock.NAME, lock._same_file
    held = []
    file.write_text("proc")

    def overtaken(fd: int, path: Path) -> bool:
        same = real(fd, path) if when == "after the look" else None
        if not held:  # another, who saw the same, was faster
            held.append("process 1 on some-other-machine")
            file.unlink()
            file.write_text(held[0])
        return real(fd, path) if same is None else same

    monkeypatch.setattr(lock, "_same_file", overtaken)
    with pytest.raises(StoreError, match="process 1 on some-other-machine"):
        lock.acquire(tmp_path)
    assert file.read_text() == held[0]
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.usefixtures("no_locks")
def test_without_locks_the_name_of_the_holder_guards(tmp_path: Path) -> None:
    fd = lock.acquire(tmp_path)
    with pytest.raises(StoreError, match=f"in use by process {os.getpid()} on .*delete .lock"):
        lock.acquire(tmp_path)
    lock.release(fd, tmp_path)
    lock.release(lock.acquire(tmp_path), tmp_path)
    # one that is gone from this machine is nobody
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    (tmp_path / lock.NAME).write_text(f"process {gone.pid} on {socket.gethostname()}")
    lock.release(lock.acquire(tmp_path), tmp_path)
    # one elsewhere is believed
    (tmp_path / lock.NAME).write_text("process 1 on some-other-machine")
    with pytest.raises(StoreError, match="process 1 on some-other-machine"):
        lock.acquire(tmp_path)
    # what was torn off while it was written is nobody's
    (tmp_path / lock.NAME).write_text("proc")
    lock.release(lock.acquire(tmp_path), tmp_path)
