"""The sheared cell: wrapping, the nearest image, the offset, what is refused."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.domain import Periodic
from stokesfibers.domain.sheared import Sheared
from support import assert_close

PERIODS = (1.0, 1.5, 0.8)


def _vectors(cell):
    return np.array([[1.0, 0, 0], [cell.offset, 1.5, 0], [0, 0, 0.8]])


@pytest.mark.parametrize("strain", [0.0, 0.21, 0.37, -5.3, 1e4 + 0.3])
def test_offset_is_the_shear_up_to_whole_periods(strain):
    cell = Sheared(PERIODS, strain)
    assert abs(cell.offset) <= 0.5
    turns = (strain * 1.5 - cell.offset) / 1.0
    assert turns == pytest.approx(round(turns), abs=1e-9)


def test_wrapping_takes_off_lattice_vectors():
    cell = Sheared(PERIODS, 0.3)
    points = np.random.default_rng(0).standard_normal((200, 3)) * 4.0
    inside, taken = cell.wrapped(points)
    assert np.all((inside >= 0.0) & (inside <= cell.lengths))
    assert_close(inside + taken @ _vectors(cell), points, rtol=1e-14)
    assert_close(cell.wrap(points), inside)


@pytest.mark.parametrize("strain", [0.0, 0.3, 1.0 / 3.0, -0.13])
def test_nearest_image_is_the_shortest(strain):
    cell = Sheared(PERIODS, strain)
    points = np.random.default_rng(1).standard_normal((100, 3)) * 3.0
    found = cell.nearest_image(points)
    steps = np.array(list(product(range(-3, 4), repeat=3))) @ _vectors(cell)
    best = np.linalg.norm(found[:, None] + steps, axis=-1).min(axis=1)
    assert_close(np.linalg.norm(found, axis=-1), best, rtol=1e-13)
    whole = (found - points) @ np.linalg.inv(_vectors(cell))
    assert_close(whole, np.round(whole), atol=1e-12)


@pytest.mark.parametrize("strain", [0.9, 3.3, 3.5])
def test_nearest_image_of_a_flat_cell_may_be_two_rows_away(strain):
    """Rows of images are close in a cell that is long in x: the nearest is not in the next one."""
    cell = Sheared((3.0, 0.7, 1.0), strain)
    points = np.random.default_rng(3).uniform(-3.0, 3.0, (2000, 3))
    found = cell.nearest_image(points)
    lattice = np.array([[3.0, 0, 0], [cell.offset, 0.7, 0], [0, 0, 1.0]])
    steps = np.array(list(product(range(-3, 4), range(-5, 6), (0,)))) @ lattice
    best = np.linalg.norm(found[:, None] + steps, axis=-1).min(axis=1)
    assert_close(np.linalg.norm(found, axis=-1), best, rtol=1e-13)


def test_images_slide_by_what_the_strain_grows_times_the_period_along_y():
    """Of a point at rest the image one period up moves like the offset, but for whole periods."""
    before, after = Sheared(PERIODS, 0.2), Sheared(PERIODS, 0.26)
    assert before.slide_to(after) == pytest.approx(0.06 * 1.5, rel=1e-12)
    assert before.slide_to(after) == pytest.approx(after.offset - before.offset, rel=1e-12)
    assert before.slide_to(before.at(0.2 + 1.0 / 1.5)) == pytest.approx(1.0, rel=1e-12)


def test_without_strain_it_is_the_periodic_box():
    points = np.random.default_rng(2).standard_normal((50, 3)) * 3.0
    cell, box = Sheared(PERIODS), Periodic(PERIODS)
    assert_close(cell.wrap(points), box.wrap(points), atol=1e-14)
    assert_close(cell.nearest_image(points), box.nearest_image(points), atol=1e-14)
    assert cell.volume == pytest.approx(box.volume)


def test_bad_cells_are_refused():
    with pytest.raises(InputError, match="periods"):
        Sheared((1.0, 0.0, 1.0), 0.1)
    with pytest.raises(InputError, match="strain"):
        Sheared(PERIODS, float("nan"))
    assert Sheared(PERIODS, 0.1).at(0.4) == Sheared(PERIODS, 0.4)
