"""A writer killed at any moment leaves a store that is exactly what its last commit says."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray
import zarr

from stokesfibers.io.reader import open_run
from stokesfibers.io.store import RunStore

# The writer: every value is a function of its index, every length one of the number of commits.
WRITER = """
import os, random, shutil, signal, sys, time
import numpy as np
from stokesfibers.core.variables import Variable
from stokesfibers.io import layout
from stokesfibers.io.checkpoint import Checkpoint
from stokesfibers.io.layout import ArrayLayout
from stokesfibers.io.store import RunStore

layout._CHUNK_BYTES = 2000  # many chunks, so that kills meet their borders
TAILS = {"trajectory": {"time": (), "x": (40, 3)}, "observables": {"time": (), "e": (2,)}}

def values(group, name, start, stop):
    tail = TAILS[group][name]
    index = np.arange(start, stop).reshape(-1, *[1] * len(tail))
    return np.sin(index + np.arange(np.prod(tail, dtype=int)).reshape(tail))

def grown(commits):
    return {"trajectory": 2 * commits, "observables": 7 * commits}

def checkpoint(commits):
    return Checkpoint({"x": np.cos(commits + np.arange(3000.0))}, {"commits": commits})

def write(path, resume, report):
    if resume and os.path.exists(path):
        store = RunStore.open(path, "a")
        saved = store.checkpoint()
        commits = saved.meta["commits"] if saved else 0
        store.truncate(grown(commits), {"commits": commits})
    else:
        dims = {"x": ("node", "space"), "e": ("fiber",), "time": ()}
        arrays = {
            f"{g}/{n}": ArrayLayout(Variable(n, g, ("time", *dims[n]), "1", n, n), tail)
            for g, names in TAILS.items() for n, tail in names.items()
        }
        store, commits = RunStore.create(path, arrays, {}, overwrite=not resume), 0
    while True:
        old, new = grown(commits), grown(commits + 1)
        for g in TAILS:
            store.append({f"{g}/{n}": values(g, n, old[g], new[g]) for n in TAILS[g]})
        commits += 1
        store.commit({"commits": commits}, checkpoint(commits) if commits % 3 == 0 else None)
        os.write(report, b".")

def main(folder, resume):
    chance = random.Random(8)
    path = os.path.join(folder, "live.zarr")
    for k, commits in enumerate([0, 4, 1, 25, 0, 3, 11, 2]):
        hear, report = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                write(path, resume, report)
            finally:
                os._exit(1)
        for _ in range(commits):
            os.read(hear, 1)
        # A commit takes about 2 ms, making a store about 50.
        time.sleep(chance.uniform(0, 0.004 if commits else 0.08))
        os.kill(child, signal.SIGKILL)
        if os.waitpid(child, 0)[1] != signal.SIGKILL:
            sys.exit("the writer failed")
        if os.path.exists(path):
            shutil.copytree(path, os.path.join(folder, f"copy{k}.zarr"))
        os.close(hear)
        os.close(report)

if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2] == "resume")
"""


def _check(path: Path, writer: dict) -> int:
    """Compare a store with what the writer had committed; return the number of commits."""
    with xarray.open_datatree(path) as tree:
        commits = tree.attrs["status"].get("commits", 0)
        for group, length in writer["grown"](commits).items():
            data = tree[group].to_dataset()
            # Who reads an array by itself may see less, but nothing that is not valid.
            assert zarr.open_array(path / group / "time", mode="r").shape[0] <= length
            assert data.sizes["time"] == length
            for name in writer["TAILS"][group]:
                expected = writer["values"](group, name, 0, length)
                assert data[name].values.tobytes() == expected.tobytes(), (path, group, name)
    saved = RunStore.open(path).checkpoint()
    taken = commits - commits % 3
    assert (saved is None) == (taken == 0)
    if saved is not None:
        expected = writer["checkpoint"](taken)
        assert saved.meta == expected.meta
        assert saved.lengths == writer["grown"](taken)
        np.testing.assert_array_equal(saved.arrays["x"], expected.arrays["x"], strict=True)
    return commits


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork and SIGKILL")
@pytest.mark.parametrize("mode", ["new", "resume"])
def test_killed_at_any_moment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: str) -> None:
    from stokesfibers.io import layout

    monkeypatch.setattr(layout, "_CHUNK_BYTES", layout._CHUNK_BYTES)  # the writer changes it
    writer: dict = {"__name__": "writer"}
    exec(WRITER, writer)
    script = tmp_path / "writer.py"
    script.write_text(WRITER)
    done = subprocess.run(
        [sys.executable, str(script), str(tmp_path), mode],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    copies = sorted(tmp_path.glob("copy*.zarr"), key=lambda p: int(p.stem[4:]))
    assert len(copies) >= 6
    commits = [_check(path, writer) for path in copies]
    assert max(commits) >= 25
    if mode == "resume":
        # Nothing older than the last checkpoint is ever lost.
        assert all(b >= a - 2 for a, b in itertools.pairwise(commits))
    # The last one killed can be taken up again: its lock went with it.
    live = tmp_path / "live.zarr"
    with RunStore.open(live, "a") as store:
        assert store.status.get("commits", 0) == commits[-1]
    open_run(live)
