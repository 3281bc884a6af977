"""Perspective in sheared cells, labels inside the figure, colours of fibers."""

from __future__ import annotations

import json
from itertools import pairwise

import matplotlib
import numpy as np
import pytest
import xarray as xr

from stokesfibers import plot
from stokesfibers.core.errors import InputError
from stokesfibers.domain.sheared import Sheared
from stokesfibers.plot.averages import with_error
from stokesfibers.plot.case import offset
from stokesfibers.plot.geometry import slanted, wrapped
from stokesfibers.plot.paint import node_values
from stokesfibers.plot.perspective import solid_panels
from stokesfibers.plot.solid import fit, on_page, outermost, seen_at

PERIODS = (0.8, 0.6, 0.7)


@pytest.fixture
def sheared(crowd):
    """Twelve fibers in a cell that is sheared at the rate 1."""
    crowd.attrs["case"] = json.dumps({"domain": {"kind": "sheared", "periods": PERIODS}})
    observed = crowd["observables"].to_dataset()
    observed["strain"] = ("time", observed["time"].to_numpy())
    crowd["observables"] = xr.DataTree(observed)
    return crowd


@pytest.mark.parametrize("strain", [0.0, 0.3, -0.4, 1.9])
def test_middles_are_wrapped_into_the_slanted_cell_by_lattice_vectors(strain):
    cell = Sheared(PERIODS, strain)
    random = np.random.default_rng(3)
    fibers = 3.0 * random.normal(size=(40, 1, 3)) + 0.2 * random.normal(size=(1, 5, 3))
    moved = wrapped(fibers, cell.lengths, cell.offset)
    # whole fibers are shifted, by vectors of the domain's own lattice
    shift = moved - fibers
    assert np.abs(shift - shift[:, :1]).max() < 1e-12
    assert np.abs(shift).max() > 1.0
    numbers = np.linalg.solve(cell.lattice_vectors(np.eye(3)).T, shift[:, 0].T)
    np.testing.assert_allclose(numbers, np.round(numbers), rtol=0, atol=1e-9)
    # middles lie in the slanted cell, which is drawn
    middle = moved[:, 2].copy()
    middle[:, 0] -= cell.offset / PERIODS[1] * middle[:, 1]
    assert np.all(middle >= -1e-12)
    assert np.all(middle < np.array(PERIODS) + 1e-12)


def test_the_offset_is_that_of_the_sheared_domain_at_every_time(sheared):
    for time in (0.0, 0.25, 1.3, 7.7):
        assert offset(sheared, time) == pytest.approx(Sheared(PERIODS, time).offset, abs=1e-12)


def test_a_snapshot_shows_the_cell_slanted_as_it_is(sheared):
    ax = plot.perspective(sheared, time=0.5, colour=None)
    edges = np.array(ax.collections[0]._segments3d)
    upright = np.array([[0, 0, 0], PERIODS])
    slant = offset(sheared, 0.5) / PERIODS[1]
    assert abs(slant) > 0.1
    expected = slanted(np.array([[x, y, z] for x, y, z in np.ndindex(2, 2, 2)]) * PERIODS, slant)
    corners = np.unique(np.round(edges.reshape(-1, 3), 12), axis=0)
    np.testing.assert_allclose(corners, np.unique(np.round(expected, 12), axis=0), atol=1e-12)
    assert upright[1, 0] < corners[:, 0].max() or corners[:, 0].min() < 0.0
    limits = np.array([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()])
    assert np.all(corners >= limits[:, 0] - 1e-9)
    assert np.all(corners <= limits[:, 1] + 1e-9)


@pytest.mark.parametrize("count", [1, 2])
def test_no_label_is_cut_off(count, sheared, tmp_path):
    panels = solid_panels(count, width=7.2, height=2.8)
    for ax, time in zip(panels, (0.5, 6.0), strict=False):
        plot.perspective(sheared, time=time, colour=None, ax=ax)
    path = plot.save(panels[0].figure, tmp_path / "a.png", dpi=80)
    picture = matplotlib.image.imread(path)[..., :3]
    for edge in (picture[0], picture[-1], picture[:, 0], picture[:, -1]):
        assert np.all(edge > 0.9)
    # labels of one panel keep out of the other
    boxes = [[t.get_window_extent() for t in ax.texts] for ax in panels]
    assert all(len(texts) == 4 for texts in boxes)
    for left, right in pairwise(boxes):
        assert max(b.x1 for b in left) < min(b.x0 for b in right)


def test_the_picture_fills_its_panel(sheared):
    ax = plot.perspective(sheared, time=0.5, colour=None)
    ax.figure.canvas.draw()
    limits = np.array([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()])
    seen = on_page(ax, limits) * ax.bbox.size
    assert np.max(np.ptp(seen, axis=0) / ax.figure.bbox.size) > 0.6
    assert np.all(np.ptp(seen, axis=0) < ax.figure.bbox.size)


def test_orientation_is_the_angle_of_each_piece_to_the_flow():
    angle = 0.4
    along = np.array([-np.cos(angle), np.sin(angle) * 0.6, np.sin(angle) * 0.8])
    straight = np.linspace(0, 1, 5)[:, None] * along
    turned = straight[:, [1, 0, 2]]
    values = node_values("orientation", np.stack([straight, turned]), None)
    np.testing.assert_allclose(values[0], angle, rtol=1e-12)
    np.testing.assert_allclose(values[1], np.arccos(0.6 * np.sin(angle)), rtol=1e-12)


def test_each_fiber_can_have_its_colour(sheared):
    ax = plot.perspective(sheared, time=0.5, colour="fiber")
    assert len(ax.figure.axes) == 1  # no bar
    colours = ax.collections[-1].get_colors()
    ink = colours[~np.all(colours == 1.0, axis=1)]
    assert len(np.unique(ink, axis=0)) == len(plot.LIGHT.palette)
    bar = plot.perspective(sheared, time=0.5, colour="orientation").figure.axes[1]
    assert bar.get_ylabel() == r"angle to the flow direction $\theta$ [rad]"
    np.testing.assert_allclose(bar.get_ylim(), [0.0, np.pi / 2], rtol=1e-12)


def test_averages_show_mean_and_error_over_their_times(run):
    from stokesfibers.core.variables import lookup

    variable = lookup("observables", "shear_stress")
    time = run["observables"]["time"].to_numpy()
    one = plot.Averaged(variable, time, np.cos(time), 4.0, 0.25, 0.125, False)
    (ax,) = plot.averages(run, [one])
    series, mean = ax.get_lines()
    np.testing.assert_array_equal(series.get_ydata(), np.cos(time))
    np.testing.assert_array_equal(mean.get_ydata(), [0.25, 0.25])
    np.testing.assert_array_equal(mean.get_xdata(), [4.0, 10.0])
    band = ax.collections[0].get_paths()[0].vertices
    assert [band[:, 1].min(), band[:, 1].max()] == [0.125, 0.375]
    assert ax.get_title(loc="left") == "shear stress: 0.25 ± 0.12 or more"
    assert ax.get_ylabel() == r"$\Sigma_{12}$ [force length]"
    with pytest.raises(InputError, match="averages"):
        plot.averages(run, [])


@pytest.mark.parametrize(
    ("mean", "error", "said"),
    [
        (58.45, 24.0, "58 ± 24"),
        (-0.5751, 120.0, "0 ± 120"),
        (0.003673, 0.0015, "0.0037 ± 0.0015"),
        (18.28, 1.9, "18.3 ± 1.9"),
        (12345.0, 240.0, "12340 ± 240"),
        (99.96, 0.0996, "99.96 ± 0.10"),
        (-0.004, 0.12, "0.00 ± 0.12"),
        (123456.0, 2400.0, "(1.235 ± 0.024) × 10⁵"),
        (-3e-7, 1.2e-8, "(−3.00 ± 0.12) × 10⁻⁷"),
        (2.0, 0.0, "2 ± 0"),
        (2.0, np.nan, "2 ± nan"),
    ],
)
def test_a_mean_is_rounded_to_the_second_digit_of_its_error(mean, error, said):
    assert with_error(mean, error) == said
    assert with_error(mean, error, " or more") == f"{said} or more"


def test_edges_are_labelled_with_unit_and_limits(sheared):
    ax = plot.perspective(sheared, time=0.5, colour=None)
    words = [text.get_text() for text in ax.texts]
    for name, period in zip("xyz", PERIODS, strict=True):
        assert f"${name}$ [length]\n0 to {period:g} (period)" in words


def test_the_outermost_points_bound_all_others():
    points = np.random.default_rng(2).normal(size=(500, 3))
    hull = outermost(points)
    assert len(hull) < 100
    np.testing.assert_array_equal(hull.min(axis=0), points.min(axis=0))
    np.testing.assert_array_equal(hull.max(axis=0), points.max(axis=0))
    away = np.array([3.0, -4.0, 5.0])
    assert (hull @ away).max() >= 0.9 * (points @ away).max()


def test_what_is_to_be_seen_fills_the_panel_whatever_the_box_is(sheared):
    ax = plot.perspective(sheared, time=0.5, colour=None)
    points = np.array([[0.4, 0.0, 0.3], [0.4, 0.6, 0.3]])
    small = fit(ax, np.zeros(3), np.array([2.0, 0.6, 2.0]))
    large = fit(ax, np.zeros(3), np.array([2.0, 0.6, 2.0]), shown=points)
    assert large > 1.2 * small
    seen = seen_at(ax, points)
    assert np.all((seen > 0.0) & (seen < 1.0))
