"""Sweeps on several processes and on a cluster: the same bits, stops, kills, lost workers."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import xarray as xr

import stokesfibers as sf
from support import assert_same

PROGRAM = [sys.executable, "-c", "from stokesfibers.cli.main import main; main()"]
SWEEP = """\
[case]
fiber.slenderness = 1e-2
flow = {{kind = "oscillatory_shear", amplitude = 1.5, frequency = 2.0}}
initial = {{kind = "nearly_straight", angle = 2.3, amplitude = 0.2}}
stepping = {{rtol = 1e-3, until = {until}}}
record = {{positions_every = 0.5, observables_every = 0.05, checkpoint_every = 1.0}}

[grid]
fluid.mu_bar = [1e3, 1e4, 2e4]

[collect]
mean = ["shear_stress"]
"""
SHORT, LONG, ENDLESS = 2.0, 80.0, 1e6
_SECONDS = 240.0


def _file(folder: Path, until: float) -> Path:
    path = folder / "sweep.toml"
    path.write_text(SWEEP.format(until=until))
    return path


def _command(*words: object) -> subprocess.CompletedProcess[str]:
    call = [*PROGRAM, "sweep", *map(str, words)]
    return subprocess.run(call, capture_output=True, text=True, timeout=_SECONDS)


def _until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + _SECONDS
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def _states(out: Path) -> list[dict[str, object]]:
    return json.loads(_command("status", out, "--json").stdout)["states"]


def _assert_same_runs(out: Path, whole: Path) -> None:
    names = sorted(p.name for p in (whole / "runs").glob("*.zarr"))
    assert len(names) == 3
    for name in names:
        assert_same(sf.open_run(out / "runs" / name), sf.open_run(whole / "runs" / name))
    one, other = (xr.open_zarr(p / "sweep.zarr")["shear_stress_mean"].load() for p in (out, whole))
    assert one.to_numpy().tobytes() == other.to_numpy().tobytes()


def _reached(out: Path, least: float) -> bool:
    """Return whether some run of the sweep has gone so far and is not done."""
    for marker in (out / "runs").glob("*.zarr/zarr.json"):
        status = json.loads(marker.read_text())["attributes"]["status"]
        if status["code"] == "running" and status["time"] >= least:
            return True
    return False


@contextmanager
def _child(*words: object) -> Iterator[subprocess.Popen[str]]:
    """Run a command in a process group of its own, which is gone at the end."""
    child = subprocess.Popen(
        list(map(str, words)),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        yield child
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
        child.communicate()


def test_workers_change_no_bit(tmp_path):
    file = _file(tmp_path, SHORT)
    for workers in (1, 2):
        result = _command(file, "--out", tmp_path / str(workers), "--workers", workers)
        assert result.returncode == 0, result.stderr
        assert result.stderr.count("] done: ") == 3
    _assert_same_runs(tmp_path / "2", tmp_path / "1")


@pytest.fixture(scope="module")
def long_file(tmp_path_factory):
    """A sweep file of some seconds."""
    return _file(tmp_path_factory.mktemp("long"), LONG)


@pytest.fixture(scope="module")
def whole(long_file):
    """The folder of the sweep that nothing disturbed."""
    out = long_file.with_name("whole")
    assert _command(long_file, "--out", out, "--workers", 1).returncode == 0
    return out


@pytest.mark.slow
def test_ctrl_c_on_the_whole_group_stops_cleanly_and_goes_on_bitwise(long_file, whole, tmp_path):
    out = tmp_path / "out"
    with _child(*PROGRAM, "sweep", long_file, "--out", out, "--workers", 2) as child:
        _until(lambda: _reached(out, 3.0))
        os.killpg(child.pid, signal.SIGINT)  # as a terminal does: to the workers too
        said, _ = child.communicate(timeout=_SECONDS)
    assert child.returncode == 130, said
    assert "Interrupted" in said
    assert "Traceback" not in said
    assert xr.open_zarr(out / "sweep.zarr").attrs["status"] == "interrupted"
    begun = [s for s in _states(out) if s["status"] == "interrupted"]
    assert begun
    for state in begun:
        assert sf.open_run(state["run"]).attrs["status"]["code"] == "interrupted"
    result = _command(long_file, "--out", out, "--workers", 2)
    assert result.returncode == 0, result.stderr
    _assert_same_runs(out, whole)


@pytest.mark.slow
def test_kills_of_the_whole_sweep_lose_nothing_beyond_the_last_checkpoints(
    long_file, whole, tmp_path
):
    out = tmp_path / "out"
    for least in (2.0, 20.0, 50.0):
        with _child(*PROGRAM, "sweep", long_file, "--out", out, "--workers", 2) as child:
            _until(lambda least=least: child.poll() is not None or _reached(out, least))
            if child.poll() is None:
                os.killpg(child.pid, signal.SIGKILL)
        states = {str(s["run"]): s for s in _states(out)}
        assert len(states) == 3
        assert not [s for s in states.values() if s["status"] in ("failed", "running")]
        assert max(float(s["time"]) for s in states.values()) >= least
    result = _command(long_file, "--out", out, "--workers", 2)
    assert result.returncode == 0, result.stderr
    _assert_same_runs(out, whole)
    resumed = [json.loads(sf.open_run(run).attrs.get("resumed", "[]")) for run in states]
    assert any(start["from_time"] >= 2.0 for starts in resumed for start in starts)


@pytest.mark.slow
def test_workers_of_a_killed_sweep_end_too(tmp_path):
    file, out = _file(tmp_path, ENDLESS), tmp_path / "out"
    with _child(*PROGRAM, "sweep", file, "--out", out, "--workers", 2) as child:
        _until(lambda: _reached(out, 2.0))
        child.kill()
        child.wait()
        _until(lambda: not _alive(child.pid))


def _alive(group: int) -> list[str]:
    """Return the processes of a group that have not ended."""
    found = subprocess.run(["ps", "-eo", "pgid,stat,args"], capture_output=True, text=True)
    rows = (line.split(None, 2) for line in found.stdout.splitlines()[1:])
    return [row[2] for row in rows if row[0] == str(group) and not row[1].startswith("Z")]


@pytest.mark.slow
def test_a_second_sweep_on_the_folder_is_refused(tmp_path):
    file, out = _file(tmp_path, ENDLESS), tmp_path / "out"
    with _child(*PROGRAM, "sweep", file, "--out", out, "--workers", 1) as child:
        _until(lambda: _reached(out, 1.0))
        result = _command(file, "--out", out, "--workers", 1)
        assert result.returncode == 2
        assert "a folder where no sweep is running, got one in use by process" in result.stderr
        assert _command("status", out).stdout.startswith("running: ")
        os.kill(child.pid, signal.SIGTERM)
        child.communicate(timeout=_SECONDS)
    assert child.returncode == 130


@pytest.mark.slow
def test_a_cluster_is_used_and_outlives_the_sweep(long_file, whole, tmp_path):
    out, address = tmp_path / "out", tmp_path / "scheduler.json"
    scheduler = (sys.executable, "-m", "distributed.cli.dask_scheduler")
    worker = (sys.executable, "-m", "distributed.cli.dask_worker")
    where = ("--scheduler-file", address)
    local = ("--host", "127.0.0.1")
    with (
        _child(*scheduler, *local, "--port", 0, "--no-dashboard", *where),
        _child(*worker, *local, *where, "--nthreads", 1, "--no-dashboard"),
    ):
        _until(address.exists)
        _until(lambda: bool(address.read_text()))
        at = json.loads(address.read_text())["address"]
        with _child(*PROGRAM, "sweep", long_file, "--out", out, "--scheduler", at) as child:
            _until(lambda: _reached(out, 3.0))
            child.kill()  # the worker does not notice, and goes on with its case
            child.wait()
        result = _command(long_file, "--out", out, "--scheduler", at)
        assert result.returncode == 0, result.stderr
        _assert_same_runs(out, whole)
    result = _command(_file(tmp_path, SHORT), "--out", tmp_path / "no", "--scheduler", at)
    assert result.returncode == 2
    assert "--scheduler: expected the address of a scheduler" in result.stderr


@pytest.mark.slow
def test_a_case_that_kills_its_worker_stops_no_other(tmp_path):
    (tmp_path / "flow.py").write_text(
        "import os\nfrom multiprocessing import parent_process\ndef velocity(x, t):\n"
        "    if t > 0.5 and parent_process():\n        os._exit(1)\n    return 0.0 * x\n"
    )
    file = _file(tmp_path, SHORT)
    swept = '[[cases]]\nname = "sound"\n[[cases]]\nname = "deadly"\n'
    swept += 'flow = {kind = "python", file = "flow.py"}\n'
    text = file.read_text().replace("[grid]\nfluid.mu_bar = [1e3, 1e4, 2e4]\n", swept)
    file.write_text(text.replace("[case]\n", "[case]\nfluid.mu_bar = 1e3\n"))
    out = tmp_path / "out"
    result = _command(file, "--out", out, "--workers", 2, "--allow-python")
    assert result.returncode == 3, result.stderr
    assert "Its worker process died" in result.stderr
    assert {str(s["values"]): s["status"] for s in _states(out)}["{}"] == "done"
    assert xr.open_zarr(out / "sweep.zarr").attrs["failed"] == 1
