"""``stokesfibers validate`` from the shell: lists, tables, files, exit codes."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from stokesfibers.cli.main import main
from stokesfibers.study.validation import registry
from stokesfibers.study.validation.record import Entry, close


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(main, ["validate", *map(str, arguments)])


@pytest.fixture
def _two_entries(monkeypatch):
    def broken(_):
        raise ZeroDivisionError("oh")

    def bad(_):
        return [close("a number", 1.1, 1.0, rtol=1e-3)]

    entries = (
        Entry("bad", "exact", "differs", "nobody", bad),
        Entry("broken", "exact", "fails", "nobody", broken),
        Entry("good", "exact", "agrees", "all", lambda _: [close("one", 1.0, 1.0, rtol=1e-3)]),
    )
    monkeypatch.setattr(registry, "ENTRIES", entries)


def test_list_names_every_entry_with_its_tier(run):
    found = run("list")
    assert found.exit_code == 0
    assert "fig14" in found.output
    listed = json.loads(run("list", "--json").output)
    assert {"name", "group", "tier", "title", "source"} == set(listed[0])
    assert {one["tier"] for one in listed} == {"quick", "full"}


def test_one_entry_writes_three_tables(run, tmp_path):
    found = run("--only", "fig14", "--out", "tables")
    assert found.exit_code == 0, found.output
    assert "largest n with c + lambda_n < 0, eps = 0.01" in found.output
    assert "5 numbers of 1 entries, quick suite" in found.output
    names = sorted(p.name for p in (tmp_path / "tables").glob("validation.*"))
    assert names == ["validation.csv", "validation.json", "validation.md"]
    kept = json.loads((tmp_path / "tables" / "validation.json").read_text())
    assert kept["entries"][0]["findings"][0]["ours"] == 33.0


def test_without_a_folder_nothing_is_left(run, tmp_path):
    found = run("--only", "fig14", "--json")
    assert found.exit_code == 0
    assert json.loads(found.output)["counts"]["agrees"] == 5
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("_two_entries")
def test_differences_and_failures_are_said_and_change_the_exit_code(run):
    found = run("--out", "tables")
    assert found.exit_code == 1
    assert "differs" in found.output
    assert "ZeroDivisionError: oh" in found.output
    assert "bad, broken: numbers differ or failed" in found.output
    assert "1 agrees, 0 explained, 1 differs; 1 entries failed" in found.output
    assert run("--only", "good").exit_code == 0


def test_bad_input_is_said(run, tmp_path):
    found = run("--only", "nothing")
    assert found.exit_code == 2
    assert "--only: expected one of drag," in found.output
    assert run("--only", "fig14", "--out", "no/such").exit_code == 2
    (tmp_path / "file").write_text("")
    found = run("--only", "fig14", "--out", "file")
    assert found.exit_code == 2
    assert "a file" in found.output
    assert run("everything").exit_code == 2
