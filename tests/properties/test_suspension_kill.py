"""Suspensions that are killed, cannot be written, or cannot be begun."""

from __future__ import annotations

import errno
import itertools
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from click.testing import Result as ClickResult

from stokesfibers.cli.main import main
from stokesfibers.io import atomic
from stokesfibers.io.reader import open_run

GROUPS = ("trajectory", "observables", "numerics")
CASE = """\
fiber = {count = 4, slenderness = 1e-3}
fluid.mu_bar = 100.0
flow = {kind = "python", file = "flow.py"}
initial = {kind = "file", path = "points.npy"}
record = {positions_every = 0.02, observables_every = 0.005, checkpoint_every = 0.05}
"""
ENGINES = {
    "paper": """\
engine = "paper"
domain = {kind = "periodic", periods = [2.0, 0.0, 0.0], sum = "images", reach = 4}
constraint = {beta = 5.0, tolerance = 1e-6}
discretization.intervals = 20
stepping = {dt = 0.0025, until = 0.8}
""",
    "spectral": """\
engine = "spectral"
domain = {kind = "periodic", periods = [2.0, 0.0, 0.0]}
discretization.nodes = 16
stepping = {rtol = 1e-3, until = 0.8}
""",
}
# Fiber 1 is carried up through fiber 0, which sinks with the others and is bent.
FLOW = """\
import numpy as np

def velocity(points, t):
    found = np.zeros_like(points)
    found[:, 2] = -1.0 + 0.2 * np.sin(3.0 * points[:, 0])
    %s
    return found
"""
RISE = {
    "paper": "found[np.abs(points[:, 0] - 0.02) < 1e-2, 2] = 1.0",
    "spectral": "found[:, 2] += 2.0 * np.exp(-(((points[:, 0] - 0.02) / 0.12) ** 2))",
}
STEPS = {"paper": [0, 30, 1, 90, 0, 60, 45], "spectral": [0, 75, 1, 95, 0, 12, 12]}
# Each child takes steps, reports each by a byte, and is killed at a random moment after some.
KILLER = """
import os, random, shutil, signal, sys, time
from pathlib import Path
from stokesfibers.config.case import load_case
from stokesfibers.run import recorder
from stokesfibers.run.simulate import resume, simulate

recorder.LEAST_COMMIT_SECONDS = 0.0  # as for a run that takes longer than that between records

def start(case, out, watch=None):
    return simulate(case.problem, case.curves(), until=case.until, record=case.record, out=out,
                    case=case.tables(), watch=watch, threads=1)

folder = Path(sys.argv[1])
case = load_case(folder / "case.toml", allow_python=True)
moments = []
begun = time.perf_counter()
start(case, folder / "whole.zarr", lambda moment: moments.append(time.perf_counter()))
step = (moments[-1] - moments[0]) / len(moments)
making = moments[0] - begun
chance = random.Random(3)
live = folder / "live.zarr"
for k, steps in enumerate(map(int, sys.argv[2:])):
    hear, report = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            watch = lambda moment: os.write(report, b".")
            if live.exists():
                resume(live, allow_python=True, threads=1, watch=watch)
            else:
                start(case, live, watch)
        finally:
            os._exit(1)
    os.close(report)
    for _ in range(steps + chance.randrange(6) if steps else 0):
        os.read(hear, 1)
    time.sleep(chance.uniform(0.0, step if steps else min(0.2, making)))
    os.kill(child, signal.SIGKILL)
    if os.waitpid(child, 0)[1] != signal.SIGKILL:
        sys.exit("the run failed or ended before it was killed")
    os.close(hear)
    if live.exists():
        shutil.copytree(live, folder / f"killed{k}.zarr")
resume(live, allow_python=True, threads=1)
"""


def _points() -> np.ndarray:
    """Straight fibers of four directions; the first two cross in the flow, (fiber, point, 3)."""
    along = np.linspace(-0.5, 0.5, 21)
    zero = np.zeros_like(along)
    return np.array(
        [
            np.stack([along, zero, zero + 0.42], axis=1),
            np.stack([zero + 0.02, along + 0.01, zero - 0.38], axis=1),
            np.stack([zero - 0.9, along, zero + 0.6], axis=1),
            np.stack([zero + 0.8, 0.6 * along, 0.8 * along + 1.1], axis=1),
        ]
    )


def _write_case(folder: Path, engine: str) -> Path:
    np.save(folder / "points.npy", _points())
    (folder / "flow.py").write_text(FLOW % RISE[engine])
    case = folder / "case.toml"
    case.write_text(ENGINES[engine] + CASE)
    return case


def _assert_same(found: xr.DataTree, whole: xr.DataTree, *, kept: bool = False) -> int:
    """Assert that all but wall times is bitwise the same, or the beginning of it if `kept`."""
    compared = 0
    for group in GROUPS:
        one, other = found[group].to_dataset(), whole[group].to_dataset()
        assert set(one.data_vars) == set(other.data_vars)
        for name in set(one.data_vars) - {"wall_time"}:
            a, b = one[name].to_numpy(), other[name].to_numpy()
            growing = one[name].dims[:1] in (("time",), ("step",))
            b = b[: len(a)] if kept and growing else b
            assert a.tobytes() == b.tobytes(), f"{group}/{name}"
            compared += 1
    return compared


@pytest.fixture(scope="module", params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    """The engine of the case."""
    return request.param


@pytest.fixture(scope="module")
def killed(engine: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run without a stop, one killed again and again, and copies of that."""
    folder = tmp_path_factory.mktemp("killed")
    _write_case(folder, engine)
    script = folder / "killer.py"
    script.write_text(KILLER)
    done = subprocess.run(
        [sys.executable, str(script), str(folder), *map(str, STEPS[engine])],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork and SIGKILL")
def test_suspension_killed_at_any_moment_ends_as_the_one_that_was_not(killed, engine):
    whole, live = open_run(killed / "whole.zarr"), open_run(killed / "live.zarr")
    assert live.attrs["status"]["code"] == "done"
    steps = whole["numerics"].to_dataset()
    if engine == "paper":
        assert steps.sizes["step"] == 320
        assert (steps["iterations"].to_numpy() > 1).all()
    else:
        assert np.ptp(steps["order"].to_numpy()) >= 3
        assert steps["rejected"].to_numpy().sum() > 0
        assert steps["iterations"].to_numpy().max() > 1
    assert _assert_same(live, whole) >= 20
    assert {"smallest_gap", "extra_stress"} <= set(live["observables"].data_vars)


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork and SIGKILL")
def test_crossings_survive_the_kills_each_once(killed):
    whole, live = open_run(killed / "whole.zarr"), open_run(killed / "live.zarr")
    assert '"fibers": [0, 1]' in whole.attrs["crossings"]
    assert live.attrs["crossings"] == whole.attrs["crossings"]
    assert live.attrs["status"]["explanation"] == whole.attrs["status"]["explanation"]


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork and SIGKILL")
def test_what_a_killed_suspension_leaves_is_the_beginning_of_the_whole(killed):
    whole = open_run(killed / "whole.zarr")
    copies = sorted(killed.glob("killed*.zarr"), key=lambda p: int(p.stem[6:]))
    assert len(copies) >= 5
    ends = []
    for path in copies:
        left = open_run(path)
        _assert_same(left, whole, kept=True)
        ends.append(left["trajectory"].sizes["time"])
    assert ends[-1] < whole["trajectory"].sizes["time"]
    assert len(set(ends)) >= 4
    # a resumed run goes back to its last checkpoint, two and a half records before at most
    assert all(b >= a - 3 for a, b in itertools.pairwise(ends))


def _command(*words: object) -> ClickResult:
    return CliRunner().invoke(main, [str(word) for word in words])


@pytest.fixture
def fill_up(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Return a function after which only so many more writes succeed."""
    real = atomic._write

    def after(writes: int) -> None:
        left = [writes]

        def write(fd: int, data: memoryview) -> None:
            if left[0] <= 0:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            left[0] -= 1
            real(fd, data)

        monkeypatch.setattr(atomic, "_write", write)

    return after


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork and SIGKILL")
@pytest.mark.parametrize("writes", [150, pytest.param(300, marks=pytest.mark.slow)])
def test_full_disk_ends_a_suspension_that_can_go_on(
    writes, killed, engine, tmp_path, fill_up, monkeypatch
):
    case, out = _write_case(tmp_path, engine), tmp_path / "full.zarr"
    whole = open_run(killed / "whole.zarr")
    fill_up(writes)
    result = _command("run", case, "--out", out, "--allow-python", "--quiet")
    monkeypatch.undo()
    assert result.exit_code == 3, result.output
    assert "No space left on device" in " ".join(result.stderr.split())
    left = open_run(out)
    _assert_same(left, whole, kept=True)
    assert 0 < left["trajectory"].sizes["time"] < whole["trajectory"].sizes["time"]
    assert _command("resume", out, "--allow-python", "--quiet").exit_code == 0
    again = open_run(out)
    _assert_same(again, whole)
    assert again.attrs["crossings"] == whole.attrs["crossings"]


def _crossing() -> np.ndarray:
    points = _points()
    points[1, :, 2] = points[0, :, 2]
    return points


def _through_an_image() -> np.ndarray:
    """Fiber 3 lies where the right-hand image of fiber 2 is."""
    points = _points()
    points[3] = points[2] + np.array([2.0, 0.3, 0.0])
    return points


@pytest.mark.parametrize(("points", "pair"), [(_crossing, (0, 1)), (_through_an_image, (2, 3))])
@pytest.mark.parametrize("command", ["run", "check"])
def test_overlapping_initial_fibers_are_refused(points, pair, command, engine, tmp_path):
    case, out = _write_case(tmp_path, engine), tmp_path / "run.zarr"
    np.save(tmp_path / "points.npy", points())
    words = ["--out", out] if command == "run" else []
    result = _command(command, case, "--allow-python", *words)
    assert result.exit_code == 2, result.output
    assert "fibers whose surfaces do not overlap" in result.stderr
    assert re.findall(r"fibers (\d) and (\d) at a", result.stderr) == [
        tuple(map(str, sorted(pair)))
    ]
    assert not out.exists()


@pytest.mark.parametrize(
    ("setting", "fragment"),
    [
        ("domain.periods=[0.9, 0.0, 0.0]", "domain.periods"),
        ("domain={kind='periodic', periods=[2.0, 2.0, 0.9], sum='truncated'}", "domain.periods"),
        ("fiber.length=2.5", "domain.periods"),
        ("initial={kind='suspension', box=[3.0, 1.0, 1.0]}", "initial.box"),
        ("initial={kind='suspension', box=[2.0, 0.1, 0.1], least_gap=1.1}", "initial.box"),
    ],
    ids=["one period", "three periods", "long fibers", "box past the period", "full box"],
)
def test_box_too_small_is_refused(setting, fragment, engine, tmp_path):
    case, out = _write_case(tmp_path, engine), tmp_path / "run.zarr"
    result = _command("run", case, "--out", out, "--allow-python", "--set", setting)
    assert result.exit_code == 2, result.output
    assert fragment in result.stderr, result.stderr
    assert not out.exists()
