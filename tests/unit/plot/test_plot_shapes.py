"""What the shape and tension figures draw is what the run stores."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from stokesfibers import plot
from stokesfibers.core.errors import InputError


def legend_texts(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_lines_are_the_stored_shapes(run):
    ax = plot.shapes(run, times=[5.0, 6.0, 7.0])
    position = run["trajectory"]["position"].to_numpy()
    assert len(ax.get_lines()) == 3
    for line, record in zip(ax.get_lines(), (20, 24, 28), strict=True):
        np.testing.assert_array_equal(line.get_xydata(), position[record, 0, :, :2])
    assert legend_texts(ax) == ["5", "6", "7"]
    assert ax.get_legend().get_title().get_text() == "time $t$"
    assert ax.get_aspect() == 1.0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ [length]", "$y$ [length]")


def test_the_run_is_not_changed_by_an_offset(run):
    before = run["trajectory"]["position"].to_numpy().copy()
    ax = plot.shapes(run, times=[5.0, 6.0, 7.0], offset=0.3)
    np.testing.assert_array_equal(run["trajectory"]["position"].to_numpy(), before)
    for number, (line, record) in enumerate(zip(ax.get_lines(), (20, 24, 28), strict=True)):
        np.testing.assert_allclose(
            line.get_xdata(), before[record, 0, :, 0] + 0.3 * number, rtol=0, atol=1e-15
        )
        np.testing.assert_array_equal(line.get_ydata(), before[record, 0, :, 1])
    assert "0.3" in ax.get_xlabel()


def test_the_plane_picks_and_orders_the_directions(run):
    ax = plot.shapes(run, times=[6.0], plane="zx")
    position = run["trajectory"]["position"].to_numpy()[24, 0]
    np.testing.assert_array_equal(ax.get_lines()[0].get_xydata(), position[:, [2, 0]])
    assert (ax.get_xlabel()[:3], ax.get_ylabel()[:3]) == ("$z$", "$x$")


@pytest.mark.parametrize("plane", ["xx", "x", "xw", "xyz", ""])
def test_other_planes_are_refused(plane, run):
    for draw in (plot.shapes, plot.shape_panels):
        with pytest.raises(InputError, match="plane"):
            draw(run, plane=plane)


def test_fibers_share_a_line_broken_between_them(pair):
    ax = plot.shapes(pair, times=[6.0, 7.0])
    position = pair["trajectory"]["position"].to_numpy()
    assert len(ax.get_lines()) == 2
    drawn = ax.get_lines()[1].get_xydata()
    np.testing.assert_array_equal(drawn[:21], position[28, 0, :, :2])
    assert np.all(np.isnan(drawn[21]))
    np.testing.assert_array_equal(drawn[22:], position[28, 1, :, :2])
    only = plot.shapes(pair, times=[6.0], fibers=1).get_lines()[0]
    np.testing.assert_array_equal(only.get_xydata(), position[24, 1, :, :2])
    with pytest.raises(InputError, match="fiber"):
        plot.shapes(pair, fibers=[0, 2])


def test_every_point_is_inside_the_axes(pair):
    ax = plot.shapes(pair)
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    for line in ax.get_lines():
        assert np.nanmin(line.get_xdata()) > left
        assert np.nanmax(line.get_xdata()) < right
        assert np.nanmin(line.get_ydata()) > bottom
        assert np.nanmax(line.get_ydata()) < top


def test_many_times_get_a_colour_bar(run):
    ax = plot.shapes(run, times=np.linspace(0.0, 10.0, 21))
    assert len(ax.get_lines()) == 21
    assert ax.get_legend() is None
    (bar,) = [other for other in ax.figure.axes if other is not ax]
    assert bar.get_ylabel() == "time $t$"
    assert bar.get_ylim() == (0.0, 10.0)
    assert ax.get_lines()[0].get_color() != ax.get_lines()[-1].get_color()


def test_given_axes_are_used(run):
    ax = plot.new_axes()
    assert plot.shapes(run, ax=ax) is ax
    assert plot.tension(run, ax=plot.new_axes()) is not ax
    assert len(ax.get_lines()) == 8


def test_positions_that_are_not_finite_are_refused(run):
    run["trajectory"]["position"][3] = np.nan
    with pytest.raises(InputError, match="finite"):
        plot.shapes(run, times=[0.75])
    assert len(plot.shapes(run, times=[0.75, 1.0]).get_lines()) == 2


def test_panels_have_one_shape_a_title_and_one_scale(run):
    times = [4.0, 5.5, 6.0, 6.1]
    axes = plot.shape_panels(run, times=times)
    position = run["trajectory"]["position"].to_numpy()
    assert [ax.get_title() for ax in axes] == ["$t = 4$", "$t = 5.5$", "$t = 6$"]
    assert len({ax.get_xlim() for ax in axes}) == len({ax.get_ylim() for ax in axes}) == 1
    for ax, record in zip(axes, (16, 22, 24), strict=True):
        (line,) = ax.get_lines()
        np.testing.assert_array_equal(line.get_xydata(), position[record, 0, :, :2])
        assert ax.get_aspect() == 1.0
    assert axes[0].figure.get_supxlabel() == "$x$ [length]"
    assert axes[0].get_ylabel() == "$y$ [length]"
    axes[0].figure.canvas.draw()
    ticks = [*axes[0].xaxis.get_ticklabels(), *axes[0].yaxis.get_ticklabels()]
    numbers = [tick.get_text() for tick in ticks]
    assert "0" in numbers
    assert not any(number.endswith("0") and "." in number for number in numbers)


def test_many_panels_fill_rows_and_no_spare_is_left(run):
    axes = plot.shape_panels(run, times=np.arange(0.0, 9.1, 1.0))
    assert len(axes) == 10
    assert len(axes[0].figure.axes) == 10
    assert len(plot.shape_panels(run)) == 8


def test_panels_show_whole_fibers_in_the_cell_as_it_is_sheared(pair):
    period = (1.0, 0.8, 0.0)
    pair.attrs["case"] = json.dumps({"domain": {"kind": "sheared", "periods": period}})
    observed = pair["observables"].to_dataset()
    strain = 0.3 * observed["time"].to_numpy() / 10.0
    pair["observables"] = xr.DataTree(observed.assign(strain=("time", strain)))
    position = pair["trajectory"]["position"].to_numpy()
    for ax, record in zip(plot.shape_panels(pair, times=[0.0, 10.0]), (0, 40), strict=True):
        outline, *lines = ax.get_lines()
        slid = 0.8 * 0.3 * record / 40
        corners = [[0, 0], [1, 0], [1 + slid, 0.8], [slid, 0.8], [0, 0]]
        np.testing.assert_allclose(outline.get_xydata(), corners, atol=1e-12)
        assert len({line.get_color() for line in (outline, *lines)}) == 3
        for fiber, line in enumerate(lines):
            drawn = line.get_xydata()
            moved = drawn - position[record, fiber, :, :2]
            assert np.ptp(moved, axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
            x, y = drawn[10]
            assert 0.0 <= y <= 0.8
            assert 0.0 <= x - slid * y / 0.8 <= 1.0
    (ax,) = plot.shape_panels(pair, times=[10.0], plane="xz")
    box = ax.get_lines()[0].get_xydata()
    assert set(box[:, 0]) == {0.0, 1.0}
    for line in ax.get_lines()[1:]:
        assert 0.0 <= line.get_xydata()[10, 0] <= 1.0


def test_many_fibers_in_a_panel_are_one_line(crowd):
    for ax in plot.shape_panels(crowd, times=[5.0, 6.0]):
        assert len(ax.get_lines()) == 1


def test_fibers_that_fall_far_are_drawn_about_their_centre(pair):
    pair["trajectory"]["position"][..., 1] -= 40.0 * pair["trajectory"]["time"]
    position = pair["trajectory"]["position"].to_numpy()
    own = position[24, ..., :2] - position[24, ..., :2].mean(axis=(0, 1))
    axes = plot.shape_panels(pair, times=[0.0, 6.0])
    for fiber, line in enumerate(axes[1].get_lines()):
        np.testing.assert_allclose(line.get_xydata(), own[fiber], atol=1e-12)
    assert axes[0].get_ylabel() == "$y - y_c$\n[length]"
    over = plot.shapes(pair, times=[0.0, 6.0])
    np.testing.assert_allclose(over.get_lines()[1].get_xydata()[:21], own[0], atol=1e-12)
    assert over.get_xlabel() == "$x - x_c$ [length]"
    assert np.ptp(over.get_ylim()) < 2.0


def test_small_times_are_written_with_a_power_of_ten(run):
    held = run["trajectory"].to_dataset()
    run["trajectory"] = xr.DataTree(held.assign_coords(time=held["time"] * 8e-5))
    assert plot.shape_panels(run, times=[2e-5])[0].get_title() == r"$t = 2\times10^{-5}$"
    assert legend_texts(plot.shapes(run, times=[0.0, 1.2e-4])) == ["0", r"$1.2\times10^{-4}$"]
    assert legend_texts(plot.tension(run, times=[2e-5])) == [r"$2\times10^{-5}$"]


def test_tension_lines_are_the_stored_ones(pair):
    ax = plot.tension(pair, times=[1.0, 9.0], fiber=1)
    zero, *lines = ax.get_lines()
    assert np.all(np.asarray(zero.get_ydata()) == 0.0)
    trajectory = pair["trajectory"]
    for line, record in zip(lines, (4, 36), strict=True):
        np.testing.assert_array_equal(line.get_xdata(), trajectory["arclength"].to_numpy()[1])
        np.testing.assert_array_equal(line.get_ydata(), trajectory["tension"].to_numpy()[record, 1])
    assert ax.get_xlabel() == "arclength $s$ [length]"
    assert ax.get_ylabel() == "line tension $T$ [force]"
    assert ax.get_title() == "fiber 1"
    assert legend_texts(ax) == ["1", "9"]


def test_tension_is_drawn_at_the_times_of_the_shapes(run):
    assert legend_texts(plot.tension(run)) == legend_texts(plot.shapes(run))


def test_tension_refuses_what_is_not_stored(run):
    with pytest.raises(InputError, match="expected 0, the only fiber, got 1"):
        plot.tension(run, fiber=1)
    with pytest.raises(InputError, match="between 0 and 10"):
        plot.tension(run, times=[11.0])
