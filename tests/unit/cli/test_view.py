"""``stokesfibers view`` as a user types it; the web page has tests of its own."""

from __future__ import annotations

import pytest

pytest.importorskip("rerun", reason="the extra 'view' is not installed")


def test_a_recording_is_saved(run, invoke):
    file = run.with_name("run.rrd")
    result = invoke("view", run, "--save", file, "--color", "curvature", "--every", 2)
    assert result.exit_code == 0, result.stderr
    assert str(file) in result.stdout
    assert file.read_bytes().startswith(b"RRF2")
    again = invoke("view", run, "--save", file)
    assert again.exit_code == 2
    assert "--save: expected a new place" in again.stderr
    assert invoke("view", run, "--save", file, "--overwrite", "--quiet").stdout == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--save", "a.rrd", "--web"], "--save: expected --save or --web, got both"),
        (["--overwrite"], "--overwrite: expected --save"),
        (["--port", 8000], "--port: expected --web"),
        (["--open"], "--open: expected --web"),
        (["--save", "a.rrd", "--data-port", 8000], "--data-port: expected a viewer"),
        (["--web", "--limit", 0], "--limit: expected"),
        (["--web", "--every", -3], "--every: expected"),
        (["--at", 0], "--at: expected --slice, got no --slice"),
        (["--points", 9], "--points: expected --slice"),
        (["--slices", 9], "--slices: expected --slice"),
        (["--disturbance"], "--disturbance: expected --slice"),
        (["--allow-python"], "--allow-python: expected --slice"),
        (["--slice", "xw"], "--slice: expected two different letters of x, y, z, got xw"),
        (["--slice", "xy", "--points", 3], "--points: expected a whole number, 5 to 200"),
        (["--slice", "xy", "--slices", 0], "--slices: expected a whole number, 1 to 1000"),
    ],
)
def test_options_that_do_not_fit_are_refused(words, said, run, invoke):
    result = invoke("view", run, *words)
    assert result.exit_code == 2
    assert said in result.stderr


def test_colours_that_do_not_exist_and_runs_that_are_missing(run, invoke):
    result = invoke("view", run, "--color", "speed")
    assert result.exit_code == 2
    assert "'tension', 'curvature', 'orientation', 'fiber'" in result.stderr
    missing = invoke("view", run.with_name("none.zarr"), "--web")
    assert missing.exit_code == 2
    assert "expected a run store" in missing.stderr


def test_the_fluid_is_computed_where_and_as_often_as_asked_for(run, invoke, monkeypatch):
    from stokesfibers.studio import view_slice

    seen = []
    compute = view_slice.plane_velocity

    def watched(data, problem, grid, *, disturbance):
        seen.append((grid.axes, grid.at, len(grid.x), disturbance))
        return compute(data, problem, grid, disturbance=disturbance)

    monkeypatch.setattr(view_slice, "plane_velocity", watched)
    file = run.with_name("fluid.rrd")
    words = ["--slice", "zy", "--at", 0, "--points", 7, "--slices", 2, "--disturbance"]
    result = invoke("view", run, "--save", file, *words)
    assert result.exit_code == 0, result.stderr
    assert [(axes, at, left) for axes, at, _, left in seen] == [("zy", 0.0, True)] * 2
    assert b"/space/velocity/arrows" in file.read_bytes()


def test_help_names_the_ways_to_look(invoke):
    text = invoke("view", "--help").stdout
    assert all(word in text for word in ("--web", "--save", "--color", "--slice", "extra 'view'"))
    assert " view " in invoke("--help").stdout
