"""``stokesfibers export`` as a user types it."""

from __future__ import annotations

import pytest


def test_several_formats_at_once(run, invoke):
    pytest.importorskip("vtk", reason="the extra 'vtk' is not installed")
    pytest.importorskip("h5py", reason="the extra 'netcdf' is not installed")
    there = {name: run.with_name(name) for name in ("shapes", "run.nc", "tables")}
    words = ["--vtk", there["shapes"], "--netcdf", there["run.nc"], "--csv", there["tables"]]
    result = invoke("export", run, *words)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.splitlines() == [
        *(str(place) for place in there.values()),
        f"Next: paraview {there['shapes'] / 'fibers.pvd'}",
    ]
    assert len(list(there["shapes"].glob("fibers_*.vtp"))) == 5
    assert not list(there["shapes"].glob("cell*"))  # free space has no cell
    assert there["run.nc"].read_bytes()[1:4] == b"HDF"
    refused = invoke("export", run, "--csv", there["tables"])
    assert refused.exit_code == 2
    assert "Add --overwrite to replace it" in refused.stderr
    assert invoke("export", run, "--csv", there["tables"], "--overwrite", "-q").stdout == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "expected at least one of --vtk, --netcdf, --csv or --rrd"),
        (["--csv", "out", "--wrap"], "--wrap: expected --vtk"),
        (["--csv", "no/such/folder"], "a place in a folder that exists"),
    ],
)
def test_what_does_not_fit_is_refused(words, said, run, invoke, monkeypatch):
    monkeypatch.chdir(run.parent)
    before = sorted(p.name for p in run.parent.iterdir())
    result = invoke("export", run, *words)
    assert result.exit_code == 2
    assert said in result.stderr
    assert sorted(p.name for p in run.parent.iterdir()) == before


def test_help_names_the_formats(invoke):
    text = invoke("export", "--help").stdout
    assert all(word in text for word in ("--vtk", "--netcdf", "--csv", "--rrd", "--overwrite"))
