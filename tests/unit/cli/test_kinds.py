"""A command given the wrong kind of file or folder says what it is and which command takes it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from stokesfibers.cli.kinds import kind_of

SWEEP = """\
base = "case.toml"
grid.fluid.mu_bar = [1e3, 1e4]
collect.final = ["elastic_energy"]
"""


@pytest.fixture
def places(run: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """One of each kind, in the current folder."""
    monkeypatch.chdir(run.parent)
    Path("sweep.toml").write_text(SWEEP)
    Path("two/runs/a=1-0.zarr").mkdir(parents=True)
    Path("two/sweep.json").write_text("{}")
    attributes = {"cases": 2, "collect": "{}", "provenance": "{}"}
    Path("two/sweep.zarr").mkdir()
    Path("two/sweep.zarr/zarr.json").write_text(json.dumps({"attributes": attributes}))
    Path("tables").mkdir()
    Path("tables/export.json").write_text("{}")
    return {
        "case": Path("case.toml"),
        "sweep": Path("sweep.toml"),
        "run": Path("run.zarr"),
        "folder": Path("two"),
        "dataset": Path("two/sweep.zarr"),
        "export": Path("tables"),
    }


def test_each_is_told_from_the_others(places):
    assert {name: kind_of(path) for name, path in places.items()} == {n: n for n in places}


@pytest.mark.parametrize(
    ("name", "content"),
    [("a.toml", "[fiber"), ("a.toml", "x = 1"), ("a.toml", ""), ("a.txt", "[fiber]"), ("no", None)],
)
def test_what_is_not_known_is_left_to_the_command(name, content, tmp_path):
    if content is not None:
        (tmp_path / name).write_text(content)
    assert kind_of(tmp_path / name) is None
    assert kind_of(tmp_path) is None
    (tmp_path / "zarr.json").write_text("[1]")
    assert kind_of(tmp_path) is None


WRONG = [
    ("run sweep.toml", "a case file, got a sweep file. Run it with: stokesfibers sweep sweep.toml"),
    ("run run.zarr", "a case file, got a stored run. See it with: stokesfibers show run.zarr; go"),
    ("check run.zarr", "go on with: stokesfibers resume run.zarr"),
    ("cite two", "a case file, got the folder of a sweep. Go on with the sweep file; how its"),
    ("resume case.toml", "a stored run, got a case file. Run it first: stokesfibers run case.toml"),
    ("show sweep.toml", "got a sweep file. Run it with: stokesfibers sweep sweep.toml"),
    ("plot tables shapes", "got an export of a run. Give the run that it was made from."),
    (
        "view two",
        "Give one of its runs, such as two/runs/a=1-0.zarr; or draw what it gave: ",
    ),
    ("report two/sweep.zarr", 'the dataset of a sweep. Read it with xarray.open_zarr("two/sweep'),
    ("movie case.toml a.gif", "a stored run, got a case file"),
    ("export two --csv x", "a stored run, got the folder of a sweep"),
    ("sweep case.toml", "a sweep file, got a case file. Run it with: stokesfibers run case.toml"),
    ("sweep two", "a sweep file, got the folder of a sweep. Go on with the sweep file; how its ca"),
    ("sweep status sweep.toml", "the folder of a sweep, got a sweep file. That is what was given"),
    ("sweep status two/sweep.zarr", "how its cases stand: stokesfibers sweep status two"),
    ("sweep collect run.zarr", "the folder of a sweep, got a stored run"),
]


@pytest.mark.parametrize(("words", "told"), WRONG, ids=[words for words, _ in WRONG])
@pytest.mark.usefixtures("places")
def test_the_wrong_kind_is_named_with_the_command_that_takes_it(words, told, invoke):
    before = sorted(Path().rglob("*"))
    result = invoke(*words.split())
    assert result.exit_code == 2
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert line.startswith("error: ")
    assert told in line
    assert sorted(Path().rglob("*")) == before
