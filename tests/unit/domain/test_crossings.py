"""Neighbour search and the check for fibers that passed through each other."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.crossings import find_crossings
from stokesfibers.domain.neighbours import closest, within
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


def test_crossing_of_an_image_needs_the_period():
    away = (6.0, 0.0, 0.0)
    before, after = _cross(0.01, away), _cross(-0.02, away)
    assert find_crossings(before, after, Free()) == ()
    (found,) = find_crossings(before, after, Periodic((2.0, 0.0, 0.0)))
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


@pytest.mark.parametrize("periods", [(0, 0, 0), (-1, 0, 0), (1, 2), (1, "x", 0), (np.nan, 0, 0)])
def test_bad_periods_are_refused(periods):
    with pytest.raises(InputError, match="periods"):
        Periodic(periods)
