"""Case files to start from: every shipped one can be had and is valid."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from stokesfibers.cli.main import main
from stokesfibers.config.case import load_case
from stokesfibers.config.shipped import shipped_cases


def invoke(*words: object):
    return CliRunner().invoke(main, ["new", *map(str, words)])


def test_lists_all_with_what_they_are():
    said = invoke().output
    for name in ("buckling", "cloud", "sheared_cell", "sweeps/buckling"):
        assert name in said
    assert "A flexible fiber in shear flow buckles" in said


@pytest.mark.parametrize("name", [n for n in shipped_cases() if "/" not in n])
def test_a_copy_is_a_valid_case(name, tmp_path):
    out = tmp_path / "mine.toml"
    assert invoke(name, "--out", out).exit_code == 0
    assert load_case(out).problem == load_case(shipped_cases()[name]).problem


@pytest.mark.parametrize("name", shipped_cases())
def test_comments_speak_of_what_an_installed_user_has(name):
    text = shipped_cases()[name].read_text()
    comments = "\n".join(re.findall("#.*", text))
    assert f"stokesfibers new {name}" in comments
    assert not re.search(r"cases/|docs/|\.md\b", comments)
    stem = f"{Path(name).name}_sweep" if name.startswith("sweeps/") else name
    used = re.findall(r"stokesfibers (?:run|check|sweep) (\S+\.toml)", comments)
    assert set(used) == {f"{stem}.toml"}


def test_the_tutorial_tells_of_the_shipped_case(tmp_path):
    page = Path(__file__).parents[3] / "docs" / "tutorial.md"
    block = re.search(r"```toml\n(.*?)```", page.read_text(), re.DOTALL)
    assert block is not None
    file = tmp_path / "buckling.toml"
    file.write_text(block[1])
    told, shipped = load_case(file), load_case(shipped_cases()["buckling"])
    assert told.problem == shipped.problem
    assert told.initial == shipped.initial
    assert told.until == shipped.until
    assert told.record.positions_every == shipped.record.positions_every
    assert told.record.observables_interval == shipped.record.observables_interval


def test_the_next_command_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "Next: stokesfibers run buckling.toml\n" in invoke("buckling").stderr
    assert "Next: stokesfibers sweep buckling_sweep.toml\n" in invoke("sweeps/buckling").stderr


def test_nothing_is_overwritten_and_bad_names_are_told(tmp_path: Path):
    out = tmp_path / "mine.toml"
    out.write_text("mine")
    refused = invoke("buckling", "--out", out)
    assert refused.exit_code == 2
    assert "does not exist" in refused.output
    assert out.read_text() == "mine"
    unknown = invoke("bukling")
    assert unknown.exit_code == 2
    assert "Did you mean 'buckling'?" in unknown.output
    assert "buckling" in unknown.output
    assert invoke("buckling", "--out", tmp_path / "none" / "x.toml").exit_code == 2


def test_a_sweep_comes_with_the_case_that_it_varies(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = invoke("sweeps/buckling")
    assert said.exit_code == 0, said.output
    assert sorted(p.name for p in tmp_path.iterdir()) == ["buckling.toml", "buckling_sweep.toml"]
    planned = CliRunner().invoke(main, ["sweep", "buckling_sweep.toml", "--out", "b", "--dry-run"])
    assert planned.exit_code == 0, planned.output


def test_a_sweep_keeps_an_edited_case_and_says_so(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "buckling.toml").write_text("# mine")
    made = invoke("sweeps/buckling")
    assert made.exit_code == 0, made.output
    assert made.stdout == "buckling_sweep.toml\n"
    assert "Kept buckling.toml, which differs from the shipped one.\nThe sweep" in made.stderr
    assert (tmp_path / "buckling.toml").read_text() == "# mine"
    assert 'base = "buckling.toml"' in (tmp_path / "buckling_sweep.toml").read_text()
    again = invoke("sweeps/buckling")
    assert again.exit_code == 2
    assert "NAME: expected a file to write that does not exist, got buckling_sweep." in again.stderr
    assert "choose another name with --out FILE." in again.stderr


def test_another_file_that_the_case_reads_is_kept(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cloud.npy").write_bytes(b"mine")
    refused = invoke("cloud", "--out", "other.toml")
    assert refused.exit_code == 2
    assert "'cloud.npy', which the case reads, got another file of that name" in refused.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["cloud.npy"]
    assert (tmp_path / "cloud.npy").read_bytes() == b"mine"
