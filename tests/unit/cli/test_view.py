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
        (["--web", "--limit", 0], "limit: expected"),
        (["--web", "--every", -3], "every: expected"),
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


def test_help_names_the_ways_to_look(invoke):
    text = invoke("view", "--help").stdout
    assert all(word in text for word in ("--web", "--save", "--color", "--every", "extra 'view'"))
    assert " view " in invoke("--help").stdout
