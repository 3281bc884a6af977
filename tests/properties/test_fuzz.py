"""Case files are data: whatever stands in one gives a case or a clean error, and runs no code."""

from __future__ import annotations

import copy
import os
import tomllib
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stokesfibers.cli.main import main
from stokesfibers.config.case import apply_setting, case_from_tables, read_tables
from stokesfibers.core.errors import InputError, MissingExtraError
from stokesfibers.problem.checks import doubts
from stokesfibers.run.schedule import Schedule, refuse_endless

CASES = sorted((Path(__file__).parents[2] / "cases").glob("*.toml"))
TABLES = [tomllib.loads(file.read_text()) for file in CASES]
CLEAN = (InputError, MissingExtraError)
HEALTH = [HealthCheck.too_slow, HealthCheck.data_too_large]

SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**20), 10**20),
    st.sampled_from([0, 1, -1, 10**9, 10**18, 2**63, 2**64]),
    st.floats(),
    st.sampled_from([float("nan"), float("inf"), -float("inf"), 1e-320, 1e308, -0.0]),
    st.text(max_size=8),
    st.sampled_from(["paper", "spectral", "shear", "file", "python", "periodic", "/dev/zero", "."]),
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(
            st.sampled_from(["kind", "rate", "file", "path", "flows", "axis", "count", "x"]),
            inner,
            max_size=4,
        ),
    ),
    max_leaves=6,
)
NAMES = sorted({key for tables in TABLES for key in tables} | {"load", "stop", "x"})


def _places(table: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all values in nested tables."""
    found = [at] if at else []
    if isinstance(table, dict | list):
        for key, value in table.items() if isinstance(table, dict) else enumerate(table):
            found += _places(value, (*at, key))
    return found


@st.composite
def mutated(draw: st.DrawFn) -> dict[str, Any]:
    """Return a case of ours in which some values were replaced, dropped or added."""
    tables = copy.deepcopy(draw(st.sampled_from(TABLES)))
    for _ in range(draw(st.integers(1, 3))):
        *way, last = draw(st.sampled_from(_places(tables) or [("x",)]))
        inside: Any = tables
        for key in way:
            inside = inside[key]
        action = draw(st.sampled_from(["replace", "replace", "drop", "add"]))
        if action == "drop" and isinstance(inside, dict):
            inside.pop(last, None)
        elif action == "add" and isinstance(inside, dict):
            inside[draw(st.sampled_from([*NAMES, "kind", "nodes", "dt", "sum"]))] = draw(VALUES)
        elif isinstance(inside, dict) or last < len(inside):
            inside[last] = draw(VALUES)
    return tables


def _read(tables: dict[str, Any], folder: Path) -> None:
    """Do with tables what every command does first; only clean errors may come."""
    said = ""
    try:
        case = case_from_tables(tables, folder=folder)
        refuse_endless(case.record, case.until)
        if sum(kind.count for kind in case.problem.kinds) > 100:
            return  # placing many takes its time
        case.tables()
        doubts(case.problem, case.plan())
    except CLEAN as error:
        said = str(error)
    assert len(said) < 20_000


@settings(max_examples=60, suppress_health_check=HEALTH)
@given(tables=mutated())
def test_changed_cases_give_clean_errors(tables):
    _read(tables, Path("/nowhere"))


@pytest.mark.slow
@pytest.mark.timeout(3600)
@settings(max_examples=3000, suppress_health_check=HEALTH)
@given(tables=mutated())
def test_many_changed_cases_give_clean_errors(tables):
    _read(tables, Path("/nowhere"))


@settings(max_examples=80, suppress_health_check=HEALTH)
@given(tables=st.dictionaries(st.sampled_from(NAMES), VALUES, max_size=5))
def test_random_tables_give_clean_errors(tables):
    _read(tables, Path("/nowhere"))


@settings(max_examples=100, suppress_health_check=HEALTH)
@given(text=st.text(max_size=40), number=st.integers(0, len(TABLES) - 1))
def test_random_settings_give_clean_errors(text, number):
    tables = copy.deepcopy(TABLES[number])
    for setting in (text, f"{text}={text}", f"fiber.{text}", f"fiber[{text}].length={text}"):
        try:
            apply_setting(tables, setting)
        except InputError:
            continue


@settings(max_examples=60, suppress_health_check=HEALTH)
@given(data=st.binary(max_size=200))
def test_random_bytes_are_no_case(data, tmp_path_factory):
    file = tmp_path_factory.getbasetemp() / "bytes.toml"
    file.write_bytes(data)
    try:
        tables = read_tables(file)
    except InputError:
        return
    _read(tables, file.parent)


def _command(*words: object):
    return CliRunner().invoke(main, [str(word) for word in words])


def _said_cleanly(result, code: int = 2) -> str:
    assert result.exit_code == code, result.output
    assert "Traceback" not in result.output
    assert "fault of stokesfibers" not in result.output
    return " ".join(result.stderr.split())


BUCKLING = next(file for file in CASES if file.stem == "buckling")


@pytest.mark.parametrize(
    "setting",
    [
        "fiber.count=1000000000000",
        "discretization.nodes=100000000",
        "discretization.nodes=9223372036854775808",
        "record.positions_every=1e-300",
        "record.observables_every=nan",
        "stepping.until=inf",
        "fiber.length=nan",
        "fluid.mu_bar=-inf",
        "initial={kind='file', path='/dev/zero'}",
        "initial={kind='file', path='/'}",
        "initial={kind='file', path='a\\u0000b'}",
        "flow={kind='python', file='/dev/zero'}",
        "load={kind='python', file='/'}",
        "domain={kind='periodic', periods=[1e400, 0, 0]}",
    ],
)
def test_what_would_take_for_ever_is_refused_at_once(setting, tmp_path):
    out = tmp_path / "run.zarr"
    _said_cleanly(_command("run", BUCKLING, "--out", out, "--set", setting))
    assert not out.exists()


@pytest.mark.parametrize("path", ["/dev/zero", "/", "/nowhere/case.toml", "fifo"])
@pytest.mark.parametrize("command", ["run", "check"])
def test_what_is_no_file_is_no_case(path, command, tmp_path):
    if path == "fifo":
        path = str(tmp_path / "fifo")
        os.mkfifo(path)
    elif not path.startswith("/nowhere") and not Path(path).exists():
        pytest.skip("no such place here")
    words = ["--out", tmp_path / "run.zarr"] if command == "run" else []
    assert path in _said_cleanly(_command(command, path, *words))


TRAP = (
    "from pathlib import Path\nPath({mark!r}).write_text('ran')\n"
    + """
import numpy as np
def velocity(points, t):
    return points * np.array([0.0, 1.0, -1.0])
def density(points, t):
    return 0.0 * points
"""
)
TABLE = {
    "flow": "flow = {kind = 'python', file = 'trap.py'}\n",
    "sum": "flow = {kind = 'sum', flows = [{kind = 'python', file = 'trap.py'}]}\n",
    "load": "load = {kind = 'python', file = 'trap.py'}\nflow = {kind = 'shear', rate = 1.0}\n",
}


@pytest.mark.parametrize("where", TABLE)
def test_no_command_runs_a_cases_code_without_leave(where, tmp_path):
    """The file leaves a mark when it runs."""
    mark, case, out = tmp_path / "mark", tmp_path / "case.toml", tmp_path / "run.zarr"
    (tmp_path / "trap.py").write_text(TRAP.format(mark=str(mark)))
    case.write_text(
        TABLE[where] + "fiber.slenderness = 1e-2\nfluid.mu_bar = 10.0\n"
        "stepping = {dt = 0.1, until = 0.3}\ndiscretization.nodes = 8\n"
    )
    for words in (["check", case], ["run", case, "--out", out], ["cite", case]):
        result = _command(*words)
        assert not mark.exists(), words
        assert "Traceback" not in result.output
        if words[0] != "cite":
            assert "--allow-python" in _said_cleanly(result)
    assert _command("run", case, "--out", out, "--allow-python", "-q").exit_code == 0
    assert mark.read_text() == "ran", "the trap works"
    mark.unlink()
    for words in (
        ["show", out],
        ["plot", out, "panels", "--out", tmp_path / "a.png"],
        ["plot", out, "slice", "--points", 6, "--out", tmp_path / "b.png"],
        ["resume", out, "--until", 0.5],
    ):
        result = _command(*words)
        assert not mark.exists(), words
        assert "Traceback" not in result.output
        if "slice" in words or "resume" in words:
            assert "--allow-python" in _said_cleanly(result)
    assert _command("resume", out, "--until", 0.5, "--allow-python", "-q").exit_code == 0
    assert mark.exists()


def test_settings_and_pickles_run_nothing(tmp_path):
    """A .npy file may hold pickled objects, which run code when they are loaded."""
    import numpy as np

    class Trap:
        def __reduce__(self):
            return (Path.write_text, (tmp_path / "mark", "ran"))

    np.save(tmp_path / "trap.npy", np.array([Trap()], dtype=object), allow_pickle=True)
    setting = f"initial={{kind='file', path='{tmp_path / 'trap.npy'}'}}"
    said = _said_cleanly(_command("check", BUCKLING, "--set", setting))
    assert "a .npy file of numbers" in said
    assert not (tmp_path / "mark").exists()


def test_the_limit_on_records_leaves_long_runs_alone():
    refuse_endless(Schedule(0.01, 0.001), 1e5)
    with pytest.raises(InputError, match=r"record\.observables_every"):
        refuse_endless(Schedule(0.01, 1e-12), 1e5)
