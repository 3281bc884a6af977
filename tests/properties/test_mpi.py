"""Several ranks give the bits of one; a rank that fails ends the run, which can be resumed."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.core.errors import InputError
from stokesfibers.core.mpi import launched, team_of_launcher
from stokesfibers.core.team import ALONE, Alone, edges_of
from stokesfibers.stepping.engines import stepper_of
from stokesfibers.summation.ewald.near import chunks, cut
from support import assert_same

PROGRAM = Path(__file__).parents[1] / "reference" / "on_ranks.py"
BESIDE = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
MPIRUN = shutil.which("mpirun", path=BESIDE)
ranked = pytest.mark.skipif(
    MPIRUN is None or not all(map(importlib.util.find_spec, ("mpi4py", "ducc0"))),
    reason="needs mpi4py, an mpirun and ducc0",
)
CASE = """\
engine = "spectral"
fiber = {count = 7, slenderness = 1e-2}
fluid.mu_bar = 1e4
flow.kind = "shear"
domain = {kind = "periodic", periods = [2.0, 2.0, 2.0]}
initial = {kind = "suspension", seed = 1, box = [2.0, 2.0, 2.0], least_gap = 0.03}
discretization.nodes = 16
stepping = {rtol = 1e-3, until = 0.06}
record = {positions_every = 0.01, observables_every = 0.01, checkpoint_every = 0.01, points = 9}
"""
SHELL = "from stokesfibers.cli.main import main; main()"


def on_ranks(count: int, *words: object) -> subprocess.CompletedProcess[str]:
    """Run Python with `words` on so many ranks."""
    command = [str(MPIRUN), "-n", str(count), sys.executable, *map(str, words)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    return subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)


def in_shell(*words: object) -> None:
    """Run a command on one rank, which must succeed."""
    subprocess.run([sys.executable, "-c", SHELL, *map(str, words)], check=True, timeout=300)


@pytest.fixture
def case(tmp_path: Path) -> Path:
    file = tmp_path / "case.toml"
    file.write_text(CASE)
    return file


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory):
    """The case run by one process."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "case.toml").write_text(CASE)
    in_shell("run", folder / "case.toml", "--out", folder / "run.zarr", "-q", "--threads", 1)
    data = sf.open_run(folder / "run.zarr")
    assert data["numerics"].to_dataset().sizes["step"] > 10
    return data


@ranked
@pytest.mark.parametrize("ranks", [2, 3])
def test_steps_on_several_ranks_are_bitwise_those_of_one(ranks):
    done = on_ranks(ranks, PROGRAM, "steps")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == 6
    assert all(line.endswith(f"{ranks} ranks: same") for line in lines), done.stdout


@ranked
@pytest.mark.slow
def test_what_another_rank_finds_is_used():
    done = on_ranks(2, PROGRAM, "spoiled")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("2 ranks: other") == 6, done.stdout


@ranked
@pytest.mark.parametrize("first", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_run_begun_on_some_ranks_goes_on_on_others(first, case, whole):
    out = case.with_name("run.zarr")
    begin = ("run", case, "--out", out, "-q", "--threads", 1, "--set", "stepping.until=0.03")
    go_on = ("resume", out, "--until", 0.06, "-q", "--threads", 1)
    if first == 1:
        in_shell(*begin)
        done = on_ranks(2, "-c", SHELL, *go_on)
    else:
        done = on_ranks(2, "-c", SHELL, *begin)
        in_shell(*go_on)
    assert done.returncode == 0, done.stderr
    assert_same(sf.open_run(out), whole)


@ranked
@pytest.mark.parametrize("how", ["kill", "mute", pytest.param("raise", marks=pytest.mark.slow)])
def test_rank_that_fails_ends_the_run_and_leaves_it_resumable(how, case, whole):
    out = case.with_name("run.zarr")
    begun = time.perf_counter()
    done = on_ranks(2, PROGRAM, how, 12, "run", case, "--out", out, "-q", "--threads", 1)
    assert time.perf_counter() - begun < 100.0
    assert done.returncode not in (0, None)
    assert ("rank 1: RuntimeError: out of order" in done.stderr) == (how != "kill")
    assert sf.open_run(out).attrs["status"]["code"] == "running"
    in_shell("resume", out, "-q", "--threads", 1)
    assert_same(sf.open_run(out), whole)


@ranked
@pytest.mark.slow
def test_interrupt_stops_all_ranks_and_can_be_resumed(case):
    out = case.with_name("run.zarr")
    words = ("run", case, "--out", out, "--threads", 1, "--set", "stepping.until=50")
    command = [str(MPIRUN), "-n", "2", sys.executable, "-c", SHELL, *map(str, words)]
    run = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    for _ in range(600):
        time.sleep(0.1)
        if out.exists():
            break
    time.sleep(1.0)
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=100)
    assert run.returncode == 130
    assert said.count("Interrupted at") == 1
    assert sf.open_run(out).attrs["status"]["code"] == "interrupted"


@ranked
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("run", "nowhere.toml", "--out", "x.zarr"), "nowhere.toml: expected a case file"),
        pytest.param(("run", "--bogus"), "No such option", marks=pytest.mark.slow),
        pytest.param(("resume", "nowhere.zarr"), "nowhere.zarr", marks=pytest.mark.slow),
    ],
)
def test_bad_input_is_reported_once(words, message):
    done = on_ranks(3, "-c", SHELL, *words)
    assert done.returncode == 2
    assert done.stderr.lower().count("error:") == 1, done.stderr
    assert message in done.stderr


def test_paper_engine_refuses_several_ranks():
    team = Alone()
    team.size = 2
    problem = sf.Problem(
        sf.Fiber(slenderness=1e-2), mu_bar=1e4, flow=sf.Shear(1.0), engine=sf.PaperEngine(50)
    )
    with pytest.raises(InputError, match="'spectral' on several ranks, got 'paper' on 2"):
        stepper_of(problem, 1, team)


def test_launchers_are_told_by_their_environment():
    assert launched({}) == (0, 1)
    assert launched({"PMI_RANK": "2", "PMI_SIZE": "3"}) == (2, 3)
    assert launched({"OMPI_COMM_WORLD_RANK": "1", "OMPI_COMM_WORLD_SIZE": "4"}) == (1, 4)
    assert launched({"SLURM_PROCID": "0"}) == (0, 1)


def test_nothing_of_mpi_is_imported_unless_launched(monkeypatch):
    for name in ("PMI_RANK", "OMPI_COMM_WORLD_RANK", "PALS_RANKID", "SLURM_PROCID"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setitem(sys.modules, "mpi4py", None)  # an import would raise
    assert team_of_launcher() is ALONE
    assert team_of_launcher(mpi=False) is ALONE
    monkeypatch.setenv("PMI_RANK", "0")
    monkeypatch.setenv("PMI_SIZE", "2")
    assert team_of_launcher(mpi=False) is ALONE
    with pytest.raises(ImportError, match=r"stokesfibers\[mpi\]"):
        team_of_launcher()


@pytest.mark.parametrize("count", [0, 1, 2, 7, 48])
@pytest.mark.parametrize("parts", [1, 2, 3, 5])
def test_shares_cover_everything_once(count, parts):
    edges = edges_of(count, parts)
    assert edges[0] == 0
    assert edges[-1] == count
    assert set(np.diff(edges)) <= {count // parts, -(-count // parts)}
    weights = np.random.default_rng(count).random(count) + 0.1
    ranks = cut(weights, np.array([0.0, *np.ones(parts)]))
    assert ranks[0] == ranks[1] == 0
    assert ranks[-1] == count
    pieces = [chunks(weights, ranks, rank, 4) for rank in range(parts + 1)]
    assert [(p[0], p[-1]) for p in pieces] == list(pairwise(ranks))
    sums = [weights[a:b].sum() for a, b in pairwise(ranks)]
    if count:
        assert np.ptp(sums[1:]) <= 2.0 * weights.max()
