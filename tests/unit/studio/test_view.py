"""What the viewer shows: tubes, colours, series and cell, read back from a recording."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.io.reader import open_run
from stokesfibers.plot.geometry import wrapped
from stokesfibers.studio import shapes, view_recording
from stokesfibers.studio.records import facts_of, per_fiber, records
from stokesfibers.studio.view import save_view
from stokesfibers.studio.view_about import about_text
from stokesfibers.studio.view_colours import COLOURS, colouring
from stokesfibers.studio.view_recording import Look, Show, time_factor
from stokesfibers.studio.view_series import CURVES, stored_curves, values_of
from studio_runs import PERIODS, SLENDERNESS, forget_shapes, set_status
from support import assert_close, assert_order

LENGTHS = np.array(PERIODS)


@pytest.fixture(scope="module")
def tree(cell_run):
    """The stored run, lazily."""
    return open_run(cell_run)


class Stream:
    """A recording stream that keeps what is logged."""

    def __init__(self) -> None:
        self.logged = []
        self.columns = {}
        self.times = {}

    def send_recording_name(self, name):
        self.name = name

    def set_time(self, timeline, *, duration=None, sequence=None):
        self.times[timeline] = sequence if duration is None else duration

    def log(self, path, entity, *, static=False):
        self.logged.append((path, None if static else dict(self.times), entity))

    def send_columns(self, path, indexes, columns):
        self.columns.setdefault(path, []).append((indexes, columns))

    def of(self, path):
        return [(times, entity) for where, times, entity in self.logged if where == path]


def helix(points: int):
    """Return a helix of length one (1, node, 3), its uneven arclengths, and its tangents."""
    s = np.linspace(0.0, 1.0, points)[None] ** 1.3
    turn, rise = 5.0, 0.6
    radius = np.sqrt(1.0 - rise**2) / turn
    x = np.stack([radius * np.cos(turn * s), radius * np.sin(turn * s), rise * s], axis=-1)
    flat = np.sqrt(1.0 - rise**2)
    t = np.stack([-flat * np.sin(turn * s), flat * np.cos(turn * s), rise + 0.0 * s], axis=-1)
    return x, s, t


def test_tangents_are_second_order_up_to_the_ends():
    errors = []
    for points in (21, 41, 81, 161):
        x, s, t = helix(points)
        errors.append(np.abs(shapes.tangents(x, s) - t).max())
    assert_order(errors, between=(1.85, 2.15), final=3e-4)


def test_two_points_have_one_tangent():
    x = np.array([[[0.0, 0, 0], [0, 2, 0]]])
    assert shapes.tangents(x, np.array([[0.0, 2.0]])).tolist() == [[[0, 1, 0], [0, 1, 0]]]


def test_tubes_have_their_radius_and_face_outward():
    x, s, t = helix(60)
    radius = 0.02 * np.sqrt(s * (1.0 - s)) + 0.003
    made = shapes.tubes(x, t, radius, sides=12)
    rings = made.vertices.reshape(60, 12, 3)
    out = rings - x[0][:, None]
    assert_close(np.linalg.norm(out, axis=-1), np.repeat(radius.T, 12, axis=1), rtol=1e-12)
    assert np.abs(np.einsum("nsi,ni->ns", out, t[0])).max() < 1e-12
    triangles = shapes.tube_triangles(1, 60, 12)
    assert len(triangles) == 59 * 12 * 2
    a, b, c = (made.vertices[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    assert (np.einsum("ti,ti->t", faces, made.normals[triangles].sum(axis=1)) > 0.0).all()
    # neighbouring rings are not twisted: a step turns them less than half a side
    turn = np.einsum("nsi,nsi->ns", made.normals.reshape(60, 12, 3)[1:], out[:-1])
    assert (turn / radius[0, :-1, None] > np.cos(np.pi / 12)).all()
    second = shapes.tube_triangles(2, 60, 12)
    assert (second[len(triangles) :] == triangles + 720).all()


def test_angles_do_not_tell_head_from_tail():
    t = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [-0.5, 0, np.sqrt(0.75)]])
    assert_close(shapes.angle_to_x(t), [0, 0, 90, 60], rtol=1e-12)


def test_free_directions_are_as_wide_as_the_fibers():
    points = np.array([[[0.5, -1.0, 2.0], [0.7, 3.0, 2.0], [np.nan, 9, 9]]])
    box = shapes.cell_box(np.array([2.0, 0.0, 0.0]), points)
    assert_close(box, [[0, 2], [-1, 3], [1.5, 2.5]], rtol=1e-15)


def test_the_recording_shows_what_is_stored(tree):
    rr = pytest.importorskip("rerun", reason="the extra 'view' is not installed")
    show = Show.of(tree, "cell", Look(every=2))
    stream = Stream()
    assert list(show.log(stream)) == [0, 2, 4]
    frames = [(times, mesh) for times, mesh in stream.of("space/fibers") if times]
    assert [times for times, _ in frames] == [
        {"time": pytest.approx(0.1 * k), "record": k} for k in (0, 2, 4)
    ]
    stored = tree["trajectory"].to_dataset()
    for (times, mesh), (_, cell) in zip(frames, stream.of("space/cell"), strict=True):
        shape = stored["position"].to_numpy()[times["record"]]
        placed = wrapped(shape, LENGTHS, LENGTHS[1] * times["time"])
        rings = np.array(mesh.vertex_positions.as_arrow_array().to_pylist()).reshape(2, 21, 8, 3)
        assert_close(rings.mean(axis=2), placed, rtol=1e-6)
        radius = np.linalg.norm(rings - placed[:, :, None], axis=-1)
        assert_close(radius[:, 10], np.repeat([SLENDERNESS], 8, 0).T, rtol=1e-4)
        assert_close(radius[:, 0], np.full((2, 8), 0.003 * max(PERIODS)), rtol=1e-4)
        corners = np.array(cell.strips.as_arrow_array().to_pylist()).reshape(-1, 3)
        slid = LENGTHS[1] * times["time"]
        assert_close(corners.max(axis=0), [LENGTHS[0] + slid, *LENGTHS[1:]], rtol=1e-6)
    assert len(stream.columns) == len(stored_curves(tree)) == len(CURVES)
    assert isinstance(stream.of("legend")[0][1], rr.EncodedImage)


def test_many_fibers_are_thick_lines(tree, monkeypatch):
    pytest.importorskip("rerun", reason="the extra 'view' is not installed")
    monkeypatch.setattr(view_recording, "_MOST_VERTICES", 100)
    stream = Stream()
    list(Show.of(tree, "cell", Look(wrap=False, least_radius=0.015, every=4)).log(stream))
    _, lines = stream.of("space/fibers")[-1]
    strips = np.array(lines.strips.as_arrow_array().to_pylist()).reshape(2, 20, 2, 3)
    last = tree["trajectory"].to_dataset()["position"].to_numpy()[4]
    assert_close(strips[:, :, 0], last[:, :-1], rtol=1e-6)
    assert_close(strips[:, :, 1], last[:, 1:], rtol=1e-6)
    radii = np.array(lines.radii.as_arrow_array().to_pylist()).reshape(2, 20)
    assert_close(radii.min(), 0.015, rtol=1e-6)
    assert radii[0].max() > 0.0199
    assert_close(radii[1], np.full(20, 0.015), rtol=1e-6)


def test_series_are_those_of_the_store(tree):
    seen = tree["observables"].to_dataset()
    expected = {
        "elastic_energy": seen["elastic_energy"].to_numpy().sum(axis=1),
        "length_error": seen["length_error"].to_numpy().max(axis=1),
        "smallest_gap": seen["smallest_gap"].to_numpy(),
        "step_size": tree["numerics"].to_dataset()["step_size"].to_numpy(),
    }
    for curve in CURVES:
        if curve.name in expected:
            blocks = list(values_of(tree, curve))
            assert_close(np.concatenate([v for _, v in blocks]), expected[curve.name])


def test_values_that_are_not_finite_are_left_out(tree):
    holed = tree.copy(deep=True)
    gap = holed["observables"]["smallest_gap"]
    gap[1] = np.inf
    gap[3] = np.nan
    curve = next(c for c in CURVES if c.name == "smallest_gap")
    times, values = next(iter(values_of(holed, curve)))
    assert_close(times, np.delete(holed["observables"]["time"].to_numpy(), [1, 3]))
    assert np.isfinite(values).all()


def test_tension_is_grey_where_zero_and_ends_at_the_limit(tree):
    facts = facts_of(tree)
    first = next(records(tree, facts))
    found = colouring(tree, facts, "tension", limit=2.0 * np.abs(first.tension).max())
    colours = found.rgba(first).astype(int)
    assert np.ptp(colours[:, 0, :3], axis=-1).max() <= 3  # ends: no tension, grey
    squeezed = first.tension < -0.2 * found.high
    stretched = first.tension > 0.2 * found.high
    assert squeezed.any() or stretched.any()
    assert (colours[squeezed][:, 2] > colours[squeezed][:, 0]).all()
    assert (colours[stretched][:, 0] > colours[stretched][:, 2]).all()
    tight = colouring(tree, facts, "tension", limit=1e-6).rgba(first)
    assert {tuple(c) for c in tight[np.abs(first.tension) > 1e-5]} <= {
        (8, 64, 138, 255),
        (163, 26, 14, 255),
    }


def test_scales_come_from_the_whole_run(tree):
    facts = facts_of(tree)
    peak = tree["observables"]["largest_curvature"].to_numpy().max(axis=1)
    found = colouring(tree, facts, "curvature")
    assert_close(found.high, np.quantile(peak, 0.98), rtol=1e-14)
    assert found.legend().startswith(b"\x89PNG")
    angles = colouring(tree, facts, "orientation")
    assert (angles.low, angles.high) == (0.0, 90.0)
    last = list(records(tree, facts))[-1]
    assert (
        np.unique(colouring(tree, facts, "fiber").rgba(last).reshape(2, 21, 4), axis=1).shape[1]
        == 1
    )
    assert len({tuple(c) for c in colouring(tree, facts, "fiber").rgba(last)[:, 0]}) == 2
    assert set(COLOURS) == {"tension", "curvature", "orientation", "fiber"}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"colour": "speed"}, "color: expected one of tension"),
        ({"limit": -1.0}, "limit: expected"),
        ({"colour": "fiber", "limit": 1.0}, "limit: expected the colour tension or curvature"),
        ({"every": 0}, "every: expected"),
        ({"least_radius": -0.1}, "least_radius: expected"),
    ],
)
def test_looks_that_are_not_possible_are_refused(given, said, cell_run, tmp_path):
    pytest.importorskip("rerun", reason="the extra 'view' is not installed")
    with pytest.raises(InputError, match=said):
        save_view(cell_run, tmp_path / "a.rrd", look=Look(**given))
    assert not list(tmp_path.iterdir())


def test_values_between_observables_are_interpolated(tree):
    series = per_fiber(tree, "elastic_energy")
    times, stored = series.time, series.values.to_numpy()
    assert_close(series.at(times[0]), stored[0])
    assert_close(series.at(times[-1] + 1.0), stored[-1])
    assert_close(
        series.at(0.25 * times[2] + 0.75 * times[3]),
        0.25 * stored[2] + 0.75 * stored[3],
        rtol=1e-13,
    )


def test_times_that_the_viewer_cannot_count_are_scaled():
    assert time_factor(61.44) == time_factor(0.0) == time_factor(2e-3) == 1.0
    for last in (3e-7, 3e-12, 2e9, 1e-4):
        assert 1.0 <= last * time_factor(last) < 1000.0


def test_the_text_tells_what_is_shown(cell_copy):
    set_status(cell_copy, "running")
    text = about_text(open_run(cell_copy), "copy.zarr", "line tension")
    assert "**running** at t = 0.4" in text
    assert "2 fibers, 21 points each, 5 recorded shapes" in text
    assert "[domain]" in text
    assert "periods = [1.5, 1.25, 2.0]" in text


def test_a_recording_is_a_file_that_rerun_reads(cell_run, tmp_path):
    pytest.importorskip("rerun", reason="the extra 'view' is not installed")
    file, seen = tmp_path / "run.rrd", []
    save_view(cell_run, file, progress=lambda done, count: seen.append((done, count)))
    assert seen == [(k, 5) for k in range(1, 6)]
    said = subprocess.run(
        [sys.executable, "-m", "rerun_cli", "rrd", "stats", str(file)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert said.returncode == 0
    for path in ("/space/fibers: 6", "/space/cell: 5", "/legend: 1", "/series/energy"):
        assert path.split(":")[0] in said.stdout
    with pytest.raises(InputError, match="--overwrite"):
        save_view(cell_run, file)
    assert [p.name for p in tmp_path.iterdir()] == ["run.rrd"]


def test_a_recording_that_fails_leaves_the_old_file(cell_run, tmp_path):
    pytest.importorskip("rerun", reason="the extra 'view' is not installed")
    file = tmp_path / "run.rrd"
    file.write_bytes(b"old")

    def stop(done, count):  # noqa: ARG001
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        save_view(cell_run, file, overwrite=True, progress=stop)
    assert file.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["run.rrd"]


def test_a_run_without_shapes_is_refused(cell_copy, tmp_path):
    pytest.importorskip("rerun", reason="the extra 'view' is not installed")
    forget_shapes(cell_copy)
    with pytest.raises(InputError, match="at least one recorded shape"):
        save_view(cell_copy, tmp_path / "a.rrd")
