"""Bad input: one clear message, exit code 2, no traceback, nothing left behind or overwritten."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

SETTINGS = [
    # wrong types
    ("fiber.length='long'", "fiber.length: expected a finite number above zero"),
    ("fiber.length=true", "fiber.length: expected a finite number above zero, got True"),
    ("fiber.count=1.0", "fiber.count: expected a whole number"),
    ("fiber=3", "fiber: expected a table"),
    ("flow.rate=[1.0]", "flow.rate: expected a finite number"),
    ("flow='shear'", "flow: expected a table"),
    ("flow.kind=1", "flow.kind: expected one of"),
    ("initial.centre=[0.0, 0.0]", "initial.centre: expected three finite numbers"),
    ("initial.centre=[0.0, 0.0, 'x']", "initial.centre[2]: expected a finite number"),
    ("discretization.intervals=20.5", "discretization.intervals: expected a whole number"),
    ("model.regularization.allow_small_m='no'", "model.regularization"),
    ("engine=['paper']", "engine: expected one of paper, spectral"),
    # unknown and missing
    ("fiber.lenght=1.0", "fiber.lenght: expected one of"),
    ("fluids.mu_bar=1.0", "Did you mean 'fluid.mu_bar'?"),
    ("fluids.x=1.0", "fluids: expected one of"),
    ("mu_bar=1.0", "--set: expected table.key=value with a key of the case, got 'mu_bar=1.0'. Did"),
    ("mubar=1.0", "Did you mean 'fluid.mu_bar'?"),
    ("seed=1", "Did you mean 'initial.seed'?"),
    ("tolerance=1", "Did you mean 'domain.tolerance' or 'constraint.tolerance'?"),
    ("flow.mu_bar=1.0", "Did you mean 'fluid.mu_bar'?"),
    ("stepping.dT=0.1", "stepping.dT: expected one of"),
    ("record.every=0.1", "record.every: expected one of"),
    ("flow.kind='sheer'", "Did you mean 'shear'?"),
    ("flow.speed=1.0", "flow.speed: expected one of"),
    ("flow={kind='uniform'}", "flow.velocity: expected a value"),
    ("flow={kind='sum', flows=[]}", "flow.flows: expected a list of flow tables"),
    ("flow={kind='sum', flows=[{kind='sheer'}]}", "flow.flows[0].kind"),
    ("flow={kind='oscillatory_shear'}", "flow.frequency: expected a value"),
    ("engine='spectrel'", "one of paper, spectral, got 'spectrel'. Did you mean 'spectral'?"),
    (
        "engine='spectral'",
        "which is of engine = 'paper'. Take discretization.nodes instead, or leave",
    ),
    ("domain.kind='periodic'", "domain.periods: expected a value"),
    (
        "domain={kind='periodic', periods=[0.5, 0, 0]}",
        "domain.periods: expected periods of at least the longest fiber, 1, got 0.5 along x.",
    ),
    ("domain={kind='periodic', periods=[2, 2, 0]}", "domain.sum: expected 'truncated'"),
    ("domain={kind='periodic', periods=[2, 0]}", "domain.periods: expected three"),
    ("domain={kind='periodic', periods=[2, 0, 0], sum='fast'}", "domain.sum: expected one of"),
    ("domain={kind='free', reach=3}", "domain.reach: expected nothing in free space"),
    ("constraint.solver='magic'", "constraint.solver: expected one of"),
    ("constraint.tolerance=0", "constraint.tolerance: expected"),
    ("model.close_approach={kind='paper', d0=-1}", "model.close_approach.d0: expected"),
    ("load={kind='steric', strength=1.0}", "load.range: expected a value"),
    ("load={kind='gravitty'}", "load.kind: expected one of"),
    ("initial={kind='suspension'}", "initial.box: expected three lengths"),
    ("initial={kind='suspension', box=[1, 1, -1]}", "initial.box: expected three lengths above"),
    ("initial={kind='suspension', box=[3, 3, 3], orientation='up'}", "orientation.kind: expected"),
    ("initial={kind='lattice', cells=[2, 1, 1], box=[3, 3, 3]}", "initial.cells: expected three"),
    ("initial.kind='helix'", "initial.kind: expected one of"),
    ("model.mobility='local'", "model.mobility: expected nonlocal or local_drag"),
    # values out of range
    ("fiber.length=nan", "fiber.length: expected a finite number above zero, got nan"),
    ("fluid.mu_bar=inf", "fluid.mu_bar: expected a finite number above zero"),
    ("fluid.mu_bar=-1.0", "fluid.mu_bar: expected a finite number above zero"),
    ("fluid.viscosity=0.0", "fluid.viscosity: expected a finite number above zero"),
    ("fiber.rigidity=0.0", "fiber.rigidity: expected a finite number above zero"),
    ("fiber.slenderness=0.2232", "below 0.2231"),
    ("fiber.radius=0.3", "fiber.radius: expected a slenderness"),
    ("fiber.count=2", "initial: expected fibers whose surfaces do not overlap"),
    ("flow.rate=nan", "flow.rate: expected a finite number"),
    ("initial.amplitude=nan", "initial.amplitude: expected a finite number"),
    ("discretization.intervals=7", "discretization.intervals: expected a whole number, 8 to"),
    ("stepping.dt=0.0", "stepping.dt: expected a finite number above zero"),
    ("stepping.dt=-0.1", "stepping.dt: expected a finite number above zero"),
    ("stepping.until=0.0", "stepping.until: expected a finite number above zero"),
    ("constraint.beta=-1.0", "constraint.beta: expected a finite number, zero or above"),
    ("record.positions_every=0.0", "record.positions_every: expected a finite number above zero"),
    ("record.points=3", "record.points: expected a whole number, 6 or more"),
    ("model.regularization={kind='paper', m=1.6}", "model.regularization.m: expected a number"),
    ("model.regularization={kind='paper', ramp=0.6}", "model.regularization.ramp"),
    ("model={mobility='local_drag', regularization={kind='none'}}", "model.regularization"),
    ("flow={kind='none'}", "constraint.beta: expected a value, since there is no flow rate"),
    # bad --set
    ("fluid.mu_bar", "--set: expected table.key=value"),
    ("=1.0", "--set: expected table.key=value"),
    ("fluid..mu_bar=1.0", "--set: expected table.key=value"),
    ("stepping.dt.x=1.0", "--set: expected 'stepping.dt' to be a table"),
    ("fiber[2].length=1.0", "--set: expected 'fiber' to hold tables"),
    # Python without permission, files that are not there
    ("flow={kind='python', file='flow.py'}", "Add --allow-python if you trust the file."),
    ("flow={kind='python'}", "flow.file: expected the name of a Python file"),
    ("initial={kind='file', path='none.npy'}", "which does not exist"),
    ("initial={kind='file', path=3}", "initial.path: expected the name of a .npy file"),
]


def fingerprint(folder: Path) -> dict[str, str]:
    """Return a checksum of every file below `folder`."""
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


def assert_refused(result: Any, fragment: str) -> None:
    """Assert exit code 2 and one message that says `fragment`."""
    said = result.stderr.strip().splitlines()
    assert result.exit_code == 2, result.output
    assert len(said) == 1, result.stderr
    assert said[0].startswith("error: ")
    assert fragment in said[0]
    assert result.stdout == ""


@pytest.mark.parametrize(("setting", "fragment"), SETTINGS, ids=[s for s, _ in SETTINGS])
def test_bad_setting_is_refused(setting, fragment, case, invoke):
    before = fingerprint(case.parent)
    assert_refused(
        invoke("run", case, "--out", case.with_name("run.zarr"), "--set", setting), fragment
    )
    assert fingerprint(case.parent) == before


@pytest.mark.parametrize("command", ["check", "cite"])
def test_every_command_that_reads_a_case_refuses(command, case, invoke):
    assert_refused(invoke(command, case, "--set", "fiber.length=nan"), "fiber.length")


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        (b"[fiber", "expected valid TOML"),
        (b"\xff\xfe[fiber]", "expected a readable TOML file"),
        (b"[stepping]\nuntil = 61,44\n", "Decimals have a point: 61.44."),
        (
            b"[fiber]\nlength = 1 mm\n",
            "The line is: length = 1 mm  Numbers have no unit behind them.",
        ),
        (b"[flow]\nkind = shear\n", "The line is: kind = shear  Text is in quotes."),
        (b"[flow]\nrate =\n", "The line is: rate =  A value is missing behind =."),
        (b"a = 2e5\na = 2e5\n", "The line is: a = 2e5  It is there twice."),
        (b"a = {x = 1e3, x = 2}\n", "It is there twice."),
        (b"a = True\n", "The line is: a = True  Write true."),
        (b'a = "=b"c"\n', 'The line is: a = "=b"c"'),
        (b"", "fiber: expected a table"),
        (
            b"[fiber]\nslenderness=1e-2\n[flow]\nkind='shear'\n",
            "fluid.mu_bar: expected either mu_bar or viscosity",
        ),
        (b"fiber = []\n", "fiber: expected at least one"),
        (
            b"[fiber]\nslenderness=1e-2\nradius=1e-2\n[fluid]\nmu_bar=1.0\n",
            "fiber.slenderness: expected either slenderness or radius",
        ),
        (
            b"[fiber]\nslenderness=1e-2\n[fluid]\nmu_bar=1.0\n[flow]\nkind='shear'\n",
            "stepping.until: expected the time to stop",
        ),
    ],
    ids=[
        "no toml",
        "no text",
        "comma",
        "unit",
        "quotes",
        "nothing",
        "twice",
        "twice inline",
        "True",
        "quote",
        "empty",
        "no fluid",
        "no fiber",
        "both",
        "no end",
    ],
)
def test_bad_case_file_is_refused(text, fragment, case, invoke):
    case.write_bytes(text)
    before = fingerprint(case.parent)
    assert_refused(invoke("run", case, "--out", case.with_name("run.zarr")), fragment)
    assert fingerprint(case.parent) == before


def test_missing_case_file_and_folder_are_refused(tmp_path, invoke):
    out = tmp_path / "run.zarr"
    assert_refused(invoke("run", tmp_path / "no.toml", "--out", out), "no such file")
    assert_refused(invoke("run", tmp_path, "--out", out), "expected a case file, got a folder.")
    assert list(tmp_path.iterdir()) == []


def test_a_case_file_that_may_be_meant_is_named(case, invoke):
    assert_refused(invoke("check", case.with_name("cse.toml")), "Did you mean 'case.toml'?")
    assert_refused(invoke("check", case.parent), f"got a folder. There is {case} in it.")


def _line(length: float, points: int = 30) -> np.ndarray:
    return np.linspace([0.0, 0.0, 0.0], [length, 0.0, 0.0], points)


@pytest.mark.parametrize(
    ("points", "fragment"),
    [
        (np.zeros((2, 30, 3)), "expected an array of shape (1, point, 3)"),
        (_line(1.0)[:, :2], "expected an array of shape (1, point, 3)"),
        (_line(1.0)[:, 0], "expected an array of shape (1, point, 3)"),
        (_line(1.0, 4), "6 points or more"),
        (_line(1.05), "expected a curve of length 1 within 1 %, got length 1.05"),
        (np.full((30, 3), np.nan), "expected finite coordinates"),
        (np.zeros((30, 3)), "expected distinct neighbouring points"),
    ],
    ids=["two fibers", "flat", "numbers", "few", "5 % long", "nan", "one point"],
)
def test_bad_initial_points_are_refused(points, fragment, case, invoke):
    np.save(case.with_name("points.npy"), points)
    before = fingerprint(case.parent)
    setting = "initial={kind='file', path='points.npy'}"
    out = case.with_name("run.zarr")
    assert_refused(invoke("run", case, "--out", out, "--set", setting), fragment)
    assert fingerprint(case.parent) == before


@pytest.mark.parametrize("content", [b"", b"no array", b"\x93NUMPY\x01\x00"])
def test_unreadable_initial_points_are_refused(content, case, invoke):
    case.with_name("points.npy").write_bytes(content)
    setting = "initial={kind='file', path='points.npy'}"
    out = case.with_name("run.zarr")
    assert_refused(
        invoke("run", case, "--out", out, "--set", setting), "expected a .npy file of numbers"
    )
    assert not out.exists()


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        ("x = ", "expected a Python file that imports"),
        ("x = 1\n", "expected a function named 'velocity', got a file with no function"),
        ("velocity = 3\n", "'velocity' to be a function"),
        ("def velocity(x, t): return x[:, 0]\n", "expected an array of shape"),
        ("def velocity(x, t): return x / 0.0 * float('nan')\n", "velocity function"),
    ],
)
def test_bad_python_flow_is_refused(text, fragment, case, invoke):
    case.with_name("flow.py").write_text(text)
    out = case.with_name("run.zarr")
    settings = ["--set", "flow={kind='python', file='flow.py'}", "--set", "constraint.beta=20.0"]
    result = invoke("run", case, "--out", out, "--allow-python", *settings)
    assert_refused(result, fragment)
    assert not out.exists()


def test_python_flow_does_not_run_without_permission(case, invoke):
    case.with_name("flow.py").write_text(
        f"open({str(case.with_name('touched'))!r}, 'w').close()\ndef velocity(x, t): return x\n"
    )
    setting = "flow={kind='python', file='flow.py'}"
    assert_refused(invoke("check", case, "--set", setting), "--allow-python")
    assert not case.with_name("touched").exists()


def test_store_that_exists_is_kept(run, case, invoke):
    before = fingerprint(run)
    assert_refused(invoke("run", case, "--out", run), "expected a path that does not exist yet")
    assert fingerprint(run) == before


def test_only_a_run_is_overwritten(case, invoke):
    folder = case.with_name("mine")
    folder.mkdir()
    (folder / "thesis.txt").write_text("years of work")
    result = invoke("run", case, "--out", folder, "--overwrite")
    assert_refused(result, "Nothing else is ever overwritten")
    assert (folder / "thesis.txt").read_text() == "years of work"
    assert {p.name for p in case.parent.iterdir()} == {"case.toml", "mine"}


def test_missing_parent_folder_is_refused(case, invoke):
    out = case.with_name("no") / "run.zarr"
    assert_refused(invoke("run", case, "--out", out), "Make the folder")
    assert {p.name for p in case.parent.iterdir()} == {"case.toml"}


@pytest.mark.parametrize("words", [["show"], ["resume"], ["plot", "shapes"]])
@pytest.mark.parametrize("what", ["missing", "file", "folder", "foreign", "damaged", "version"])
def test_unusable_store_is_refused(words, what, tmp_path, invoke):
    path = tmp_path / "run.zarr"
    fragments = {
        "missing": "nothing there",
        "file": "a file, not a folder",
        "folder": "so not a Zarr store",
        "foreign": "a Zarr store of another kind",
        "damaged": "a damaged one",
        "version": "format version",
    }
    if what == "file":
        path.write_text("text")
    elif what != "missing":
        path.mkdir()
    attributes = {"format": "stokesfibers-run", "format_version": 99}
    texts = {
        "foreign": json.dumps({"zarr_format": 3, "node_type": "group"}),
        "damaged": '{"zarr_format": 3, "attr',
        "version": json.dumps({"attributes": attributes}),
    }
    if what in texts:
        (path / "zarr.json").write_text(texts[what])
    before = fingerprint(tmp_path)
    assert_refused(invoke(words[0], path, *words[1:]), fragments[what])
    assert fingerprint(tmp_path) == before


def test_damaged_checkpoint_is_refused_and_records_still_shown(run, invoke):
    for chunk in (run / "checkpoint" / "x" / "c").rglob("*"):
        if chunk.is_file():
            chunk.write_bytes(bytes(len(chunk.read_bytes())))
    assert_refused(invoke("resume", run), "expected an intact checkpoint")
    assert invoke("show", run).exit_code == 0


@pytest.mark.parametrize("until", ["0", "-1", "nan", "0.1"])
def test_bad_new_end_is_refused(until, run, invoke):
    before = fingerprint(run)
    result = invoke("resume", run, "--until", until, "--quiet")
    assert_refused(result, "until")
    assert {k: v for k, v in fingerprint(run).items() if "zarr.json" not in k} == {
        k: v for k, v in before.items() if "zarr.json" not in k
    }


def test_bad_plots_are_refused(run, invoke):
    assert_refused(invoke("plot", run, "shape"), "KIND: expected one of shapes, panels")
    assert_refused(invoke("plot", run, "shapes", "--out", run.with_name("a.doc")), "file name")
    missing = run.with_name("no") / "a.png"
    assert_refused(invoke("plot", run, "shapes", "--out", missing), "a folder that exists")


def test_bad_reproductions_are_refused(tmp_path, invoke):
    assert_refused(invoke("reproduce", "fig99", "--out", tmp_path), "NAME: expected one of fig01")
    assert_refused(invoke("reproduce", "fig14"), "--out: expected a folder for the results")
    deep = tmp_path / "no" / "out"
    assert_refused(invoke("reproduce", "fig14", "--out", deep), "Make the folder")
    (tmp_path / "file").write_text("text")
    assert_refused(invoke("reproduce", "fig14", "--out", tmp_path / "file"), "a file")


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (["rum"], "No such command 'rum'"),
        (["run"], "Missing argument 'CASE'"),
        (["run", "case.toml", "--out", "x", "--threads", "0"], "--threads"),
        (["check", "case.toml", "--seed", "1"], "No such option '--seed'"),
        (["resume", "run.zarr", "--until", "soon"], "--until"),
    ],
)
def test_bad_command_lines_are_refused(words, fragment, invoke):
    result = invoke(*words)
    assert result.exit_code == 2
    assert result.stderr.count("Error:") == 1
    assert fragment in result.stderr
    assert "Traceback" not in result.stderr


def test_too_many_threads_are_refused(case, invoke):
    out = case.with_name("run.zarr")
    assert_refused(invoke("run", case, "--out", out, "--threads", 100000), "threads: expected")
    assert not out.exists()


def test_help_of_view_points_to_where_the_slice_is_explained(invoke):
    said = " ".join(invoke("view", "--help").stdout.split())
    assert "It is computed; see above." in said
    assert said.index("With --slice it is computed from") < said.index("It is computed; see above.")
