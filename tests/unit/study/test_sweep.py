"""Sweeps in one process: the dataset, failures, stops, restarts, edited sweeps."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
from copy import deepcopy
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import stokesfibers as sf
from stokesfibers.core.errors import InputError, MissingExtraError, StoreError
from stokesfibers.core.variables import NATURAL_RATES, NATURAL_UNITS
from stokesfibers.io import atomic, lock
from stokesfibers.study import sweep_dataset, sweep_folder, sweep_workers
from stokesfibers.study.sweep import changes, collect, sweep
from stokesfibers.study.sweep_derived import derived, natural_units
from stokesfibers.study.sweep_folder import SweepFolder
from stokesfibers.study.sweep_plan import read_plan
from stokesfibers.study.sweep_tally import tally
from stokesfibers.study.sweep_values import toml_text
from stokesfibers.study.sweep_workers import workers_of
from support import assert_close, assert_same

CASE = {
    "fiber": {"slenderness": 1e-2},
    "fluid": {"mu_bar": 1e3},
    "flow": {"kind": "shear"},
    "initial": {"kind": "nearly_straight", "angle": 2.0, "amplitude": 0.1},
    "stepping": {"rtol": 1e-3, "until": 1.0},
    "record": {"positions_every": 0.25, "observables_every": 0.05},
}
SWEEP = {
    "case": CASE,
    "grid": {"fluid.mu_bar": [1e3, 1e4], "fiber.slenderness": [1e-2, 1e-3]},
    "collect": {
        "series": ["shear_stress"],
        "final": ["elastic_energy", "orientation_tensor"],
        "largest": ["largest_curvature"],
        "smallest": ["shear_stress"],
        "mean": ["shear_stress"],
        "after": 0.2,
    },
}
# A flow that stops a run of rate 2 on the way, and lets the others be.
FLOW = """\
def velocity(x, t):
    if {broken}:
        raise RuntimeError("no wind")
    return x[:, [1, 1, 1]] * [1.0, 0.0, 0.0]
"""


def _sweep(out, tables=SWEEP, **options):
    return sweep(tables, out, workers=1, **options)


def _changed(**parts):
    return deepcopy(SWEEP) | parts


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The folder of a finished sweep."""
    out = tmp_path_factory.mktemp("sweeps") / "whole"
    _sweep(out)
    return out


@pytest.fixture
def copy(whole, tmp_path):
    """A copy of it."""
    return shutil.copytree(whole, tmp_path / "copy")


def test_coordinates_are_the_swept_parameters_and_values_those_of_the_runs(whole):
    data = xr.open_zarr(whole / "sweep.zarr").load()
    assert dict(data.sizes) == {
        "mu_bar": 2,
        "slenderness": 2,
        "time": 21,
        "fiber": 1,
        "i": 3,
        "j": 3,
    }
    assert data["mu_bar"].to_numpy().tolist() == [1e3, 1e4]
    assert data["mu_bar"].attrs == {
        "path": "fluid.mu_bar",
        "units": "1",
        "symbol": r"\bar\mu",
        "long_name": "effective viscosity",
    }
    assert (data["status"] == "done").all()
    assert data.attrs["status"] == "done"
    assert "command" in json.loads(data.attrs["provenance"])
    point = data.sel(mu_bar=1e4, slenderness=1e-3)
    run = sf.open_run(whole / str(point["run"].item()))
    case = json.loads(run.attrs["case"])
    assert case["fluid"]["mu_bar"] == 1e4
    assert case["fiber"][0]["slenderness"] == 1e-3
    held = run["observables"].to_dataset().load()
    stress, late = held["shear_stress"], held["shear_stress"].sel(time=slice(0.2, None))
    assert (point["shear_stress"].to_numpy() == stress.to_numpy()).all()
    assert (point["time"].to_numpy() == held["time"].to_numpy()).all()
    assert point["shear_stress"].attrs["units"] == "force length"
    energy = held["elastic_energy"].to_numpy()
    assert point["elastic_energy_final"].to_numpy().tolist() == energy[-1].tolist()
    tensor = held["orientation_tensor"].to_numpy()
    assert (point["orientation_tensor_final"].to_numpy() == tensor[-1]).all()
    assert point["shear_stress_smallest"] == late.min()
    assert point["shear_stress_smallest_time"] == late["time"][int(late.argmin("time"))]
    curved = held["largest_curvature"].sel(time=slice(0.2, None)).max("time")
    assert (point["largest_curvature_largest"].to_numpy() == curved.to_numpy()).all()
    average = sf.average_of(run, "shear_stress", after=0.2)
    assert point["shear_stress_mean"] == average.mean
    assert point["shear_stress_mean_error"] == average.error
    assert data["shear_stress"].sel(mu_bar=1e3).std() > 0.0


def test_a_case_is_bitwise_the_run_of_its_settings(whole, tmp_path):
    held = xr.open_zarr(whole / "sweep.zarr")["run"].load()
    run = held.sel(mu_bar=1e4, slenderness=1e-3).item()
    case = tmp_path / "case.toml"
    case.write_text("\n".join(f"{key} = {toml_text(value)}" for key, value in CASE.items()))
    loaded = sf.load_case(case, ["fluid.mu_bar=1e4", "fiber.slenderness=1e-3"])
    alone = sf.simulate(loaded.problem, loaded.curves(), until=1.0, record=loaded.record)
    assert_same(sf.open_run(whole / run), alone.data)


def test_finished_cases_are_not_run_again(copy, monkeypatch):
    before = xr.open_zarr(copy / "sweep.zarr").load()
    monkeypatch.setattr(sweep_workers, "run_job", None)  # a call would raise
    again = _sweep(copy)
    xr.testing.assert_identical(again.drop_attrs(deep=False), before.drop_attrs(deep=False))


def test_an_edited_sweep_keeps_what_fits(copy):
    tables = _changed(grid={"fiber.slenderness": [1e-3, 1e-4], "fluid.mu_bar": [1e4]})
    change = changes(copy, read_plan(tables))
    assert (change.kept, change.begun, change.new, len(change.removed)) == (1, 0, 1, 3)
    marks = _marks(copy)
    data = _sweep(copy, tables)
    assert dict(data.sizes)["slenderness"] == 2
    assert (data["status"] == "done").all()
    assert len(_marks(copy)) == 5
    assert {key: _marks(copy)[key] for key in marks} == marks
    assert (copy / str(data["run"].sel(slenderness=1e-3, mu_bar=1e4).item())).is_dir()


def _marks(out):
    """Return when each run of a sweep was last written, by the key of its case."""
    runs = SweepFolder(out).stores()
    return {key: (path / "zarr.json").stat().st_mtime_ns for key, path in runs.items()}


def test_a_failed_case_is_noted_and_stops_no_other(tmp_path):
    for name, broken in (("still", "False"), ("gone", "t > 0.45")):
        (tmp_path / f"{name}.py").write_text(FLOW.format(broken=broken))
    files = [str(tmp_path / f"{name}.py") for name in ("gone", "still")]
    tables = _changed(
        case=CASE | {"flow": {"kind": "python", "file": files[0]}}, grid={"flow.file": files}
    )
    out = tmp_path / "out"
    data = _sweep(out, tables, allow_python=True)
    assert data["status"].to_numpy().tolist() == ["failed", "done"]
    assert data["file"].to_numpy().tolist() == files
    assert "no wind" in data["reason"].to_numpy()[0]
    assert data["reason"].to_numpy()[1] == ""
    assert np.isnan(data["shear_stress"].isel(file=0)).all()
    assert np.isfinite(data["shear_stress"].isel(file=1)).all()
    assert 0.2 < data["time_reached"].to_numpy()[0] <= 0.45
    assert data.attrs["failed"] == 1
    store = out / str(data["run"].to_numpy()[0])
    first = (store / "zarr.json").stat().st_mtime_ns
    _sweep(out, tables, allow_python=True)
    assert (store / "zarr.json").stat().st_mtime_ns == first
    _sweep(out, tables, allow_python=True, retry=True)
    assert (store / "zarr.json").stat().st_mtime_ns > first


def test_a_case_that_cannot_start_is_noted(tmp_path):
    crowd = {"kind": "suspension", "seed": 1, "box": [0.3, 0.3, 0.3], "least_gap": 0.2}
    case = CASE | {"fiber": {"slenderness": 1e-2, "count": 40}, "initial": crowd}
    grid = {"initial.least_gap": [0.2], "fiber.count": [40]}
    data = _sweep(tmp_path / "out", _changed(case=case, grid=grid))
    assert data["status"].item() == "failed"
    assert "initial" in data["reason"].item()
    assert data.attrs["status"] == "done"


def test_a_full_disk_fails_the_case_until_there_is_room(tmp_path, monkeypatch):
    tables, out = _changed(grid={"fluid.mu_bar": [1e3]}), tmp_path / "out"
    real, left = atomic._write, [60]

    def write(fd, data):
        left[0] -= 1
        if left[0] in range(-20, 0):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(fd, data)

    with monkeypatch.context() as patch:
        patch.setattr(atomic, "_write", write)
        data = _sweep(out, tables)
    assert data["status"].item() == "failed"
    assert "No space left on device" in data["reason"].item()
    assert _sweep(out, tables)["status"].item() == "done"


def test_an_interrupted_sweep_goes_on_bitwise(tmp_path, whole):
    stopped = []

    def watch(found, case):
        if case is not None and found.count("done") == 2 and not stopped:
            stopped.append(case)
            signal.raise_signal(signal.SIGINT)

    out = tmp_path / "out"
    data = _sweep(out, watch=watch)
    assert stopped
    assert data.attrs["status"] == "interrupted"
    assert data.attrs["done"] == 2
    assert (xr.open_zarr(out / "sweep.zarr")["status"] == data["status"]).all()
    assert np.isnan(data["shear_stress_mean"].isel(mu_bar=1)).all()
    assert not SweepFolder(out).active()
    data = _sweep(out)
    assert data.attrs["done"] == 4
    for run in data["run"].to_numpy().ravel():
        assert_same(sf.open_run(out / run), sf.open_run(whole / run))


def test_a_run_is_stopped_in_the_middle_when_its_session_ends(tmp_path):
    long = _changed(grid={"fluid.mu_bar": [1e3, 1e4]}, set={"stepping.until": 4000.0})
    out = tmp_path / "out"

    def watch(found, case):
        if case is None and found.share > 0.0:
            (out / "session.json").unlink(missing_ok=True)

    data = _sweep(out, long, watch=watch)
    assert data.attrs["status"] == "interrupted"
    assert data["status"].to_numpy().tolist() == ["interrupted", "waiting"]
    assert 0.0 < data["time_reached"].to_numpy()[0] < 4000.0
    run = sf.open_run(out / data["run"].to_numpy()[0])
    assert run.attrs["status"]["code"] == "interrupted"


def test_cases_of_different_length_keep_their_own_times(tmp_path):
    tables = _changed(
        grid={"stepping.until": [0.5, 1.0]},
        cases=[{"name": "one"}, {"name": "two", "fiber.count": 2, "initial": _lattice()}],
    )
    data = _sweep(tmp_path / "out", tables)
    assert (data["status"] == "done").all()
    assert data.sizes["record"] == 21
    assert data.sizes["fiber"] == 2
    assert data["case"].to_numpy().tolist() == ["one", "two"]
    assert np.isnan(data["count"].to_numpy()[0])
    short = data.isel(until=0, case=0)
    assert np.isfinite(short["shear_stress"][:11]).all()
    assert np.isnan(short["shear_stress"][11:]).all()
    assert short["time"][10] == 0.5
    energy = data["elastic_energy_final"].isel(until=1)
    assert np.isfinite(energy.sel(case="two")).all()
    assert np.isfinite(energy.sel(case="one").to_numpy()).tolist() == [True, False]


def _lattice():
    return {"kind": "lattice", "cells": [2, 1, 1], "box": [4.0, 2.0, 2.0]}


def test_zipped_lists_are_one_dimension_with_several_coordinates(tmp_path):
    tables = _changed(
        grid={},
        zip=[{"name": "pair", "fluid.mu_bar": [1e3, 2e3], "model.mobility": ["local_drag"] * 2}],
    )
    data = _sweep(tmp_path / "out", tables)
    assert data["mu_bar"].dims == data["mobility"].dims == ("pair",)
    assert data["mobility"].to_numpy().tolist() == ["local_drag"] * 2
    assert (data["status"] == "done").all()


def test_a_second_sweep_on_the_folder_is_refused(copy):
    def watch(found, case):  # noqa: ARG001
        with pytest.raises(StoreError, match="a folder where no sweep is running, got one in use"):
            _sweep(copy)
        seen.append(SweepFolder(copy).active())
        assert tally(SweepFolder(copy), read_plan(SWEEP)).active

    seen: list[bool] = []
    shutil.rmtree(next((copy / "runs").glob("*.zarr")))
    _sweep(copy, watch=watch)
    assert seen == [True] * len(seen) != []


def test_who_asks_whether_a_sweep_runs_does_not_stop_one_that_starts(copy, monkeypatch):
    asked = lock.acquire(copy)  # as `sweep status` does for a moment
    pauses = []

    def end(seconds):
        pauses.append(seconds)
        lock.release(asked, copy)

    monkeypatch.setattr(sweep_folder.time, "sleep", end)
    assert _sweep(copy).attrs["done"] == 4
    assert len(pauses) == 1


def test_a_run_that_ends_before_its_time_has_no_averages_and_stops_no_other(tmp_path):
    stop = [{"observable": "largest_curvature", "below": 2e-3}]
    tables = _changed(case=CASE | {"stop": stop}, grid={"fluid.mu_bar": [1e3, 1e4]})
    data = _sweep(tmp_path / "out", tables)
    assert data["status"].to_numpy().tolist() == ["done", "done"]
    assert data["time_reached"].to_numpy()[0] < 0.2
    late = ["shear_stress_smallest", "shear_stress_smallest_time", "shear_stress_mean"]
    for name in (*late, "largest_curvature_largest"):
        found = data[name].to_numpy().reshape(2)
        assert np.isfinite(found).tolist() == [False, True]
    assert np.isfinite(data["elastic_energy_final"]).all()


def test_an_error_of_who_watches_is_raised_and_no_fault_of_the_case(tmp_path):
    long = _changed(grid={"fluid.mu_bar": [1e3, 1e4]}, set={"stepping.until": 4000.0})
    out, seen = tmp_path / "out", []

    def watch(found, case):  # noqa: ARG001
        if found.share > 0.0:
            seen.append(found)
            raise KeyError("mine")

    with pytest.raises(KeyError, match="mine") as caught:
        _sweep(out, long, watch=watch)
    assert len(seen) == 1
    assert "goes on from there" in "".join(caught.value.__notes__)
    data = xr.open_zarr(out / "sweep.zarr").load()
    assert data["status"].to_numpy().tolist() == ["interrupted", "waiting"]
    assert 0.0 < data["time_reached"].to_numpy()[0] < 4000.0
    assert not SweepFolder(out).active()


def test_an_error_at_the_end_of_a_case_stops_the_sweep_too(tmp_path):
    def watch(found, case):  # noqa: ARG001
        if case is not None:
            raise ValueError("mine")

    out = tmp_path / "out"
    with pytest.raises(ValueError, match="mine"):
        _sweep(out, _changed(grid={"fluid.mu_bar": [1e3, 1e4]}), watch=watch)
    held = xr.open_zarr(out / "sweep.zarr")["status"].to_numpy().tolist()
    assert held == ["done", "waiting"]


@pytest.mark.parametrize("change", ["another", "gone"])
def test_a_file_that_is_put_back_is_used(tmp_path, change):
    file = tmp_path / "flow.py"
    file.write_text(FLOW.format(broken="False"))
    tables = _changed(
        case=CASE | {"flow": {"kind": "python", "file": str(file)}}, grid={"fluid.mu_bar": [1e3]}
    )
    plan, out = read_plan(tables, allow_python=True), tmp_path / "out"
    file.unlink()
    if change == "another":
        file.write_text(FLOW.format(broken="t > 9.0"))
    data = sweep(plan, out, workers=1, allow_python=True)
    assert data["status"].item() == "failed"
    assert "put it back" in data["reason"].item()
    file.write_text(FLOW.format(broken="False"))
    assert sweep(plan, out, workers=1, allow_python=True)["status"].item() == "done"


def test_a_sweep_goes_on_where_its_files_were_moved(tmp_path):
    first, second = tmp_path / "one" / "flow.py", tmp_path / "two" / "flow.py"
    first.parent.mkdir()
    first.write_text(FLOW.format(broken="False"))

    def tables(file):
        flow = {"kind": "python", "file": str(file)}
        return _changed(
            case=CASE | {"flow": flow},
            set={"stepping.until": 2000.0},
            grid={"fluid.mu_bar": [1e3]},
        )

    def watch(found, case):  # noqa: ARG001
        if found.share > 0.0:
            signal.raise_signal(signal.SIGINT)

    out = tmp_path / "out"
    data = _sweep(out, tables(first), watch=watch, allow_python=True)
    assert data["status"].item() == "interrupted"
    reached = data["time_reached"].item()
    first.parent.rename(second.parent)
    data = _sweep(out, tables(second), watch=watch, allow_python=True)
    assert data["status"].item() == "interrupted"
    assert data["time_reached"].item() > reached > 0.0
    (start,) = json.loads(sf.open_run(out / data["run"].item()).attrs["resumed"])
    assert 0.0 < start["from_time"] <= reached


def test_folders_of_other_things_are_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(StoreError, match=r"thesis\.txt"):
        _sweep(tmp_path)
    with pytest.raises(StoreError, match="a missing folder"):
        _sweep(tmp_path / "no" / "such")
    with pytest.raises(StoreError, match="the folder of a sweep"):
        collect(tmp_path)


def test_the_dataset_can_be_made_anew_and_a_damaged_run_is_said(copy):
    shutil.rmtree(copy / "sweep.zarr")
    assert collect(copy).attrs["done"] == 4
    run = next((copy / "runs").glob("*.zarr"))
    (run / "zarr.json").write_text("{")
    data = collect(copy)
    assert data.attrs["done"] == 3
    assert "damaged" in "".join(data["reason"].to_numpy().ravel())


def test_a_run_that_was_changed_is_named_until_it_is_mended_or_run_anew(copy):
    run = min((copy / "runs").glob("*.zarr"))
    chunk = next(
        file for file in (run / "observables/elastic_energy/c").rglob("*") if file.is_file()
    )
    whole = chunk.read_bytes()

    def states():
        return [state for _, state in tally(SweepFolder(copy), SweepFolder(copy).plan()).states]

    def damage():
        chunk.write_bytes(bytes([whole[0] ^ 1]) + whole[1:])
        assert collect(copy).attrs["failed"] == 1
        (bad,) = (state for state in states() if state.code == "failed")
        assert "elastic_energy" in bad.reason
        assert "--retry" in bad.reason

    damage()
    chunk.write_bytes(whole)  # put back from a copy
    assert collect(copy).attrs["done"] == 4
    assert {state.code for state in states()} == {"done"}
    damage()
    assert _sweep(copy).attrs["failed"] == 1, "it is not run anew unasked"
    data = _sweep(copy, retry=True)
    assert data.attrs["done"] == 4
    assert {state.code for state in states()} == {"done"}
    assert chunk.read_bytes() == whole


def test_a_run_that_was_interrupted_and_changed_is_not_taken_for_one_that_ended(copy):
    folder, plan = SweepFolder(copy), SweepFolder(copy).plan()
    case = plan.cases[0]
    chunk = next(f for f in (folder.store(case) / "numerics/wall_time/c").rglob("*") if f.is_file())
    chunk.write_bytes(bytes([chunk.read_bytes()[0] ^ 1]) + chunk.read_bytes()[1:])
    begun = {case.key: sweep_folder.State("interrupted", 0.5)}
    assert sweep_dataset.dataset(folder, plan, begun).attrs["failed"] == 1
    assert not folder.note(case).exists()


def test_a_run_that_cannot_be_reduced_is_said(copy, monkeypatch):
    def empty(run, collect):  # noqa: ARG001
        raise IndexError("no records")

    monkeypatch.setattr(sweep_dataset, "reduced", empty)
    data = collect(copy)
    assert data.attrs["failed"] == 4
    assert "no records" in str(data["reason"].to_numpy().ravel()[0])


def test_a_kill_while_the_dataset_is_replaced_loses_nothing(copy):
    (copy / "sweep.zarr").rename(copy / ".sweep.zarr.old")
    (copy / ".sweep.zarr.0123.partial").mkdir()
    (copy / "runs" / ".x.partial").mkdir()
    _sweep(copy)
    assert (copy / "sweep.zarr" / "zarr.json").exists()
    assert not list(copy.rglob(".*.partial")) + list(copy.glob(".*.old"))


def test_without_dask_one_worker_works_and_more_say_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr("stokesfibers.study.sweep_workers.find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'stokesfibers\[sweep\]'"):
        sweep(SWEEP, tmp_path / "out", workers=2)
    assert not (tmp_path / "out").exists()
    assert workers_of(None, 4) == 1
    assert workers_of(1, 4) == 1


def test_bad_numbers_of_workers_are_refused(tmp_path):
    with pytest.raises(InputError, match="workers"):
        sweep(SWEEP, tmp_path / "out", workers=0)
    assert not (tmp_path / "out").exists()


def test_a_result_that_cannot_be_trusted_says_so_in_the_dataset(tmp_path):
    tables = _changed(
        grid={"discretization.nodes": [8, 24]},
        set={"discretization.adapt_nodes": False, "fluid.mu_bar": 1e5, "stepping.until": 3.0},
    )
    tables["case"] = {
        **SWEEP["case"],
        "initial": {"kind": "nearly_straight", "angle": 2.4, "amplitude": 1.0},
    }
    data = _sweep(tmp_path / "out", tables)
    assert data["status"].to_numpy().tolist() == ["done", "done"]
    poor, good = data["doubt"].to_numpy().tolist()
    assert "nodes" in poor
    assert good == ""
    assert data.attrs["doubtful"] == 1


def test_the_dataset_says_where_its_units_are_those_of_the_fiber(tmp_path):
    data = _sweep(tmp_path / "a", SWEEP | {"grid": {"fluid.mu_bar": [1e3, 1e4]}})
    assert {key: data.attrs[key] for key in NATURAL_UNITS} == NATURAL_UNITS
    for k, grid in enumerate(
        (
            {"fiber.length": [1.0, 2.0]},
            {"fiber.rigidity": [1.0, 2.0]},
            {"fluid.viscosity": [1.0, 2.0]},
        )
    ):
        whole = {"fiber.length": 1.0, "fiber.rigidity": 1.0}
        fixed = {key: value for key, value in whole.items() if key not in grid}
        data = _sweep(tmp_path / f"b{k}", SWEEP | {"grid": grid, "set": fixed})
        assert not (NATURAL_UNITS.keys() | {"unit_of_time"}) & data.attrs.keys()


@pytest.mark.parametrize(
    ("flows", "unit"),
    [
        ([{"kind": "shear"}, {"kind": "planar_extension", "rate": 1.0}], "1/rate"),
        ([{"kind": "extension", "rate": -1.0}], "1/|rate|"),
        ([{"kind": "oscillatory_shear", "frequency": 0.5}], "1/amplitude"),
        ([{"kind": "oscillatory_shear", "amplitude": -1.0, "frequency": 0.5}], "1/|amplitude|"),
        ([{"kind": "shear", "rate": 2.0}], None),
        ([{"kind": "shear"}, {"kind": "shear", "rate": -1.0}], None),
        ([{"kind": "rotation"}], None),
    ],
)
def test_time_is_in_units_of_a_rate_of_one_that_all_cases_have(flows, unit):
    held = [{"fiber": {}, "fluid": {"mu_bar": 1e3}, "flow": flow} for flow in flows]
    found = natural_units(held)
    assert found.pop("unit_of_time", None) == unit
    assert found == NATURAL_UNITS
    assert unit is None or unit in NATURAL_RATES
    assert natural_units([{"fluid": {"mu_bar": 1.0}, "fiber": [{}, {}]}]) == NATURAL_UNITS


def coordinates(held, dims, shape):
    """What follows from cases of these tables."""
    rest = {"fiber": {"slenderness": 1e-2}, "fluid": {"mu_bar": 1e3}, "stepping": {"until": 1.0}}
    cases = [SimpleNamespace(tables=rest | tables) for tables in held]
    return derived(SimpleNamespace(cases=cases, folder="."), dims, shape)


def test_the_strain_of_half_a_cycle_is_a_coordinate_beside_what_sets_it():
    """1 / (pi f): of each frequency the same at both viscosities."""
    flows = [{"kind": "oscillatory_shear", "frequency": f} for f in (0.1, 0.5)]
    held = [{"flow": flow} for flow in (flows[0], flows[1], flows[0], flows[1])]
    (dim,), values, said = coordinates(held, ("mu_bar", "frequency"), (2, 2))["flow_strain"]
    assert dim == "frequency"
    assert values == pytest.approx([10.0 / np.pi, 2.0 / np.pi])
    assert said["long_name"] == "strain of half a cycle"
    both = [{"flow": flow | {"amplitude": a}} for a in (1.0, -2.0) for flow in flows]
    dims, values, _ = coordinates(both, ("amplitude", "frequency"), (2, 2))["flow_strain"]
    assert dims == ("amplitude", "frequency")
    assert_close(values, np.array([[10.0, 2.0], [20.0, 4.0]]) / np.pi, rtol=1e-14)
    _, values, _ = coordinates(both[1::2], ("amplitude",), (2,))["flow_strain"]
    assert values == pytest.approx([2.0 / np.pi, 4.0 / np.pi])
    mixed = [*held[:3], {"flow": {"kind": "shear"}}]
    assert "flow_strain" not in coordinates(mixed, ("a", "b"), (2, 2))
    assert "flow_strain" not in coordinates(held[::2], ("mu_bar",), (2,))


def test_eta_is_a_coordinate_along_all_that_it_depends_on():
    """eta = mu_bar rate / |log(eps^2 e)|, of each seed the same."""
    held = [
        {"fluid": {"mu_bar": mu}, "fiber": {"slenderness": eps}, "flow": {"kind": "shear"}}
        for mu in (1e3, 1e4)
        for eps in (1e-2, 1e-3)
        for _ in range(2)
    ]
    dims, values, said = coordinates(held, ("mu_bar", "slenderness", "seed"), (2, 2, 2))["eta"]
    assert dims == ("mu_bar", "slenderness")
    logs = np.abs(np.log(np.array([1e-2, 1e-3]) ** 2 * np.e))
    assert_close(values, np.array([1e3, 1e4])[:, None] / logs, rtol=1e-12)
    assert said["symbol"] == r"\bar\mu / |c|"
    kinds = [case | {"fiber": [{"slenderness": 1e-2}, {"slenderness": 1e-3}]} for case in held]
    assert "eta" not in coordinates(kinds, ("a", "b", "c"), (2, 2, 2))
    still = [case | {"flow": {"kind": "none"}} for case in held]
    assert "eta" not in coordinates(still, ("a", "b", "c"), (2, 2, 2))
    file = {"kind": "python", "file": "flow.py", "velocity": "u"}
    assert coordinates([case | {"flow": file} for case in held], ("abc",), (8,)) == {}


def test_the_dataset_keeps_the_order_of_the_lists(tmp_path):
    collect = {"largest": ["elastic_energy"], "final": ["shear_stress"], "series": []}
    data = _sweep(tmp_path / "a", SWEEP | {"collect": collect, "grid": {"fluid.mu_bar": [1e3]}})
    kept = [key for key, value in json.loads(data.attrs["collect"]).items() if value]
    assert kept == ["largest", "final"]
    assert SweepFolder(tmp_path / "a").plan().collect.order[:3] == ("largest", "final", "series")


@pytest.mark.parametrize("key", ["largest", "smallest", "mean"])
def test_of_components_there_is_no_largest(key, tmp_path):
    with pytest.raises(InputError, match=f"collect.{key}: expected numbers: .*end_to_end_distance"):
        _sweep(tmp_path / "a", SWEEP | {"collect": {key: ["end_to_end"]}})


def test_the_distance_of_the_ends_is_the_size_of_their_vector(tmp_path):
    collect = {"series": ["end_to_end", "end_to_end_distance"], "smallest": ["end_to_end_distance"]}
    data = _sweep(tmp_path / "a", SWEEP | {"collect": collect, "grid": {"fluid.mu_bar": [1e5]}})
    expected = np.sqrt((data["end_to_end"] ** 2).sum("space"))
    assert_close(data["end_to_end_distance"].to_numpy(), expected.to_numpy(), rtol=1e-14)
    smallest = data["end_to_end_distance_smallest"].to_numpy()
    assert_close(smallest, expected.min("time").to_numpy(), rtol=1e-14)
