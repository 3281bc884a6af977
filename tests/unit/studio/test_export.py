"""Exports read back by the readers of their formats, and what is left after a failure."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

from stokesfibers.core.errors import InputError, MissingExtraError
from stokesfibers.io.reader import open_run
from stokesfibers.plot.geometry import curvature
from stokesfibers.studio import export, records
from stokesfibers.studio.export import export_run
from studio_runs import PERIODS, SLENDERNESS, forget_shapes, set_status
from support import assert_close

LENGTHS = np.array(PERIODS)


@pytest.fixture(scope="module")
def tree(cell_run):
    """The stored run, in memory."""
    return open_run(cell_run).load()


def read_vtp(file: Path):
    """Return the poly data of a file, its arrays by name, and its lines as lists of points."""
    pytest.importorskip("vtk", reason="the extra 'vtk' is not installed")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(file))
    reader.Update()
    made = reader.GetOutput()
    arrays = {}
    for where, held in (("p", made.GetPointData()), ("c", made.GetCellData())):
        for k in range(held.GetNumberOfArrays()):
            arrays[where, held.GetArrayName(k)] = vtk_to_numpy(held.GetArray(k)).copy()
    time = made.GetFieldData().GetArray("TimeValue").GetValue(0)
    points = vtk_to_numpy(made.GetPoints().GetData()).copy()
    lines = made.GetLines()
    starts = vtk_to_numpy(lines.GetOffsetsArray())
    cells = np.split(vtk_to_numpy(lines.GetConnectivityArray()), starts[1:-1])
    return made, points, cells, arrays, time


def collection(file: Path) -> list[tuple[float, str]]:
    """Return times and files of a .pvd."""
    rows = ElementTree.parse(file).getroot().iter("DataSet")
    return [(float(row.attrib["timestep"]), row.attrib["file"]) for row in rows]


def test_vtk_files_hold_the_run(cell_run, tree, tmp_path):
    assert export_run(cell_run, vtk=tmp_path / "out") == (tmp_path / "out",)
    stored = tree["trajectory"].to_dataset()
    series = collection(tmp_path / "out" / "fibers.pvd")
    assert [time for time, _ in series] == stored["time"].to_numpy().tolist()
    energy = tree["observables"]["elastic_energy"]
    s = stored["arclength"].to_numpy()
    for k, (when, name) in enumerate(series):
        made, points, cells, arrays, time = read_vtp(tmp_path / "out" / name)
        position = stored["position"].to_numpy()[k]
        assert time == when
        assert points.tobytes() == position.tobytes()
        assert [list(c) for c in cells] == [list(range(21)), list(range(21, 42))]
        assert made.GetNumberOfCells() == 2
        tension = stored["tension"].to_numpy()[k]
        assert arrays["p", "tension"].tobytes() == tension.tobytes()
        assert arrays["p", "arclength"].tobytes() == s.tobytes()
        assert_close(arrays["p", "curvature"], curvature(position).ravel(), rtol=1e-15)
        assert arrays["p", "fiber"].tolist() == [0] * 21 + [1] * 21
        tangent = np.stack([np.gradient(x, q, axis=0) for x, q in zip(position, s, strict=True)])
        tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
        inner = np.r_[1:20, 22:41]
        found = arrays["p", "orientation"]
        assert_close(found[inner], tangent.reshape(-1, 3)[inner], rtol=1e-13)
        assert_close(np.linalg.norm(found, axis=1), np.ones(42), rtol=1e-14)
        assert_close(arrays["p", "radius"].reshape(2, 21)[:, 10], SLENDERNESS, rtol=1e-14)
        assert_close(arrays["c", "length"], [1.0, 1.0], rtol=1e-14)
        there = energy.sel(time=when, method="nearest").to_numpy()
        assert_close(arrays["c", "elastic_energy"], there, rtol=1e-12)
    units = read_vtp(tmp_path / "out" / series[0][1])[0].GetPointData().GetArray("tension")
    assert units.GetInformation().Get(units.UNITS_LABEL()) == "force"


def test_vtk_wraps_fibers_into_the_sheared_cell(cell_run, tree, tmp_path):
    export_run(cell_run, vtk=tmp_path / "out", wrap=True, every=2)
    stored = tree["trajectory"].to_dataset()
    series = collection(tmp_path / "out" / "fibers.pvd")
    assert [time for time, _ in series] == stored["time"].to_numpy()[::2].tolist()
    moved = 0
    for k, (time, name) in enumerate(series):
        slid = LENGTHS[1] * time  # strain = rate x time, below half a period here
        basis = np.diag(LENGTHS)
        basis[1, 0] = slid
        points = read_vtp(tmp_path / "out" / name)[1].reshape(2, 21, 3)
        shift = points - stored["position"].to_numpy()[2 * k]
        assert_close(shift, np.broadcast_to(shift[:, :1], shift.shape) + 0.0, atol=1e-14)
        numbers = shift[:, 0] @ np.linalg.inv(basis)
        np.testing.assert_allclose(numbers, np.round(numbers), atol=1e-12)
        moved += int(np.abs(np.round(numbers)).sum())
        middle = points[:, 10] @ np.linalg.inv(basis)
        assert (middle >= 0.0).all()
        assert (middle < 1.0).all()
        outline = f"cell_{2 * k:06d}.vtp"
        assert (time, outline) in collection(tmp_path / "out" / "cell.pvd")
        _, corners, edges, _, _ = read_vtp(tmp_path / "out" / outline)
        expected = np.array([[i, j, m] for i in (0, 1) for j in (0, 1) for m in (0, 1)]) @ basis
        assert_close(corners, expected, rtol=1e-12)
        assert len(edges) == 12
        sides = np.array([corners[b] - corners[a] for a, b in edges])
        assert_close(
            sorted(map(tuple, sides)), sorted(map(tuple, np.repeat(basis, 4, 0))), rtol=1e-12
        )
    assert moved >= 3  # the second fiber starts outside


def test_netcdf_opens_as_the_same_tree(cell_run, tree, tmp_path):
    pytest.importorskip("h5py", reason="the extra 'netcdf' is not installed")
    export_run(cell_run, netcdf=tmp_path / "run.nc")
    found = xr.open_datatree(tmp_path / "run.nc", engine="h5netcdf")
    try:
        assert found.groups == tree.groups
        compared = 0
        for group in tree.groups:
            one, other = found[group].to_dataset(), tree[group].to_dataset()
            assert set(one.variables) == set(other.variables)
            for name in other.variables:
                assert one[name].dims == other[name].dims
                assert one[name].attrs == other[name].attrs
                a, b = one[name].to_numpy(), other[name].to_numpy()
                if b.dtype.kind == "T":
                    assert a.tolist() == b.tolist()
                else:
                    assert a.dtype == b.dtype
                    assert a.tobytes() == b.tobytes()
                compared += 1
        assert compared > 30
        for key, value in tree.attrs.items():
            held = found.attrs[key]
            assert held == value or json.loads(held) == value
    finally:
        found.close()


def test_csv_holds_every_bit(cell_run, tree, tmp_path):
    export_run(cell_run, csv=tmp_path / "out")
    about = json.loads((tmp_path / "out" / "columns.json").read_text())
    columns = {}
    for name, described in about.items():
        with (tmp_path / "out" / name).open(newline="") as file:
            rows = list(csv.reader(file))
        assert rows[0] == list(described)
        values = np.array(rows[1:], dtype=float).T
        columns[name] = dict(zip(rows[0], values, strict=True))
    assert set(columns) == {"positions.csv", "observables.csv", "fibers.csv", "numerics.csv"}
    stored, seen = tree["trajectory"].to_dataset(), tree["observables"].to_dataset()
    table = columns["positions.csv"]
    for k, axis in enumerate("xyz"):
        assert table[axis].tobytes() == stored["position"].to_numpy()[..., k].tobytes()
    assert table["tension"].tobytes() == stored["tension"].to_numpy().tobytes()
    assert table["time"].tolist() == np.repeat(stored["time"].to_numpy(), 42).tolist()
    assert table["fiber"].tolist() == 5 * ([0.0] * 21 + [1.0] * 21)
    assert table["s"].tolist() == 5 * stored["arclength"].to_numpy().ravel().tolist()
    table = columns["observables.csv"]
    assert table["extra_stress_xy"].tolist() == seen["extra_stress"].to_numpy()[:, 0, 1].tolist()
    assert table["smallest_gap"].tolist() == seen["smallest_gap"].to_numpy().tolist()
    assert not any(name.startswith("elastic_energy") for name in table)
    table = columns["fibers.csv"]
    assert table["elastic_energy"].tolist() == seen["elastic_energy"].to_numpy().ravel().tolist()
    stress = seen["fiber_stress"].to_numpy()[:, :, 2, 1]
    assert table["fiber_stress_zy"].tolist() == stress.ravel().tolist()
    assert table["end_to_end_z"].tolist() == seen["end_to_end"].to_numpy()[..., 2].ravel().tolist()
    table, steps = columns["numerics.csv"], tree["numerics"].to_dataset()
    assert table["step_size"].tolist() == steps["step_size"].to_numpy().tolist()
    assert table["wall_time_rest"].tolist() == steps["wall_time"].to_numpy()[:, 1].tolist()
    assert about["fibers.csv"]["elastic_energy"]["units"] == "force length"
    assert about["positions.csv"]["y"]["component"] == "y"


def test_shapes_are_read_block_by_block_and_not_kept(cell_run, monkeypatch):
    data = open_run(cell_run)
    facts = records.facts_of(data)
    reads = []
    monkeypatch.setattr(records, "_block_length", lambda _: 2)
    monkeypatch.setattr(records, "_values", lambda a, _: reads.append(a.shape) or a.to_numpy())
    found = [r.number for r in records.records(data, facts)]
    assert found == [0, 1, 2, 3, 4]
    assert [shape[0] for shape in reads[::2]] == [2, 2, 1]
    assert not data["trajectory"].to_dataset()["position"].variable._in_memory


def test_a_failure_leaves_nothing_and_keeps_what_was_there(cell_run, tmp_path, monkeypatch):
    target, table = tmp_path / "out", tmp_path / "tables"
    export_run(cell_run, vtk=target, every=4)
    before = {p.name: p.read_bytes() for p in target.iterdir()}
    write = export.write_csv

    def broken(*given, **named):
        for k, number in enumerate(write(*given, **named)):
            if k == 2:
                raise OSError(28, "No space left on device", "positions.csv")
            yield number

    monkeypatch.setattr(export, "write_csv", broken)
    with pytest.raises(OSError, match="No space"):
        export_run(cell_run, vtk=target, csv=table, overwrite=True)
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    assert {p.name: p.read_bytes() for p in target.iterdir()} == before
    monkeypatch.undo()
    export_run(cell_run, vtk=target, csv=table, overwrite=True)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out", "tables"]
    assert len(list(target.glob("fibers_*.vtp"))) == 5


def test_an_interruption_leaves_nothing(cell_run, tmp_path):
    def stop(_, done, count):
        assert count == 5
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export_run(cell_run, vtk=tmp_path / "out", progress=stop)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["vtk", "csv"])
def test_a_folder_with_other_files_is_never_replaced(name, cell_run, tmp_path):
    place = tmp_path / "mine"
    place.mkdir()
    export_run(cell_run, every=4, **{name: place})  # an empty folder may be filled
    (place / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match=r"which holds notes\.txt too"):
        export_run(cell_run, overwrite=True, **{name: place})
    (place / "export.json").unlink()
    with pytest.raises(InputError, match="a folder that an export made"):
        export_run(cell_run, overwrite=True, **{name: place})
    assert (place / "notes.txt").read_text() == "mine"


def test_places_that_cannot_be_used_are_refused(cell_run, tmp_path):
    taken = tmp_path / "taken.nc"
    taken.write_text("old")
    refused = [
        ({"netcdf": taken}, "--netcdf: expected a new place"),
        ({"csv": tmp_path / "no" / "where"}, "a folder that exists"),
        ({"vtk": cell_run / "vtk"}, "--vtk: expected a place outside the run"),
        ({"csv": cell_run.parent, "overwrite": True}, "a place that does not hold the run"),
        ({"netcdf": tmp_path, "overwrite": True}, "a file to replace"),
        ({"vtk": tmp_path / "a", "csv": tmp_path / "a"}, "a place of its own"),
        ({}, "at least one of --vtk"),
        ({"csv": tmp_path / "a", "every": 0}, "every: expected a whole number"),
    ]
    for given, said in refused:
        with pytest.raises(InputError, match=said):
            export_run(cell_run, **given)
    assert taken.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["taken.nc"]


@pytest.mark.parametrize(
    ("option", "package", "extra"),
    [
        ("vtk", "vtkmodules", "vtk"),
        ("netcdf", "h5netcdf", "netcdf"),
        ("netcdf", "h5py", "netcdf"),
        ("rrd", "rerun", "view"),
    ],
)
def test_a_missing_library_is_named(option, package, extra, cell_run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtraError, match=rf"stokesfibers\[{extra}\]"):
        export_run(cell_run, csv=tmp_path / "tables", **{option: tmp_path / "out"})
    assert not list(tmp_path.iterdir())


def test_a_run_in_progress_is_exported_as_far_as_it_is(cell_copy, tmp_path):
    set_status(cell_copy, "running")
    export_run(cell_copy, csv=tmp_path / "out")
    assert (tmp_path / "out" / "positions.csv").read_text().count("\n") == 1 + 5 * 42
    forget_shapes(cell_copy)
    with pytest.raises(InputError, match="at least one recorded shape"):
        export_run(cell_copy, csv=tmp_path / "none")
    assert not (tmp_path / "none").exists()
