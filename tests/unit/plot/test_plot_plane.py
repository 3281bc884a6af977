"""The grid of a slice, and which fibers and images are drawn on it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from stokesfibers import plot
from stokesfibers.core.errors import InputError

PERIOD = 1.25


@pytest.fixture
def cell(pair):
    """Two straight fibers in a cell periodic in x: one across the border, one far outside."""
    pair.attrs["case"] = json.dumps({"domain": {"kind": "periodic", "periods": [PERIOD, 0, 0]}})
    s = np.linspace(-0.5, 0.5, 21)
    flat = np.zeros((2, 21, 3))
    flat[0, :, 0], flat[0, :, 1] = s + 1.0, 0.5
    flat[1, :, 2], flat[1, :, 0] = 0.8 * s, 0.3 + 3 * PERIOD
    flat[1, :, 1] = 0.6 * s
    pair["trajectory"]["position"][:] = flat
    return pair


def test_the_grid_covers_the_cell_and_the_fibers_with_even_steps(cell):
    plane = plot.plane_of(cell, points=51)
    assert [plane.x[0], plane.x[-1]] == [0.0, PERIOD]
    # y from -0.3 to 0.5, and a quarter of a length more
    np.testing.assert_allclose([plane.y[0], plane.y[-1]], [-0.55, 0.75], rtol=1e-12)
    assert len(plane.y) == 51
    assert len(plane.x) == 49
    assert plane.at == pytest.approx(0.0, abs=1e-12)
    assert plane.time == 10.0
    np.testing.assert_allclose(plane.points[:, 0], [[0.0, y, 0.0] for y in plane.y], atol=1e-12)


def test_fibers_come_wrapped_with_the_images_that_reach_into_view(cell):
    plane = plot.plane_of(cell, at=0.1)
    starts = sorted(tuple(np.round(line[0, :3], 12) + 0.0) for line in plane.fibers)
    # across the border: itself and its image; the other: one image, 3 periods to the left
    assert starts == [(-0.75, 0.5, -0.1), (0.3, -0.3, -0.5), (0.5, 0.5, -0.1)]


def test_other_planes_turn_points_and_components_alike(cell):
    plane = plot.plane_of(cell, axes="zy", at=0.4, points=20, time=2.51)
    assert plane.time == 2.5
    assert plane.directions == [2, 1, 0]
    points = plane.points
    assert np.all(points[..., 0] == 0.4)
    np.testing.assert_array_equal(plane.components(points)[0, :, 0], plane.x)
    np.testing.assert_array_equal(plane.components(points)[:, 0, 1], plane.y)
    # a rod of 0.8 along z and 0.6 along y at x = 0.3, one period on both sides of it as well
    distances = sorted(round(float(line[0, 2]), 12) for line in plane.fibers)
    assert {-0.1, round(-0.1 - PERIOD, 12), round(-0.1 + PERIOD, 12)} <= set(distances)


def test_fibers_come_with_the_radius_that_the_case_tells(cell):
    assert all(np.all(line[:, 3] == 0.0) for line in plot.plane_of(cell).fibers)
    stored = json.loads(cell.attrs["case"])
    alike = {"length": 1.0, "slenderness": 0.01, "count": 2}
    cell.attrs["case"] = json.dumps({**stored, "fiber": alike})
    assert all(line[10, 3] == pytest.approx(0.01) for line in plot.plane_of(cell).fibers)
    groups = [{"length": 1.0, "slenderness": 0.02}, {"length": 1.0, "radius": 0.05, "count": 1}]
    cell.attrs["case"] = json.dumps({**stored, "fiber": groups})
    s = cell["trajectory"]["arclength"].to_numpy()[0]
    for line in plot.plane_of(cell, at=0.1).fibers:
        eps = 0.02 if line[0, 2] == -0.1 else 0.05
        np.testing.assert_allclose(line[:, 3], 2.0 * eps * np.sqrt(s * (1.0 - s)), atol=1e-15)


@pytest.mark.parametrize("options", [{"axes": "xx"}, {"axes": "xw"}, {"axes": "xyz"}])
def test_planes_that_are_none_are_refused(options, cell):
    with pytest.raises(InputError, match="two different letters"):
        plot.plane_of(cell, **options)


def test_bad_points_times_and_positions_are_refused(cell):
    with pytest.raises(InputError, match="points"):
        plot.plane_of(cell, points=4)
    with pytest.raises(InputError, match="2000"):
        plot.plane_of(cell, points=2001)
    with pytest.raises(InputError, match="finite number"):
        plot.plane_of(cell, at=float("nan"))
    with pytest.raises(InputError, match="between 0 and 10"):
        plot.plane_of(cell, time=-1.0)
    cell["trajectory"]["position"][-1, 0] = np.nan
    with pytest.raises(InputError, match="finite positions"):
        plot.plane_of(cell)


def grid():
    x, y = np.linspace(0.0, 2.0, 21), np.linspace(-0.5, 0.5, 11)
    u = np.zeros((11, 21, 3))
    u[..., 0] = y[:, None]
    return x, y, u


def test_a_fiber_is_bold_only_near_the_plane():
    x, y, u = grid()
    line = np.stack([np.linspace(0.2, 1.2, 11), np.zeros(11), np.linspace(-1.0, 1.0, 11)], -1)
    thin, bold = plot.velocity_slice(x, y, u, fibers=[line], within=0.1).get_lines()
    np.testing.assert_array_equal(thin.get_xydata(), line[:, :2])
    drawn = np.asarray(bold.get_xdata())
    drawn = drawn[np.isfinite(drawn)]
    # |z| <= 0.1 holds on a tenth of the fiber about its middle at x = 0.7
    np.testing.assert_allclose([drawn.min(), drawn.max()], [0.65, 0.75], atol=1e-12)
    assert bold.get_linewidth() > 2.0 * thin.get_linewidth()
    assert (bold.get_linestyle(), thin.get_linestyle()) == ("-", "--")
    away = line + np.array([0.0, 0.0, 5.0])
    assert len(plot.velocity_slice(x, y, u, fibers=[away], within=0.1).get_lines()) == 1


def test_the_axes_are_named_after_the_plane():
    ax = plot.velocity_slice(*grid(), axes="zy")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$z$ [length]", "$y$ [length]")


def test_a_few_fast_points_do_not_wash_out_the_colours():
    x, y, u = grid()
    assert plot.velocity_slice(x, y, u).collections[0].get_clim() == (0.0, 0.5)
    u[5, 7, 0] = 100.0
    ax = plot.velocity_slice(x, y, u)
    assert ax.collections[0].get_clim() == (0.0, 0.5)
    bar = ax.collections[0].colorbar
    assert bar is not None
    assert bar.extend == "max"


def test_the_colour_bar_says_what_is_left_out_on_as_many_lines_as_fit():
    x, y, u = grid()
    low = plot.velocity_slice(x, y, u).collections[0].colorbar
    tall = plot.velocity_slice(y, x, u.swapaxes(0, 1), disturbance=True).collections[0].colorbar
    assert low is not None
    assert tall is not None
    assert low.ax.get_ylabel() == "fluid speed\n$|\\mathbf{u}|$ [length time$^{-1}$]"
    said = r"disturbance speed $|\mathbf{u}-\mathbf{U}|$ [length time$^{-1}$]"
    assert tall.ax.get_ylabel() == said


def test_speeds_that_are_all_zero_have_colours():
    x, y, u = grid()
    ax = plot.velocity_slice(x, y, 0.0 * u)
    assert ax.collections[0].get_clim() == (0.0, 1.0)


def test_the_radius_of_a_fiber_fills_its_hole_and_is_drawn():
    x, y = np.linspace(0.0, 2.0, 81), np.linspace(-0.5, 0.5, 41)
    u = np.zeros((41, 81, 2))
    u[..., 0] = 1.0 + x
    near = (np.abs(y)[:, None] < 0.1) & (x > 0.3) & (x < 1.1)
    u[near] = np.nan
    line = np.stack([np.linspace(0.2, 1.2, 21), np.zeros(21)], axis=-1)
    bare = plot.velocity_slice(x, y, u, fibers=[line])
    assert np.sum(np.ma.getmaskarray(np.ma.masked_invalid(bare.collections[0].get_array()))) > 100
    thick = np.column_stack([line, np.full(21, 0.06), np.full(21, 0.1)])
    ax = plot.velocity_slice(x, y, u, fibers=[thick])
    speed = np.ma.filled(ax.collections[0].get_array(), np.nan)
    assert np.isfinite(speed).all()
    np.testing.assert_array_equal(speed[~near], np.broadcast_to(1.0 + x, near.shape)[~near])
    # from the nearest point that is known, at most a radius away
    assert np.abs(speed - (1.0 + x))[near].max() <= 0.1 + 1e-12
    discs = ax.collections[-1]
    # the plane cuts a cylinder of 0.1 at the distance 0.06: half a width of 0.08
    np.testing.assert_allclose(discs.get_widths(), 0.16, rtol=1e-12)
    middles = np.asarray(discs.get_offsets())
    np.testing.assert_allclose([middles[:, 0].min(), middles[:, 0].max()], [0.2, 1.2])
    assert np.diff(np.sort(middles[:, 0])).max() < 0.03
    away = np.column_stack([line, np.full(21, 0.2), np.full(21, 0.1)])
    held = plot.velocity_slice(x, y, u, fibers=[away]).collections[0].get_array()
    assert np.isnan(np.ma.filled(held, np.nan)).sum() == near.sum()


def test_arrows_do_not_line_up():
    x, y, u = grid()
    u[..., 0] = 1.0
    ax = plot.velocity_slice(x, y, u)
    ax.figure.canvas.draw()
    lines = ax.collections[1].get_segments()
    tips = [patch.get_path().vertices.mean(axis=0) for patch in ax.patches]
    assert len(tips) == len(lines) > 8
    across = np.sort([tip[0] for tip in tips])
    # over much of the width, and no two of neighbouring lines above one another
    assert np.ptp(across) > 0.8
    ordered = np.array(sorted(tips, key=lambda tip: tip[1]))
    assert np.abs(np.diff(ordered[:, 0])).min() > 0.1
