"""``stokesfibers plot RUN slice`` and the other kinds that need options or suspensions."""

from __future__ import annotations

import json
import re

import matplotlib.image
import numpy as np
import pytest

from stokesfibers import plot
from stokesfibers.io.reader import open_run

PNG = b"\x89PNG"


@pytest.fixture
def drawn(monkeypatch):
    """What the command handed to `velocity_slice`."""
    seen = {}
    draw = plot.velocity_slice

    def watched(x, y, velocity, **options):
        seen.update(x=x, y=y, velocity=velocity, **options)
        return draw(x, y, velocity, **options)

    monkeypatch.setattr(plot, "velocity_slice", watched)
    return seen


@pytest.mark.parametrize("kind", ["curvature", "end_to_end", "order"])
def test_kinds_of_distributions_are_written(kind, run, invoke):
    result = invoke("plot", run, kind)
    assert result.exit_code == 0, result.stderr
    assert run.with_name(f"run-{kind}.png").read_bytes().startswith(PNG)


def test_slice_shows_the_fluid_in_the_plane_asked_for(run, invoke, drawn):
    options = ["--time", 0.128, "--plane", "yx", "--at", 0, "--points", 24]
    result = invoke("plot", run, "slice", *options)
    assert result.exit_code == 0, result.stderr
    assert run.with_name("run-slice.png").read_bytes().startswith(PNG)
    assert max(len(drawn["x"]), len(drawn["y"])) == 24
    assert drawn["axes"] == "yx"
    # U = (y, 0, 0), and y is drawn to the right: fast up on the right, with little disturbance
    velocity, y = drawn["velocity"], drawn["x"]
    far = velocity[-1]
    np.testing.assert_allclose(far[:, 1], y, atol=0.1 * np.abs(y).max())
    assert np.abs(far[:, 1]).max() > 0.2
    # at = 0 is given, not left out: the fiber lies in z = 0
    assert all(np.abs(line[:, 2]).max() < 1e-12 for line in drawn["fibers"])


def test_disturbance_leaves_out_the_background(run, invoke, drawn):
    common = ["--at", 0.1, "--points", 12, "--out", run.with_name("a.pdf")]
    assert invoke("plot", run, "slice", *common).exit_code == 0
    whole = drawn["velocity"]
    assert invoke("plot", run, "slice", "--disturbance", *common).exit_code == 0
    background = np.zeros_like(whole)
    background[..., 0] = drawn["y"][:, None]
    np.testing.assert_allclose(drawn["velocity"], whole - background, rtol=0, atol=1e-14)
    assert np.abs(drawn["velocity"]).max() > 1e-3


def test_a_suspension_in_a_cell_is_sliced(case, invoke):
    out = case.with_name("cell.zarr")
    settings = [
        "fiber.count=3",
        "domain.kind=periodic",
        "domain.periods=[2.0, 0.0, 0.0]",
        "stepping.until=0.0256",
        "record.positions_every=0.0128",
        "record.observables_every=0.0128",
    ]
    text = case.read_text()
    start, end = text.index("[initial]"), text.index("[discretization]")
    placed = '[initial]\nkind = "suspension"\nseed = 1\nbox = [2.0, 1.0, 1.0]\n\n'
    case.write_text(text[:start] + placed + text[end:])
    words = [word for setting in settings for word in ("--set", setting)]
    result = invoke("run", case, "--out", out, "--quiet", *words)
    assert result.exit_code == 0, result.stderr
    result = invoke("plot", out, "slice", "--plane", "xz", "--points", 30)
    assert result.exit_code == 0, result.stderr
    stored = open_run(out)["observables"]
    tensor = stored["orientation_tensor"].to_numpy()
    largest = np.linalg.eigvalsh(1.5 * tensor - 0.5 * np.eye(3))[:, -1]
    np.testing.assert_allclose(stored["order_parameter"].to_numpy(), largest, rtol=1e-12)


@pytest.mark.parametrize(
    ("kind", "words", "said"),
    [
        ("energy", ["--time", 0.1], "--time: expected KIND shapes or panels or tension"),
        ("3d", ["--time", 0, "--time", 0.1], "--time: expected one value for KIND 3d, got 2"),
        ("3d", ["--color", "speed"], "or none for one colour, got 'speed'"),
        ("tension", ["--fiber", 1], "--fiber: expected 0, the only fiber, got 1"),
        ("averages", ["--after", 0.25], "--after: expected a time with four records after it"),
        ("averages", ["--block", 9], "--block: expected a time up to"),
        ("speed", [], "or the name of an observable of the run, got 'speed'"),
        ("fiber_stress", [], "expected a scalar"),
        ("energy", ["--dpi", 0], "--dpi: expected a positive number"),
        ("3d", ["--at", 0], "--at: expected KIND slice, got KIND 3d"),
        ("stress", ["--allow-python"], "--allow-python: expected KIND slice"),
        ("slice", ["--time", 7.0], "--time: expected times between 0 and 0.256"),
        ("slice", ["--plane", "xx"], "--plane: expected two different letters"),
        ("slice", ["--points", 3], "--points: expected a whole number, 5 or more"),
        ("energy", ["--out", "x.jpg"], "--out: expected a file name ending in .png, .pdf, .svg"),
        ("slice", ["--out", "x"], "--out: expected a file name ending in .png, .pdf, .svg"),
        ("energy", ["--out", "none/x.png"], "--out: expected a file in a folder that exists"),
    ],
)
def test_options_that_do_not_fit_are_refused(kind, words, said, run, invoke):
    result = invoke("plot", run, kind, *words)
    assert result.exit_code == 2
    assert said in result.stderr
    assert not run.with_name(f"run-{kind}.png").exists()


def test_a_name_that_cannot_be_is_refused_before_anything_is_computed(run, invoke, drawn):
    result = invoke("plot", run, "slice", "--out", run.with_name("a.jpeg"))
    assert result.exit_code == 2
    assert drawn == {}


def test_a_snapshot_can_be_taken_at_a_time(run, invoke, monkeypatch):
    times = []
    kinds = {**plot.KINDS, "3d": lambda data, *, time: times.append(time) or plot.perspective(data)}
    monkeypatch.setattr(plot, "KINDS", kinds)
    assert invoke("plot", run, "3d", "--time", 0).exit_code == 0
    assert times == [0.0]


def test_every_kind_is_named_in_the_help(invoke):
    text = invoke("plot", "--help").stdout
    assert all(kind in text for kind in (*plot.KINDS, "slice"))


def test_a_case_with_a_python_flow_needs_leave(run, invoke, monkeypatch):
    flow = run.with_name("flow.py")
    flow.write_text("def velocity(points, t):\n    return 0.0 * points\n")
    data = open_run(run)
    stored = json.loads(data.attrs["case"])
    assert stored["flow"]["kind"] == "shear"
    stored["flow"] = {"kind": "python", "file": str(flow)}
    data.attrs["case"] = json.dumps(stored)
    monkeypatch.setattr("stokesfibers.io.reader.open_run", lambda _: data)
    refused = invoke("plot", run, "slice", "--points", 6)
    assert refused.exit_code == 2
    assert "--allow-python" in refused.stderr
    allowed = invoke("plot", run, "slice", "--points", 6, "--allow-python")
    assert allowed.exit_code == 0, allowed.stderr


def test_times_and_fibers_reach_the_figure(run, invoke, monkeypatch):
    seen = []
    draw = plot.shapes
    kinds = {
        **plot.KINDS,
        "shapes": lambda d, *, times, fibers: seen.append((times, fibers)) or draw(d),
    }
    monkeypatch.setattr(plot, "KINDS", kinds)
    result = invoke("plot", run, "shapes", "--time", 0, "--time", 0.128, "--fiber", 0)
    assert result.exit_code == 0, result.stderr
    assert seen == [((0.0, 0.128), (0,))]


def test_an_observable_is_a_kind_and_may_be_dark(run, invoke):
    assert invoke("plot", run, "largest_tension", "--fiber", 0, "--dark").exit_code == 0
    picture = matplotlib.image.imread(run.with_name("run-largest_tension.png"))
    assert picture[0, 0, 0] < 0.15


def test_averages_of_a_free_fiber_are_those_of_all_fibers(run, invoke):
    out = run.with_name("a.svg")
    result = invoke("plot", run, "averages", "--out", out, "--after", 0.1)
    assert result.exit_code == 0, result.stderr
    words = out.read_text()
    held = open_run(run)["observables"].to_dataset()
    late = held["shear_stress"].to_numpy()[held["time"].to_numpy() >= 0.1]
    found = re.search(r"shear stress: (\S+) ± (\S+)", words)
    assert found is not None
    mean, error = float(found[1].replace("−", "-")), float(found[2])
    # printed to the second digit of the error
    assert abs(mean - late.mean()) < 0.06 * error
