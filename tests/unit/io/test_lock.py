"""The lock: one writer, and none once that process is gone."""

from __future__ import annotations

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

    def slow(fd: int) -> bool:
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
