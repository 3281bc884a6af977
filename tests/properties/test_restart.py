"""A run that was stopped, killed or extended is bitwise the run that was not."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from click.testing import Result as ClickResult

from stokesfibers.cli.main import main
from stokesfibers.fiber import curves
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import OscillatoryShear
from stokesfibers.io.reader import open_run
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.advance import Moment
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import Result, resume, simulate
from support import assert_same

STEPS = 60
DT = 0.0125
PROBLEM = Problem(
    Fiber(slenderness=1e-2),
    mu_bar=2e4,
    flow=OscillatoryShear(1.5, frequency=0.4),
    engine=PaperEngine(20, DT, 20.0),
)
# Neither interval is a multiple of the step, and checkpoints are rarer than positions.
RECORD = Schedule(0.07, 0.03, checkpoint_every=0.2)
PROGRAM = [sys.executable, "-c", "from stokesfibers.cli.main import main; main()"]


def start(out: Path | None, until: float = STEPS * DT, watch=None) -> Result:
    shape = curves.nearly_straight(PROBLEM.fibers[0], angle=2.3, amplitude=0.2)
    return simulate(PROBLEM, shape, until=until, record=RECORD, out=out, watch=watch)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> xr.DataTree:
    """The run without a stop."""
    result = start(tmp_path_factory.mktemp("whole") / "run.zarr")
    assert result.status.code == "done"
    assert result.data["numerics"].sizes["step"] == STEPS
    return result.data.load()


def test_comparison_can_fail(whole):
    changed = whole.copy(deep=True)
    position = changed["trajectory"].to_dataset()["position"]
    position.values[-1, 0, 3, 1] = np.nextafter(position.values[-1, 0, 3, 1], 1.0)
    with pytest.raises(AssertionError, match="position"):
        assert_same(changed, whole)


def test_memory_and_store_hold_the_same(whole):
    assert_same(start(None).data, whole)


@pytest.mark.parametrize("seed", range(4))
def test_stops_at_random_steps(seed, whole, tmp_path):
    """Each stop is a SIGINT between two steps; the run goes on in another call."""
    chosen = random.Random(seed)
    stops = sorted(chosen.sample(range(STEPS), 3))
    out = tmp_path / "run.zarr"
    for number, stop in enumerate(stops):

        def watch(moment: Moment, stop: int = stop) -> None:
            if round(moment.time / DT) == stop:
                signal.raise_signal(signal.SIGINT)

        if stop == 0:
            continue
        result = resume(out, watch=watch) if out.exists() else start(out, watch=watch)
        assert result.status.code == "interrupted", number
        assert result.status.time == pytest.approx(stop * DT, rel=1e-12)
        assert result.data["numerics"].sizes["step"] == stop
    result = resume(out)
    assert result.status.code == "done"
    assert_same(result.data, whole)


@pytest.mark.parametrize("step", [1, 2, 17, STEPS - 1])
def test_shorter_end_then_longer(step, whole, tmp_path):
    start(tmp_path / "run.zarr", until=step * DT)
    result = resume(tmp_path / "run.zarr", until=STEPS * DT)
    assert result.status.code == "done"
    assert_same(result.data, whole)


def test_signal_before_the_first_step_leaves_a_run_to_resume(whole, tmp_path, monkeypatch):
    from stokesfibers.run import simulate as module

    real = module.first_carry

    def interrupted(*args):
        signal.raise_signal(signal.SIGINT)
        return real(*args)

    out = tmp_path / "run.zarr"
    with monkeypatch.context() as patch:
        patch.setattr(module, "first_carry", interrupted)
        result = start(out)
    assert result.status.code == "interrupted"
    assert result.status.time == 0.0
    assert_same(resume(out).data, whole)


def test_handlers_are_put_back(tmp_path):
    before = [signal.getsignal(s) for s in (signal.SIGINT, signal.SIGTERM)]
    start(tmp_path / "run.zarr", until=DT)
    assert [signal.getsignal(s) for s in (signal.SIGINT, signal.SIGTERM)] == before


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
stepping = {dt = 0.01, until = 4.0}
record = {positions_every = 0.05, observables_every = 0.01}
""",
    "spectral": """\
engine = "spectral"
discretization = {nodes = 8, adapt_nodes = true}
stepping = {rtol = 1e-5, until = 4.0}
record = {positions_every = 0.01, observables_every = 0.004}
""",
}


@pytest.fixture(scope="module", params=ENGINES)
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("case") / "case.toml"
    file.write_text(ENGINES[request.param] + CASE)
    return file


@pytest.fixture(scope="module")
def whole_case(case: Path) -> xr.DataTree:
    out = case.with_name("whole.zarr")
    assert command("run", case, "--out", out, "--quiet").exit_code == 0
    tree = open_run(out).load()
    if "spectral" in case.read_text():
        assert np.ptp(tree["numerics"]["order"].to_numpy()) >= 4
    return tree


def begin(case: Path, out: Path) -> subprocess.Popen[bytes]:
    """Start a run of the case and return once its store is there."""
    words = [*PROGRAM, "run", str(case), "--out", str(out)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    wait_until(lambda: out.exists() or process.poll() is not None)
    assert process.poll() is None
    return process


def wait_until(true: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.001)


def command(*words: object) -> ClickResult:
    """Run a command in this process, which has compiled everything already."""
    return CliRunner().invoke(main, [str(word) for word in words])


@pytest.mark.parametrize(
    "delay",
    [0.0, 0.15, *(pytest.param(d, marks=pytest.mark.slow) for d in (0.03, 0.07, 0.25))],
)
def test_killed_at_a_random_moment(delay, case, whole_case, tmp_path):
    """SIGKILL: what was committed opens and is right, and the run goes on from there."""
    out = tmp_path / "run.zarr"
    process = begin(case, out)
    time.sleep(delay)
    process.kill()
    process.communicate()
    kept = open_run(out)["trajectory"].to_dataset()
    positions = kept["position"].to_numpy()
    count = len(positions)
    assert count < whole_case["trajectory"].sizes["time"]
    assert np.array_equal(positions, whole_case["trajectory"]["position"].to_numpy()[:count])
    shown = command("show", out)
    assert shown.exit_code == 0, shown.stderr
    assert shown.stdout.startswith("running at t = ")
    assert "it was killed" in shown.stdout
    resumed = command("resume", out)
    assert resumed.exit_code == 0, resumed.stderr
    assert_same(open_run(out), whole_case)


def test_kill_loses_at_most_the_last_recording_interval(case, tmp_path):
    """It kills itself after a step that it tells the end of."""
    out, told = tmp_path / "run.zarr", tmp_path / "reached"
    words = [sys.executable, "-c", _KILLED_LATE, str(case), str(out), str(told)]
    assert subprocess.run(words).returncode == -signal.SIGKILL
    reached = float(told.read_text())
    kept = open_run(out)["trajectory"]["time"].to_numpy()
    interval = kept[1] - kept[0]
    assert 1.5 < reached < 4.0
    assert reached - interval - 1e-9 <= kept[-1] <= reached + 1e-9


_KILLED_LATE = """
import os, signal, sys
from pathlib import Path
from stokesfibers.config.case import load_case
from stokesfibers.run import recorder
from stokesfibers.run.simulate import simulate
recorder.LEAST_COMMIT_SECONDS = 0.0  # as for a run that takes longer than that between records
case = load_case(sys.argv[1])

def watch(moment):
    if moment.time > 1.5:
        Path(sys.argv[3]).write_text(repr(moment.time))
        os.kill(os.getpid(), signal.SIGKILL)

simulate(case.problem, case.curves(), until=case.until, record=case.record, out=sys.argv[2],
         case=case.tables(), watch=watch)
"""


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_interrupt_ends_with_130_and_says_how_to_go_on(number, case, whole_case, tmp_path):
    out = tmp_path / "run.zarr"
    process = begin(case, out)
    time.sleep(0.1)
    process.send_signal(number)
    _, said = process.communicate()
    assert process.returncode == 130
    assert f"Go on with: stokesfibers resume {out}" in said.decode()
    assert "Traceback" not in said.decode()
    assert open_run(out).attrs["status"]["code"] == "interrupted"
    assert not (out / ".lock").exists()
    assert command("resume", out).exit_code == 0
    assert_same(open_run(out), whole_case)


def test_killed_before_the_first_checkpoint_starts_again(case, whole_case, tmp_path):
    out = tmp_path / "run.zarr"
    words = [sys.executable, "-c", _KILLED_AT_ONCE, str(case), str(out)]
    assert subprocess.run(words).returncode == -signal.SIGKILL
    assert open_run(out)["observables"].sizes["time"] == 0
    assert command("show", out).exit_code == 0
    assert command("resume", out).exit_code == 0
    assert_same(open_run(out), whole_case)


_KILLED_AT_ONCE = """
import os, signal, sys
from stokesfibers.config.case import load_case
from stokesfibers.run.recorder import Recorder
from stokesfibers.run.simulate import simulate
case = load_case(sys.argv[1])
Recorder.start = lambda *args: os.kill(os.getpid(), signal.SIGKILL)
simulate(case.problem, case.curves(), until=case.until, record=case.record, out=sys.argv[2],
         case=case.tables())
"""


def test_run_in_use_is_not_resumed(case, tmp_path):
    out = tmp_path / "run.zarr"
    process = begin(case, out)
    try:
        os.kill(process.pid, signal.SIGSTOP)
        refused = command("resume", out)
        assert refused.exit_code == 2
        assert "a run that nothing else is writing" in refused.stderr
        assert command("show", out).exit_code == 0
    finally:
        process.kill()
        process.communicate()
