"""What is derived from runs is replaced, and said to be; runs, exports and cases are kept."""

from __future__ import annotations

from pathlib import Path

import pytest

from stokesfibers.study import sweep_netcdf

GIF = ["--size", "320x240", "--dpi", "60", "--workers", "1", "--fps", "10", "--duration", "0.1"]


@pytest.mark.parametrize(
    ("words", "made"),
    [
        (["plot", "run.zarr", "energy"], "run-energy.png"),
        (["report", "run.zarr"], "run.html"),
        (["movie", "run.zarr", "run.gif", *GIF], "run.gif"),
        (["sweep", "collect", "two", "--netcdf", "two.nc"], "two.nc"),
    ],
    ids=["plot", "report", "movie", "sweep"],
)
def test_a_derived_file_is_replaced_and_said_to_be(words, made, run, invoke, monkeypatch):
    monkeypatch.chdir(run.parent)
    if "sweep" in words:
        _sweep(invoke)
    first = invoke(*words)
    assert (first.exit_code, first.stderr) == (0, "")
    whole = Path(made).stat().st_size
    Path(made).write_text("older")
    again = invoke(*words)
    assert again.exit_code == 0
    assert again.stderr == f"replaced: {made}\n"
    assert again.stdout == first.stdout
    assert Path(made).stat().st_size == pytest.approx(whole, rel=0.01)


def test_figures_of_the_paper_are_replaced_and_said_to_be(tmp_path, invoke):
    words = ["reproduce", "fig14", "--quick", "--out", tmp_path / "out"]
    assert "replaced" not in invoke(*words).stderr
    said = invoke(*words).stderr
    assert said.startswith("computing fig14\nreplaced: ")
    assert str(tmp_path / "out" / "fig14.json") in said


def test_runs_and_exports_are_kept(run, case, invoke):
    (run / "mine.txt").write_text("mine")
    kept = invoke("run", case, "--out", run)
    assert kept.exit_code == 2
    assert "replace it with --overwrite" in kept.stderr
    assert (run / "mine.txt").exists()
    table = run.with_name("tables")
    assert invoke("export", run, "--csv", table).exit_code == 0
    before = {p.name: p.stat().st_mtime_ns for p in table.iterdir()}
    kept = invoke("export", run, "--csv", table)
    assert kept.exit_code == 2
    assert "Add --overwrite to replace it" in kept.stderr
    assert {p.name: p.stat().st_mtime_ns for p in table.iterdir()} == before


def test_an_older_file_survives_a_figure_that_fails(run, invoke):
    page = run.with_suffix(".html")
    page.write_text("older")
    failed = invoke("plot", run, "shapes", "--time", 99, "--out", run.with_name("run.png"))
    assert failed.exit_code == 2
    assert "replaced" not in failed.stderr
    assert page.read_text() == "older"


def test_netcdf_that_cannot_be_is_refused_before_anything_runs(case, invoke, monkeypatch):
    monkeypatch.chdir(case.parent)
    _write_sweep()
    for place, told in (("no/two.nc", "Make no first."), (".", "a file, got ., a folder")):
        result = invoke("sweep", "two.toml", "--netcdf", place)
        assert result.exit_code == 2
        assert f"--netcdf: expected {'a file' if place == '.' else 'a file in'}" in result.stderr
        assert told in result.stderr
        assert not Path("two").exists()


def test_netcdf_that_fails_leaves_the_older_one(tmp_path, monkeypatch):
    import xarray as xr

    file = tmp_path / "a.nc"
    file.write_text("older")

    def full(_data: xr.Dataset, part: Path, **_how: object) -> None:
        part.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", full)
    with pytest.raises(OSError, match="No space left"):
        sweep_netcdf.write_netcdf(xr.Dataset({"a": 1.0}), file)
    assert [p.read_text() for p in tmp_path.iterdir()] == ["older"]


def _write_sweep() -> None:
    Path("two.toml").write_text(
        'base = "case.toml"\n[set]\nstepping.until = 0.0256\n[grid]\nfluid.mu_bar = [1e3]\n'
        '[collect]\nfinal = ["elastic_energy"]\n'
    )


def _sweep(invoke) -> None:
    _write_sweep()
    assert invoke("sweep", "two.toml", "--workers", 1, "--quiet").exit_code == 0
