"""Neighbour search and the check for fibers that passed through each other."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.crossings import find_crossings
from stokesfibers.domain.neighbours import closest, within
from stokesfibers.domain.sheared import Sheared
from support import assert_close

S = np.linspace(-0.5, 0.5, 21)


def _distance(positions, domain):
    return closest(positions, np.zeros(positions.shape[:2]), domain).distance


def _cross(height, shift=(0.0, 0.0, 0.0)):
    """Two straight fibers, one along x, one along y at a height above it."""
    along_x = np.stack([S, 0 * S, 0 * S], axis=-1)
    along_y = np.stack([0 * S + 0.013, S, 0 * S + height], axis=-1) + np.array(shift)
    return np.stack([along_x, along_y])


def test_crossing_is_found_with_its_pair_and_time():
    (found,) = find_crossings(_cross(0.01), _cross(-0.02), Free())
    assert (found.first, found.second) == (0, 1)
    assert_close(found.fraction, 1.0 / 3.0, rtol=1e-9)


@pytest.mark.parametrize(
    ("before", "after"),
    [(0.01, 0.005), (-0.01, -0.02), (0.01, 0.03)],
    ids=["nearer", "away below", "away above"],
)
def test_fibers_that_stay_on_their_side_do_not_cross(before, after):
    assert find_crossings(_cross(before), _cross(after), Free()) == ()


def test_passing_beyond_the_end_is_no_crossing():
    beside = (0.0, 0.52, 0.0)  # the second fiber ends before it reaches the first
    assert find_crossings(_cross(0.01, beside), _cross(-0.01, beside), Free()) == ()


def _meeting(seed, at, when=0.37):
    """Two straight fibers askew that meet at fractions `at` of their lengths at `when` of a step.

    They are far from the origin and turn nowhere: one moves at a constant velocity.
    """
    random = np.random.default_rng(seed)
    along = random.normal(size=(2, 3)) * np.array([[1.0], [0.6]])
    place = random.uniform(-7.0, 7.0, size=3)
    velocity = random.normal(size=3)
    moments = []
    for time in (0.0, 1.0):
        ends = (
            place + (np.array([0.0, 1.0])[:, None] - np.array(at)[:, None, None]) * along[:, None]
        )
        ends[0] += (time - when) * velocity
        moments.append(
            ends[:, :1] + np.linspace(0.0, 1.0, 4)[:, None] * (ends[:, 1:] - ends[:, :1])
        )
    return moments


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("at", [(0.05, 0.1), (0.15, 0.9), (0.93, 0.2), (0.8, 0.97)])
def test_fibers_askew_cross_where_and_when_they_meet(seed, at):
    (found,) = find_crossings(*_meeting(seed, at), Free())
    assert_close(found.fraction, 0.37, rtol=1e-9)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("at", [(1.05, 0.5), (0.5, -0.05), (-0.1, 0.9), (0.3, 1.1)])
def test_fibers_askew_that_pass_beyond_an_end_do_not_cross(seed, at):
    assert find_crossings(*_meeting(seed, at), Free()) == ()


def test_crossing_of_an_image_needs_the_period():
    away = (6.0, 0.0, 0.0)
    before, after = _cross(0.01, away), _cross(-0.02, away)
    assert find_crossings(before, after, Free()) == ()
    (found,) = find_crossings(before, after, Periodic((2.0, 0.0, 0.0)))
    assert_close(found.fraction, 1.0 / 3.0, rtol=1e-9)


@pytest.mark.parametrize("domain", [Free(), Sheared((2.0, 2.0, 2.0))], ids=["free", "sheared"])
def test_falling_together_changes_no_crossing(domain):
    before, after = _cross(0.01), _cross(-0.02)
    (found,) = find_crossings(before, after + np.array([3.0, -500.0, 2.0]), domain)
    assert (found.first, found.second) == (0, 1)
    assert_close(found.fraction, 1.0 / 3.0, rtol=1e-9)


def test_fast_crossing_by_many_spacings_is_found():
    assert len(find_crossings(_cross(0.2), _cross(-0.2), Free())) == 1


@pytest.mark.parametrize("periods", [None, (2.5, 0.0, 0.0), (2.5, 2.0, 3.0)])
def test_smallest_distance_equals_brute_force(periods):
    random = np.random.default_rng(5)
    units = random.normal(size=(12, 3))
    units /= np.linalg.norm(units, axis=1, keepdims=True)
    middles = random.uniform(-4.0, 4.0, size=(12, 3))
    positions = middles[:, None] + 1.0 * S[:, None] * units[:, None]
    domain = Free() if periods is None else Periodic(periods)
    fine = np.linspace(-0.5, 0.5, 401)
    dense = middles[:, None] + fine[:, None] * units[:, None]
    best = np.inf
    for k in range(12):
        for m in range(k):
            apart = domain.nearest_image(dense[k][:, None] - dense[m][None])
            best = min(best, np.linalg.norm(apart, axis=-1).min())
    assert_close(_distance(positions, domain), best, atol=1e-4)


def test_a_fiber_meets_its_own_image():
    positions = np.stack([S, 0 * S, 0 * S], axis=-1)[None]
    assert _distance(positions, Free()) == np.inf
    assert_close(_distance(positions, Periodic((1.2, 0.0, 0.0))), 0.2, rtol=1e-12)


def test_pairs_within_a_radius_leave_out_the_own_fiber():
    pairs = within(_cross(0.03), 0.06, Free())
    assert pairs.first.size > 0
    assert set(pairs.first // 21) == {0}
    assert set(pairs.second // 21) == {1}


@pytest.mark.parametrize("domain", [Periodic((1.3, 1.1, 0.0)), Sheared((1.3, 1.1, 1.2), 0.4)])
def test_shifts_bring_the_first_of_a_pair_to_the_second(domain):
    points = np.random.default_rng(8).uniform(-4.0, 4.0, size=(30, 2, 3))
    pairs = within(points, 0.4, domain)
    flat = points.reshape(-1, 3)
    plain = flat[pairs.first] - flat[pairs.second]
    assert len(plain) > 20
    assert np.abs(plain).max() > 1.0
    assert_close(plain + pairs.shift, domain.nearest_image(plain), atol=1e-12)
    assert np.linalg.norm(plain + pairs.shift, axis=1).max() < 0.4


@pytest.mark.parametrize("unit", [1.0, 1e-10, 1e10])
@pytest.mark.parametrize("kind", [Periodic, Sheared])
def test_a_fiber_is_no_stranger_to_itself_but_to_its_images_in_any_unit(kind, unit):
    cell = kind((1.2 * unit, 3.0 * unit, 3.0 * unit))
    fiber = unit * np.stack([S + 5.0, 0 * S - 7.0, 0 * S], axis=-1)[None]
    pairs = within(fiber, 0.28 * unit, cell)
    # its ends are 0.2 apart through the period, and nodes are 0.05 apart
    found = set(zip(pairs.first.tolist(), pairs.second.tolist(), strict=True))
    assert found == {(0, 20), (0, 19), (1, 20)}


def test_pairs_within_a_radius_longer_than_a_period_are_all_found():
    """Two rows of images up, a cell long in x is displaced by almost a period."""
    cell = Sheared((3.0, 0.3, 1.0), 4.6)
    assert cell.offset == pytest.approx(1.38)
    points = np.random.default_rng(6).uniform(-4.0, 4.0, size=(40, 1, 3))
    pairs = within(points, 0.5, cell)
    apart = np.linalg.norm(cell.nearest_image(points - points[:, 0]), axis=-1)
    expected = {(i, j) for i, j in zip(*np.nonzero(apart < 0.5), strict=True) if i < j}
    assert 100 < len(expected) < 600
    assert set(zip(pairs.first.tolist(), pairs.second.tolist(), strict=True)) == expected


def test_the_smallest_gap_may_be_between_thick_fibers_farther_apart():
    """Each thick fiber has a thin one nearer by, whose surface is farther."""
    centres = np.array([[0.0, 0.0, 0.0], [1.05, 0.0, 0.0], [0.0, 0.6, 0.0], [1.05, 0.6, 0.0]])
    points = centres[:, None] + np.array([[0.0, 0.0, -0.01], [0.0, 0.0, 0.01]])
    radii = np.array([0.5, 0.5, 0.0, 0.0])[:, None] * np.ones(2)
    found = closest(points, radii, Free())
    assert_close([found.distance, found.gap], [0.6, 0.05], rtol=1e-12)


def test_volume_of_a_cell():
    assert Periodic((2.0, 3.0, 5.0)).volume == 30.0
    assert Sheared((2.0, 3.0, 5.0), 0.7).volume == 30.0
    assert Periodic((2.0, 3.0, 0.0)).volume == np.inf


@pytest.mark.parametrize("periods", [(0, 0, 0), (-1, 0, 0), (1, 2), (1, "x", 0), (np.nan, 0, 0)])
def test_bad_periods_are_refused(periods):
    with pytest.raises(InputError, match="periods"):
        Periodic(periods)
