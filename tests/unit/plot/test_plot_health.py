"""The health figure shows what the run stored, and says what it did not."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from stokesfibers import plot


def texts(ax):
    return [text.get_text() for text in ax.texts]


def test_panels_hold_the_stored_values(run):
    error, step, wall, curvature = plot.health(run)
    observed, numerics = run["observables"], run["numerics"]
    np.testing.assert_array_equal(
        error.get_lines()[0].get_ydata(), observed["length_error"].to_numpy()[:, 0]
    )
    assert error.get_yscale() == "log"
    np.testing.assert_array_equal(step.get_lines()[0].get_xdata(), numerics["time"].to_numpy())
    np.testing.assert_array_equal(step.get_lines()[0].get_ydata(), numerics["step_size"].to_numpy())
    assert step.get_lines()[0].get_drawstyle() == "steps-pre"
    total, tension, positions = wall.get_lines()
    assert np.all(tension.get_ydata() == 0.25)
    assert np.all(positions.get_ydata() == 0.5)
    assert np.all(total.get_ydata() == 0.75)
    np.testing.assert_array_equal(
        curvature.get_lines()[0].get_ydata(), observed["largest_curvature"].to_numpy()[:, 0]
    )


def test_panels_share_the_time_axis_and_are_labelled(run):
    axes = plot.health(run)
    for ax in axes:
        np.testing.assert_allclose(ax.get_xlim(), [0.0, 10.0], rtol=0, atol=1e-12)
    assert [ax.get_xlabel() for ax in axes] == ["", "", "", "time $t$"]
    for ax, part in zip(axes, (r"\ell", r"\Delta t$ [time]", "[s]", "length$"), strict=True):
        assert part in ax.get_ylabel()


def test_rejected_tries_are_marked(run):
    step = plot.health(run)[1]
    np.testing.assert_allclose(step.get_lines()[1].get_xdata(), [0.2, 3.55], rtol=1e-12)


def test_a_constant_step_is_drawn_from_zero_and_a_wild_one_on_a_log_scale(run):
    assert plot.health(run)[1].get_ylim()[0] == 0.0
    run["numerics"]["step_size"][10] = 1e-4
    assert plot.health(run)[1].get_yscale() == "log"


@pytest.mark.parametrize(
    ("status", "title"),
    [
        (None, "failed at t = 10. Too long. Halve dt"),
        ({"code": "done", "time": 2.5}, "done at t = 2.5"),
        ("stopped by hand", "stopped by hand"),
        ('{"unknown": 1}', "{'unknown': 1}"),
        ("", ""),
    ],
)
def test_the_title_is_the_status(status, title, run):
    if status is not None:
        run.attrs["status"] = status
    assert plot.health(run)[0].figure.get_suptitle() == title


def test_a_zero_length_error_is_left_out_of_the_log_scale(run):
    run["observables"]["length_error"][0] = 0.0
    error = plot.health(run)[0]
    assert error.get_yscale() == "log"
    assert np.isnan(error.get_lines()[0].get_ydata()[0])
    run["observables"]["length_error"][:] = 0.0
    assert plot.health(run)[0].get_yscale() == "linear"


def test_missing_pieces_are_said(run, tmp_path):
    run["numerics"] = xr.DataTree(run["numerics"].to_dataset().drop_vars("wall_time"))
    dataset = run["observables"].to_dataset()
    dataset["largest_curvature"][:] = np.nan
    run["observables"] = xr.DataTree(dataset)
    axes = plot.health(run)
    assert [texts(ax) for ax in axes] == [[], [], ["not recorded"], ["not recorded"]]
    plot.save(axes, tmp_path / "part.png", dpi=50)


def test_an_empty_run_still_gives_four_panels(tmp_path):
    axes = plot.health(xr.DataTree())
    assert [texts(ax) for ax in axes] == [["not recorded"]] * 4
    plot.save(axes, tmp_path / "empty.png", dpi=50)


def test_many_fibers_become_bands(crowd):
    error, _, _, curvature = plot.health(crowd)
    assert len(error.collections) == len(curvature.collections) == 1


def test_colours_of_thin_lines_are_seen_in_the_legend(run):
    wall = plot.health(run)[2]
    assert min(line.get_linewidth() for line in wall.get_lines()) < 0.5
    assert min(line.get_linewidth() for line in wall.get_legend().get_lines()) >= 1.0
