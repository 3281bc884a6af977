"""Faults from outside: kills and Ctrl-C at any moment, full and read-only disks, clocks that jump.

``test_restart`` and ``test_suspension_kill`` look at single kills closely; this is the campaign:
many kills over `run` and `resume`, nothing lost beyond the last interval, and the end bitwise that
of a run nobody disturbed.
"""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from click.testing import Result as ClickResult

from stokesfibers.cli.main import main
from stokesfibers.io.reader import open_run
from support import assert_same

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs fork and signals")

KILLS, FEW = 200, 5
INTERRUPTS, FEW_INTERRUPTS = 20, 3
CASE = """\
fluid.mu_bar = 2e4
flow = {kind = "shear", rate = 2.0}
initial = {kind = "nearly_straight", angle = 2.3, amplitude = 0.2}
fiber.slenderness = 1e-2
"""
ENGINES = {
    "paper": """\
engine = "paper"
discretization.intervals = 20
stepping = {dt = 0.01, until = 2.0}
record = {positions_every = 0.05, observables_every = 0.01, checkpoint_every = 0.1}
""",
    "spectral": """\
engine = "spectral"
discretization = {nodes = 8, adapt_nodes = true}
stepping = {rtol = 1e-5, until = 2.0}
record = {positions_every = 0.02, observables_every = 0.004, checkpoint_every = 0.06}
""",
}
# A child runs or resumes and tells the time after each step; it is killed at a random moment. The
# parent looks at what is left before it lets another child go on.
CAMPAIGN = """
import os, random, signal, struct, sys, time
from pathlib import Path
import numpy as np
from stokesfibers.config.case import load_case
from stokesfibers.io.integrity import damages
from stokesfibers.io.reader import open_run
from stokesfibers.io.store import RunStore
from stokesfibers.run import recorder
from stokesfibers.run.simulate import resume, simulate

recorder.LEAST_COMMIT_SECONDS = 0.0  # as for a run that takes longer than that between records
folder, kills = Path(sys.argv[1]), int(sys.argv[2])
case = load_case(folder / "case.toml")
interval = case.record.positions_every
chance = random.Random(int(sys.argv[3]))

def go(out, watch=None):
    if out.exists():
        return resume(out, threads=1, watch=watch)
    return simulate(case.problem, case.curves(), until=case.until, record=case.record, out=out,
                    case=case.tables(), threads=1, watch=watch)

moments = []
began = time.perf_counter()
go(folder / "whole.zarr", lambda _: moments.append(time.perf_counter()))
step, making = (moments[-1] - moments[0]) / len(moments), moments[0] - began
whole = open_run(folder / "whole.zarr")["trajectory"]["position"].to_numpy()
done, finished, number, lost = 0, 0, 0, []
live = folder / "live0.zarr"
while done < kills:
    hear, report = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(hear)
        code = 1
        try:
            status = go(live, lambda m: os.write(report, struct.pack("d", m.time))).status
            code = 0 if status.code == "done" else 1
        finally:
            os._exit(code)
    os.close(report)
    told = b""
    for _ in range(chance.choice((0, 0, 1, 5, 20))):
        told += os.read(hear, 8)
    time.sleep(chance.uniform(0.0, 6.0 * step if told else min(making, 0.1)))
    os.kill(child, signal.SIGKILL)
    ended = os.waitpid(child, 0)[1]
    while part := os.read(hear, 1 << 16):
        told += part
    os.close(hear)
    if ended not in (0, signal.SIGKILL):
        sys.exit(f"the run failed, {ended}")
    if live.exists():
        assert not damages(live), damages(live)
        kept = open_run(live)["trajectory"]
        positions = kept["position"].to_numpy()
        assert np.array_equal(positions, whole[: len(positions)]), "not the beginning of the whole"
        if told:
            reached = struct.unpack("d", told[len(told) // 8 * 8 - 8 : len(told) // 8 * 8])[0]
            last = float(kept["time"][-1])
            lost.append(min(reached, case.until) - last)
            assert lost[-1] <= interval * (1 + 1e-9), (reached, last)
    if ended == 0:  # it was done before it was killed: the next kills are of another run
        finished += 1
        number += 1
        live = folder / f"live{number}.zarr"
    else:
        done += 1
go(live)
assert not list(folder.glob("live*.zarr/.lock")), "a lock is left"
left = [p for p in folder.glob(".*.partial")]
print(f"{done} kills, {finished + 1} runs, {len(lost)} looked at, {len(left)} half-made")
"""


def _write_case(folder: Path, engine: str) -> Path:
    case = folder / "case.toml"
    case.write_text(ENGINES[engine] + CASE)
    return case


def _command(*words: object) -> ClickResult:
    return CliRunner().invoke(main, [str(word) for word in words])


LONG = [pytest.mark.slow, pytest.mark.timeout(3600)]


@pytest.mark.parametrize(
    ("engine", "kills"),
    [("spectral", FEW), *(pytest.param(name, KILLS // 2, marks=LONG) for name in ENGINES)],
)
def test_kills_at_random_moments_lose_nothing_and_change_nothing(kills, engine, tmp_path):
    _write_case(tmp_path, engine)
    words = [sys.executable, "-c", CAMPAIGN, str(tmp_path), str(kills), "11"]
    said = subprocess.run(words, capture_output=True, text=True, check=False)
    assert said.returncode == 0, said.stderr
    assert said.stdout.startswith(f"{kills} kills, ")
    runs = sorted(tmp_path.glob("live*.zarr"))
    assert len(runs) >= 1
    whole = open_run(tmp_path / "whole.zarr")
    assert whole["numerics"].sizes["step"] > 50
    for run in runs:
        found = open_run(run)
        assert found.attrs["status"] == whole.attrs["status"]
        assert found.attrs["status"]["code"] == "done"
        assert_same(found, whole)


PROGRAM = "from stokesfibers.cli.entry import main; print('ready', flush=True); main()"


@pytest.fixture(scope="module", params=ENGINES)
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A case, with its run beside it."""
    file = _write_case(tmp_path_factory.mktemp("case"), request.param)
    assert _command("run", file, "--out", file.with_name("whole.zarr"), "-q").exit_code == 0
    return file


@pytest.mark.parametrize(
    "count", [FEW_INTERRUPTS, pytest.param(INTERRUPTS, marks=pytest.mark.slow)]
)
def test_ctrl_c_at_any_moment_ends_with_a_word_and_can_be_gone_on_with(count, case, tmp_path):
    """While it imports, compiles, makes the store, steps, writes a checkpoint, or ends."""
    chance, whole, seen = random.Random(count), open_run(case.with_name("whole.zarr")), []
    for k in range(count):
        out = tmp_path / f"run{k}.zarr"
        words = [sys.executable, "-c", PROGRAM, "run", str(case), "--out", str(out), "-q"]
        process = subprocess.Popen(
            words,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            bufsize=0,
            # a shell that started the tests in the background had it ignored
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        end = time.monotonic() + 60.0
        while k % 2 and not out.exists() and time.monotonic() < end and process.poll() is None:
            time.sleep(0.001)
        time.sleep(chance.uniform(0.0, 0.4 if k % 2 else 1.5))
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
        seen.append(process.returncode)
        assert "Traceback" not in said, said
        assert process.returncode in (0, 130), said
        assert not list(tmp_path.glob(".*.partial")), "a store that was being made is gone"
        assert not (out / ".lock").exists()
        if process.returncode == 130:
            assert said.startswith(("Interrupted", "error: Interrupted")), said
        if out.exists():
            assert _command("resume", out, "-q").exit_code == 0
            assert_same(open_run(out), whole)
    assert 130 in seen


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 600 kB; skipped where it cannot be mounted."""
    disk = tmp_path / "disk"
    disk.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=600k", "none", str(disk)]
    if subprocess.run(words, capture_output=True, check=False).returncode:
        pytest.skip("no right to mount a file system")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=True)


def test_a_disk_that_is_really_full_keeps_what_was_committed(case, small_disk):
    out, filler = small_disk / "run.zarr", small_disk / "filler"
    filler.write_bytes(b"0" * 100_000)
    result = _command("run", case, "--out", out, "-q")
    assert result.exit_code in (2, 3), result.output
    assert "No space left on device" in " ".join(result.stderr.split())
    if result.exit_code == 2:  # not even the first commit fits
        assert [p.name for p in small_disk.iterdir()] == ["filler"]
        return
    whole = open_run(case.with_name("whole.zarr"))["trajectory"]["position"].to_numpy()
    kept = open_run(out)["trajectory"]["position"].to_numpy()
    assert np.array_equal(kept, whole[: len(kept)])
    assert _command("show", out).exit_code == 0


def test_a_read_only_disk_is_said_in_one_line(case, small_disk):
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    result = _command("run", case, "--out", small_disk / "run.zarr", "-q")
    assert result.exit_code == 2
    assert "Read-only file system" in " ".join(result.stderr.split())
    assert list(small_disk.iterdir()) == []


def test_files_that_may_not_grow_end_a_run_that_can_go_on(case, tmp_path):
    """A limit on the size of files, as a quota sets it: chunks have 32 KiB."""
    out = tmp_path / "run.zarr"
    said = subprocess.run(
        [sys.executable, "-c", PROGRAM, "run", str(case), "--out", str(out), "-q"],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000)),
        env={**os.environ, "NUMBA_DISABLE_PERFORMANCE_WARNINGS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert said.returncode == 3, said.stderr
    assert "File too large" in " ".join(said.stderr.split())
    assert _command("show", out).exit_code == 0
    assert _command("resume", out, "-q").exit_code == 0
    assert_same(open_run(out), open_run(case.with_name("whole.zarr")))


def test_clocks_that_jump_change_nothing(case, tmp_path, monkeypatch):
    """Durations come from a clock that cannot be set; the date is only written down."""
    now = [2e9]

    def backwards() -> float:
        now[0] -= 1e7
        return now[0]

    monkeypatch.setattr(time, "time", backwards)
    monkeypatch.setattr(time, "time_ns", lambda: int(1e9 * backwards()))
    out = tmp_path / "run.zarr"
    assert _command("run", case, "--out", out, "-q", "--set", "stepping.until=1.0").exit_code == 0
    assert _command("resume", out, "-q", "--until", "2.0").exit_code == 0
    monkeypatch.undo()
    found = open_run(out)
    assert (found["numerics"]["wall_time"].to_numpy() >= 0.0).all()
    assert_same(found, open_run(case.with_name("whole.zarr")))


def test_damage_is_named_by_every_command(case, tmp_path):
    """Show says what is lost, plot and resume refuse; all with exit code 2."""
    out = tmp_path / "run.zarr"
    assert _command("run", case, "--out", out, "-q").exit_code == 0
    (chunk,) = out.glob("trajectory/position/c/0/0/0/0")
    name = str(chunk.relative_to(out))
    data = bytearray(chunk.read_bytes())
    data[5000] ^= 16
    chunk.write_bytes(data)
    shown = _command("show", out)
    assert shown.exit_code == 2
    assert shown.stdout.startswith("done at t = 2"), "the rest is shown"
    assert "\ndamaged: values changed or went after the run; 1 damaged chunk" in shown.stdout
    assert "Next:" not in shown.stdout
    assert f"{name} does not match its checksum: records " in shown.stderr
    assert "of trajectory/position, t = " in shown.stderr
    facts = _command("show", out, "--json")
    assert facts.exit_code == 2
    assert f'"chunk": "{name}"' in facts.stdout
    for words in (["plot", out, "panels", "--out", tmp_path / "a.png"], ["resume", out]):
        result = _command(*words)
        assert result.exit_code == 2, result.output
        assert name in result.stderr
        assert "Traceback" not in result.output
    assert not (tmp_path / "a.png").exists()
    energy = _command("plot", out, "energy", "--out", tmp_path / "b.png")
    assert energy.exit_code == 0, "what is intact can be drawn"
    (out / "observables/time/c/0").write_bytes(b"")
    worse = _command("show", out)
    assert worse.exit_code == 2
    assert "observables/time/c/0 has 0 bytes" in worse.stderr
