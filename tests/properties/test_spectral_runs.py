"""Runs of the high-order engine: records between steps, stops, ends, resumptions, nodes."""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from stokesfibers.core.errors import InputError
from stokesfibers.fiber import curves
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import OscillatoryShear, Shear
from stokesfibers.problem.engine import PaperEngine, SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.advance import Moment
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import Result, resume, simulate
from support import assert_close, assert_same

ENGINE = SpectralEngine(nodes=10, adapt_nodes=True, rtol=1e-4)
PROBLEM = Problem(
    Fiber(slenderness=1e-2), mu_bar=2e5, flow=OscillatoryShear(1.5, frequency=0.06), engine=ENGINE
)
RECORD = Schedule(0.3, 0.1, checkpoint_every=0.5)
UNTIL = 5.05


def start(out: Path | None, until: float = UNTIL, watch=None, problem=PROBLEM) -> Result:
    shape = curves.nearly_straight(problem.fibers[0], angle=2.3, amplitude=0.3)
    return simulate(problem, shape, until=until, record=RECORD, out=out, watch=watch)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> xr.DataTree:
    """The run without a stop."""
    result = start(tmp_path_factory.mktemp("whole") / "run.zarr")
    assert result.status.code == "done"
    assert result.status.time == UNTIL
    return result.data.load()


def test_records_fall_on_their_times_whatever_the_steps(whole):
    assert_close(whole["trajectory"]["time"].to_numpy(), 0.3 * np.arange(17), rtol=1e-12)
    assert_close(whole["observables"]["time"].to_numpy(), 0.1 * np.arange(51), rtol=1e-12)
    steps = whole["numerics"]
    assert np.ptp(steps["step_size"].to_numpy()) > 0.01
    assert steps["order"].to_numpy().max() >= 4
    assert steps["time"].to_numpy()[-1] > UNTIL
    assert whole["trajectory"]["arclength"].sizes["node"] == 101


def test_nodes_are_added_when_the_shape_asks_for_them(whole):
    nodes = whole["numerics"]["nodes"].to_numpy()
    assert nodes[0] < nodes[-1]
    assert np.all(np.diff(nodes) >= 0)
    assert whole["numerics"]["spatial_error"].to_numpy().max() <= 0.3 * 1e-4
    assert json_status(whole)["explanation"] == ""


def test_too_few_nodes_are_reported():
    coarse = start(None, problem=replace(PROBLEM, engine=SpectralEngine(nodes=10, rtol=1e-4)))
    assert coarse.status.code == "done"
    assert "ask for more nodes" in coarse.status.explanation


def test_lengths_and_between_times_are_as_exact_as_the_steps(whole):
    assert whole["observables"]["length_error"].to_numpy().max() < 1e-7
    fine = start(None, problem=replace(PROBLEM, engine=SpectralEngine(nodes=48, rtol=1e-8)))
    error = np.abs(
        fine.data["trajectory"]["position"].to_numpy() - whole["trajectory"]["position"].to_numpy()
    )
    assert error.max() < 1e-4


@pytest.mark.parametrize("seed", range(3))
def test_stops_at_random_steps(seed, whole, tmp_path):
    """Each stop is a SIGINT between two steps, in the middle of a history of mixed orders."""
    count = whole["numerics"].sizes["step"]
    stops = sorted(random.Random(seed).sample(range(1, count - 1), 3))
    times = whole["numerics"]["time"].to_numpy()
    out = tmp_path / "run.zarr"
    for stop in stops:

        def watch(moment: Moment, stop: int = stop) -> None:
            if moment.time == times[stop]:
                signal.raise_signal(signal.SIGINT)

        result = resume(out, watch=watch) if out.exists() else start(out, watch=watch)
        assert result.status.code == "interrupted"
        assert result.status.time == times[stop]
    assert_same(resume(out).data, whole)


@pytest.mark.parametrize("until", [0.001, 1.234, 3.0])
def test_shorter_end_then_longer(until, whole, tmp_path):
    """The first end lies within a step, which is not cut; what it left out is recorded later."""
    first = start(tmp_path / "run.zarr", until=until)
    assert first.status.time == until
    assert first.data["observables"]["time"].to_numpy()[-1] <= until
    assert_same(resume(tmp_path / "run.zarr", until=UNTIL).data, whole)


def test_a_killed_run_goes_on_from_its_checkpoint(whole, tmp_path):
    out = tmp_path / "run.zarr"
    child = os.fork()
    if not child:

        def watch(moment: Moment) -> None:
            if moment.time > 2.6:
                os.kill(os.getpid(), signal.SIGKILL)

        start(out, watch=watch)
        os._exit(1)
    assert os.waitpid(child, 0)[1] == signal.SIGKILL
    assert_same(resume(out).data, whole)


def test_a_store_of_the_other_engine_is_refused(tmp_path):
    start(tmp_path / "run.zarr", until=0.5)
    other = replace(PROBLEM, engine=PaperEngine(20, 0.01, 20.0))
    with pytest.raises(InputError, match="problem"):
        resume(tmp_path / "run.zarr", until=1.0, problem=other)


def test_fixed_steps_of_a_given_order():
    engine = SpectralEngine(nodes=24, dt=0.02, order=3)
    steps = start(None, until=1.0, problem=replace(PROBLEM, engine=engine)).data["numerics"]
    assert steps["order"].to_numpy()[-1] == 3
    assert_close(steps["step_size"].to_numpy()[-20:], np.full(20, 0.02), rtol=1e-12)


@pytest.mark.slow
def test_a_run_of_the_command_line_takes_seconds(tmp_path):
    """The compiled kernels are there: a second process must not compile them again."""
    case = tmp_path / "case.toml"
    case.write_text(
        'engine = "spectral"\n[fiber]\nslenderness = 1e-3\n[fluid]\nmu_bar = 4e5\n'
        '[flow]\nkind = "shear"\n[stepping]\nuntil = 61.44\n'
    )
    program = [sys.executable, "-c", "from stokesfibers.cli.main import main; main()"]
    seconds = []
    for name in ("first.zarr", "second.zarr"):
        before = _children_seconds()
        words = ["run", str(case), "--quiet", "--out", str(tmp_path / name)]
        subprocess.run([*program, *words], check=True)
        seconds.append(_children_seconds() - before)
    assert seconds[1] < 6.0, "3 s of a machine that does nothing else"


def _children_seconds() -> float:
    """Return the processor time of all children so far, which a busy machine changes less."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def json_status(tree: xr.DataTree) -> dict:
    """Return the stored status."""
    import json

    held = tree.attrs["status"]
    return json.loads(held) if isinstance(held, str) else dict(held)


def test_a_steady_shear_needs_no_more_nodes_than_the_shape():
    straight = Problem(Fiber(slenderness=1e-3), mu_bar=100.0, flow=Shear(1.0))
    problem = replace(straight, engine=SpectralEngine(rtol=1e-6))
    assert isinstance(problem.engine, SpectralEngine)
    assert problem.engine.nodes == 16
