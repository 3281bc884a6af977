"""Rows, verdicts and what a reproduction writes."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from stokesfibers.experiments.base import Experiment, Row, Settings
from stokesfibers.experiments.registry import EXPERIMENTS


@pytest.mark.parametrize(
    ("row", "verdict"),
    [
        (Row("x", 1.0), "reported"),
        (Row("x", 1.0, 1.0, 0.9, 1.1), "agrees"),
        (Row("x", 0.9, 1.0, 0.9, 1.1), "agrees"),
        (Row("x", 1.2, 1.0, 0.9, 1.1), "differs"),
        (Row("x", 1.2, 1.0, 0.9, 1.1, known="twice", known_high=1.3), "known difference"),
        (Row("x", 1.0, 1.0, 0.9, 1.1, known="twice", known_high=1.3), "agrees"),
        (Row("x", 1.4, 1.0, 0.9, 1.1, known="twice", known_high=1.3), "differs"),
        (Row("x", 5.0, low=4.0), "agrees"),
        (Row("x", 3.0, low=4.0), "differs"),
        (Row("x", 5.0, high=4.0), "differs"),
        (Row("x", float("nan"), low=4.0), "differs"),
        (Row("x", float("inf"), low=4.0), "differs"),
    ],
)
def test_verdict(row, verdict):
    assert row.verdict == verdict


def test_known_reason_is_said_only_where_it_applies():
    assert "twice" in Row("x", 1.2, 1.0, 0.9, 1.1, known="twice", known_high=1.3).to_dict()["note"]
    assert (
        "twice" not in Row("x", 1.0, 1.0, 0.9, 1.1, known="twice", known_high=1.3).to_dict()["note"]
    )


def test_row_of_nan_is_json():
    assert json.loads(json.dumps(Row("x", float("nan")).to_dict(), allow_nan=False))["ours"] is None


def _figure_of_nothing(data):
    from stokesfibers.plot.style import new_axes

    ax = new_axes()
    ax.plot(data["x"])
    return ax.figure


def _stub(monkeypatch: pytest.MonkeyPatch, rows: list[Row]) -> Experiment:
    class Parts:
        @staticmethod
        def run(settings: Settings) -> xr.Dataset:
            return xr.Dataset({"x": ("n", np.arange(3.0))}, attrs={"quick": int(settings.quick)})

        figure = staticmethod(_figure_of_nothing)

        @staticmethod
        def check(data: xr.Dataset) -> list[Row]:  # noqa: ARG004
            return rows

    monkeypatch.setitem(sys.modules, "stub_experiment", Parts)
    return Experiment("stub", "a title", "a source", "stub_experiment")


def test_reproduce_writes_files_that_hold_what_it_returns(monkeypatch, tmp_path):
    experiment = _stub(monkeypatch, [Row("a", 1.0, 1.0, 0.5, 1.5), Row("b", 2.0)])
    summary = experiment.reproduce(tmp_path / "new", quick=True, seed=3)
    assert json.loads((tmp_path / "new" / "stub.json").read_text()) == summary
    assert (summary["verdict"], summary["quick"], summary["seed"]) == ("agrees", True, 3)
    assert sorted(summary["files"]) == ["stub.json", "stub.nc", "stub.pdf", "stub.png"]
    with xr.open_dataset(tmp_path / "new" / "stub.nc", engine="scipy") as data:
        assert data["x"].to_numpy().tolist() == [0.0, 1.0, 2.0]
        assert data.attrs["quick"] == 1


def test_one_row_that_differs_makes_the_whole_differ(monkeypatch, tmp_path):
    experiment = _stub(monkeypatch, [Row("a", 1.0, 1.0, 0.5, 1.5), Row("b", 2.0, high=1.0)])
    assert experiment.reproduce(tmp_path)["verdict"] == "differs"


def test_known_difference_is_not_a_failure(monkeypatch, tmp_path):
    experiment = _stub(monkeypatch, [Row("b", 2.0, high=1.0, known="a misprint", known_high=3.0)])
    summary = experiment.reproduce(tmp_path)
    assert summary["verdict"] == "agrees"
    assert summary["rows"][0]["verdict"] == "known difference"


def test_listing_loads_neither_solver_nor_plots():
    code = (
        "import sys; from stokesfibers.experiments.registry import EXPERIMENTS; "
        "print([m for m in ('numpy', 'numba', 'matplotlib', 'xarray') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_has_its_three_parts(name):
    experiment = EXPERIMENTS[name]
    assert experiment.name == name
    parts = experiment._parts()
    assert all(callable(getattr(parts, part)) for part in ("run", "figure", "check"))


def test_a_known_difference_has_a_range():
    with pytest.raises(ValueError, match="without its range"):
        Row("x", 1.2, 1.0, 0.9, 1.1, known="twice")
