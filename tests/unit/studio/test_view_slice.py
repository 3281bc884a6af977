"""The fluid in the viewer: what is logged is the fluid's velocity, where and when it should be."""

from __future__ import annotations

import json

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.core.errors import InputError
from stokesfibers.io.reader import open_run
from stokesfibers.studio.view import save_view
from stokesfibers.studio.view_look import Look
from stokesfibers.studio.view_recording import Show
from stokesfibers.studio.view_slice import VelocitySlice, cuts
from studio_runs import PERIODS
from support import assert_close

rr = pytest.importorskip("rerun", reason="the extra 'view' is not installed")


class Stream:
    """A recording stream that keeps what is logged below the fluid's path, with its time."""

    def __init__(self) -> None:
        self.logged: dict[str, list] = {}
        self._times: dict[str, float] = {}

    def set_time(self, timeline, *, duration=None, sequence=None):
        self._times[timeline] = sequence if duration is None else duration

    def log(self, path, entity, *, static=False):
        times = None if static else dict(self._times)
        self.logged.setdefault(path, []).append((times, entity))

    def send_recording_name(self, name): ...

    def send_columns(self, path, indexes, columns): ...


@pytest.fixture(scope="module")
def tree(cell_run):
    """The stored run, lazily."""
    return open_run(cell_run)


def array(column) -> np.ndarray:
    """Return what a column of the recording holds."""
    return np.array(column.as_arrow_array().to_pylist())


def shown(tree, every: int = 1, **options) -> tuple[Stream, list[int]]:
    """Return what is logged with a slice, and the records that were yielded."""
    stream = Stream()
    show = Show.of(tree, "cell", Look(every=every, fluid=VelocitySlice(**options)))
    yielded = list(show.log(stream))
    assert len(yielded) == show.count
    return stream, yielded


def test_the_sheet_and_its_arrows_are_the_fluid_of_their_time(tree):
    at = 0.7
    stream, yielded = shown(tree, plane="xz", at=at, points=9, most=2)
    assert yielded == [0, 1, 2, 3, 4, 0, 4]
    sheets, arrows = stream.logged["space/velocity/speed"], stream.logged["space/velocity/arrows"]
    assert [times["record"] for times, _ in sheets] == [0, 4]
    assert [times["time"] for times, _ in arrows] == pytest.approx([0.0, 0.4])
    (_, sheet), (_, arrow) = sheets[-1], arrows[-1]
    points = array(sheet.vertex_positions)
    assert_close(points[:, 1], np.full(len(points), at), rtol=1e-6)
    assert_close(points.max(axis=0)[[0, 2]], [PERIODS[0], PERIODS[2]], rtol=1e-6)
    origins, vectors = array(arrow.origins), array(arrow.vectors)
    fluid = sf.velocity_from_run(tree, origins, time=0.4)
    # one number for all arrows: the fastest of the sheet is as long as they are apart
    scale = np.sum(vectors * fluid) / np.sum(fluid**2)
    assert_close(vectors, scale * fluid, rtol=1e-5, atol=1e-6 * np.abs(vectors).max())
    apart = np.diff(np.unique(np.round(origins[:, 0], 6)))[0]
    assert 0.7 * apart < np.linalg.norm(vectors, axis=1).max() <= 1.001 * apart


def test_faster_fluid_is_darker_and_one_scale_holds_for_all_times(tree):
    stream, _ = shown(tree, plane="xy", points=8, most=3)
    speeds, light = [], []
    for times, sheet in stream.logged["space/velocity/speed"]:
        points = array(sheet.vertex_positions)
        fluid = sf.velocity_from_run(tree, points, time=times["time"])
        speeds.append(np.linalg.norm(fluid, axis=1))
        packed = array(sheet.vertex_colors)
        light.append(sum((packed >> shift) & 255 for shift in (24, 16, 8)))
    order = np.argsort(np.concatenate(speeds), kind="stable")
    assert np.all(np.diff(np.concatenate(light)[order]) <= 0)
    assert np.ptp(np.concatenate(light)) > 200
    (_, scale), *others = stream.logged["speed"]
    assert not others
    assert isinstance(scale, rr.EncodedImage)


def test_the_label_tells_the_time_that_stays_until_the_next(tree):
    stream, _ = shown(tree, every=2, plane="yz", at=0.25, points=6, most=2)
    labels = [array(e.labels)[0] for _, e in stream.logged["space/velocity/time"]]
    assert labels == ["fluid at t = 0, x = 0.25", "fluid at t = 0.4, x = 0.25"]
    (_, text), *_ = stream.logged["about"]
    said = array(text.text)[0]
    assert "velocity in the yz plane at x = 0.25, at 2 of the times shown" in said


def test_without_the_background_the_rest_is_left(tree):
    choice = VelocitySlice(points=6, most=1)
    rest = VelocitySlice(points=6, most=1, disturbance=True)
    problem = choice.problem(tree)
    (whole,) = cuts(tree, choice, problem, [2])
    (left,) = cuts(tree, rest, problem, [2])
    background = problem.flow.velocity(whole.grid.points, whole.grid.time)
    assert_close(left.velocity, whole.velocity - background, rtol=1e-12)
    assert 1e-4 < np.abs(left.velocity).max() < 0.5 * np.abs(whole.velocity).max()


def test_the_inside_of_a_fiber_is_a_hole(tree, monkeypatch):
    def holed(data, points, **_):  # noqa: ARG001
        velocity = np.ones_like(points)
        velocity[2, 3] = np.nan
        return velocity

    monkeypatch.setattr("stokesfibers.studio.view_slice.velocity_from_run", holed)
    stream, _ = shown(tree, plane="yx", points=8, most=1)
    ((_, sheet),) = stream.logged["space/velocity/speed"]
    rows = len(np.unique(np.round(array(sheet.vertex_positions)[:, 0], 6)))
    columns = len(array(sheet.vertex_positions)) // rows
    triangles = array(sheet.triangle_indices)
    # a point within the sheet has six of its triangles
    assert len(triangles) == 2 * (rows - 1) * (columns - 1) - 6
    assert 2 * columns + 3 not in triangles


def test_times_are_spread_over_those_shown():
    def picked(most, count, every):
        return VelocitySlice(most=most).picked(range(0, count, every))

    assert picked(20, 5, 1) == [0, 1, 2, 3, 4]
    assert picked(3, 101, 10) == [0, 50, 100]
    assert picked(1, 101, 10) == [100]
    assert len(set(picked(20, 500, 1))) == 20


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"plane": "xx"}, "plane: expected two different letters"),
        ({"at": np.inf}, "at: expected a finite number"),
        ({"points": 4}, "points: expected a whole number, 5 to 200"),
        ({"points": 201}, "points: expected a whole number, 5 to 200"),
        ({"most": 0}, "most: expected a whole number, 1 to 1000"),
    ],
)
def test_slices_that_cannot_be_are_refused(given, said):
    with pytest.raises(InputError, match=said):
        VelocitySlice(**given)


def test_a_run_that_does_not_tell_its_flow_is_refused(tree, cell_copy):
    bare = open_run(cell_copy)
    del bare.attrs["case"]
    with pytest.raises(InputError, match="a run that holds its case"):
        VelocitySlice().problem(bare)
    tables = json.loads(tree.attrs["case"])
    tables["flow"] = {"kind": "python", "file": "flow.py"}
    bare.attrs["case"] = json.dumps(tables)
    with pytest.raises(InputError, match="--allow-python"):
        VelocitySlice().problem(bare)


def test_a_recording_with_the_fluid_is_written_whole(cell_run, tmp_path):
    file, seen = tmp_path / "a.rrd", []
    look = Look(fluid=VelocitySlice(points=6, most=2))
    save_view(cell_run, file, look=look, progress=lambda done, count: seen.append((done, count)))
    assert seen == [(k, 7) for k in range(1, 8)]
    plain = tmp_path / "b.rrd"
    save_view(cell_run, plain)
    assert file.stat().st_size > plain.stat().st_size
    assert b"/space/velocity/speed" in file.read_bytes()
    assert b"/space/velocity" not in plain.read_bytes()
