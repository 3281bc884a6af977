"""Random placement of straight fibers and their orientation distributions."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.core.segments import segment_distances
from stokesfibers.fiber.initial import NearlyStraight, Straight
from stokesfibers.fiber.orientation import Aligned, InPlane, Isotropic, VonMisesFisher
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.fiber.placement import Box, place_randomly
from stokesfibers.fiber.suspension import Suspension
from support import assert_close


def test_segment_distances_equal_a_fine_search():
    random = np.random.default_rng(0)
    g = np.linspace(0.0, 1.0, 801)
    for _ in range(100):
        a, u, c, v = random.normal(size=(4, 3))
        near = np.linalg.norm((a + g[:, None] * u)[:, None] - (c + g[:, None] * v), axis=-1).min()
        found = segment_distances(a, u, c[None], v[None])[0]
        assert found <= near + 1e-12
        assert found > near - 0.01


def test_segment_distances_of_parallel_segments():
    a, u = np.zeros(3), np.array([1.0, 0.0, 0.0])
    starts = np.array([[0.2, 0.3, 0.0], [1.5, 0.0, 0.0], [-2.0, 0.4, 0.0]])
    alongs = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assert_close(
        segment_distances(a, u, starts, alongs), [0.3, 0.5, np.hypot(2.0, 0.4)], rtol=1e-12
    )


@pytest.mark.parametrize("periods", [(2.5, 0.0, 0.0), (2.5, 2.5, 2.5), (0.0, 0.0, 0.0)])
def test_placed_fibers_keep_the_gap_images_included(periods):
    kinds = (Fiber(slenderness=0.02),) * 15 + (Fiber(length=0.5, slenderness=0.02),) * 10
    box = Box(np.zeros(3), np.full(3, 2.5), np.array(periods))
    middles, units = place_randomly(kinds, box, orientation=Isotropic(), least_gap=0.05, seed=3)
    lengths = np.array([k.length for k in kinds])
    radii = np.array([k.eps * k.length for k in kinds])
    starts = middles - 0.5 * lengths[:, None] * units
    alongs = lengths[:, None] * units
    shifts = np.array(list(product((-1, 0, 1), repeat=3))) * np.array(periods)
    gaps = [
        segment_distances(starts[k] + shift, alongs[k], starts[[m]], alongs[[m]])[0]
        - radii[k]
        - radii[m]
        for k in range(25)
        for m in range(25)
        for shift in shifts
        if m < k or (m == k and shift.any())
    ]
    assert min(gaps) >= 0.05
    assert min(gaps) < 0.15  # dense enough that the gap matters


def test_bent_fibers_keep_the_gap_and_bend_in_random_planes():
    fibers = (Fiber(slenderness=0.02),) * 12
    made = {
        amplitude: np.array(
            [
                curve.at_fractions(np.linspace(0.0, 1.0, 65))
                for curve in Suspension(
                    seed=2, box=(2.0, 2.0, 2.0), least_gap=0.05, amplitude=amplitude
                ).curves(fibers, np.zeros(3))
            ]
        )
        for amplitude in (0.0, 8.0, -8.0)
    }
    x = made[8.0]
    ends = x[:, -1] - x[:, 0]
    units = ends / np.linalg.norm(ends, axis=1)[:, None]
    sag = x[:, 32] - 0.5 * (x[:, 0] + x[:, -1])
    assert_close(np.linalg.norm(sag, axis=1), np.full(12, 8.0 / 256.0), rtol=5e-3)
    assert np.abs(np.sum(sag * units, axis=1)).max() < 1e-12
    normals = sag / np.linalg.norm(sag, axis=1)[:, None]
    assert np.linalg.norm(normals.mean(axis=0)) < 0.6, "in all directions"
    assert_close(made[-8.0][:, 32] - 0.5 * (made[-8.0][:, 0] + made[-8.0][:, -1]), -sag, atol=1e-12)
    straight = made[0.0][:, -1] - made[0.0][:, 0]
    assert_close(np.linalg.norm(straight, axis=1), np.ones(12), rtol=1e-12)
    for k in range(12):
        others = np.delete(x, k, axis=0).reshape(-1, 3)
        apart = np.linalg.norm(x[k][:, None] - others, axis=-1).min()
        assert apart >= 0.05 + 0.04


def test_fibers_that_are_short_beside_the_cell_keep_the_gap():
    """Needles in a plane: neighbours are looked for in cells about as wide as a fiber is long."""
    periods = np.array([2.0, 1.6, 0.0])
    middles, units = place_randomly(
        (Fiber(length=0.3, slenderness=0.01),) * 50,
        Box(np.zeros(3), np.array([2.0, 1.6, 1e-9]), periods),
        orientation=InPlane(),
        least_gap=0.02,
        seed=0,
    )
    starts, alongs = middles - 0.15 * units, 0.3 * units
    shifts = np.array(list(product((-1, 0, 1), (-1, 0, 1), (0,)))) * periods
    gaps = [
        segment_distances(starts[k] + shift, alongs[k], starts[:k], alongs[:k]).min() - 0.006
        for k in range(1, 50)
        for shift in shifts
    ]
    assert 0.02 <= min(gaps) < 0.03


@pytest.mark.parametrize(("gap", "fits"), [(0.05, True), (0.16, False)])
def test_radii_of_both_fibers_are_kept_apart(gap, fits):
    """Side by side, at most 0.3 apart, with radii 0.1 and 0.05; the first is near the border."""
    kinds = (Fiber(slenderness=0.1), Fiber(length=0.5, slenderness=0.1))
    box = Box(np.zeros(3), np.array([1e-3, 0.3, 1e-3]), np.zeros(3))
    options = {"orientation": Aligned(), "least_gap": gap, "seed": 25}
    if fits:
        middles, _ = place_randomly(kinds, box, **options)
        assert 0.2 <= abs(middles[1, 1] - middles[0, 1]) < 0.3
    else:
        with pytest.raises(InputError, match=r"room for 1 \(n L\^3 would be 3.75e\+06"):
            place_randomly(kinds, box, **options)


@pytest.mark.parametrize(("gap", "fits"), [(0.03, True), (0.042, False)])
def test_a_fiber_keeps_the_gap_to_its_own_image(gap, fits):
    """End to end 0.05 apart, with a radius of 0.005 as a cylinder with round ends."""
    periods = np.array([1.05, 3.0, 3.0])
    fibers, box = (Fiber(slenderness=0.005),), Box(np.zeros(3), periods, periods)
    options = {"orientation": Aligned(), "least_gap": gap, "seed": 1}
    if fits:
        assert len(place_randomly(fibers, box, **options)[0]) == 1
    else:
        with pytest.raises(InputError, match="room for 0"):
            place_randomly(fibers, box, **options)


def test_fibers_longer_than_a_period_keep_the_gap_to_images_beyond_the_next():
    periods = np.array([0.4, 1.5, 3.0])
    shifts = np.array(list(product(range(-4, 5), (-1, 0, 1), (-1, 0, 1)))) * periods
    own = np.any(shifts != 0.0, axis=1)
    for seed in range(4, 10):
        middles, units = place_randomly(
            (Fiber(slenderness=0.005),) * 2,
            Box(np.zeros(3), periods, periods),
            orientation=Isotropic(),
            least_gap=0.03,
            seed=seed,
        )
        for k, m in ((0, 0), (1, 0), (1, 1)):
            starts = middles[m] - 0.5 * units[m] + (shifts[own] if k == m else shifts)
            alongs = np.tile(units[m], (len(starts), 1))
            gaps = segment_distances(middles[k] - 0.5 * units[k], units[k], starts, alongs) - 0.01
            assert gaps.min() >= 0.03


def test_placement_repeats_with_its_seed_and_changes_with_it():
    kinds = (Fiber(slenderness=0.01),) * 5
    box = Box(np.zeros(3), np.full(3, 3.0), np.zeros(3))
    one, again, other = (
        place_randomly(kinds, box, orientation=Isotropic(), least_gap=0.0, seed=seed)[0]
        for seed in (1, 1, 2)
    )
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)


def test_a_box_that_is_too_full_is_refused_with_the_count_reached():
    box = Box(np.zeros(3), np.full(3, 1.0), np.full(3, 1.0))
    with pytest.raises(InputError, match=r"room for \d+ \(n L\^3"):
        place_randomly(
            (Fiber(slenderness=0.05),) * 200,
            box,
            orientation=Isotropic(),
            least_gap=0.1,
            seed=0,
        )


def test_orientations_have_their_moments():
    random = np.random.default_rng(7)
    for orientation, expected in [
        (Isotropic(), np.eye(3) / 3.0),
        (Aligned((0.0, 2.0, 0.0)), np.diag([0.0, 1.0, 0.0])),
        (InPlane((0.0, 0.0, 1.0)), np.diag([0.5, 0.5, 0.0])),
    ]:
        units = orientation.sample(20000, random)
        assert_close(np.linalg.norm(units, axis=1), np.ones(20000), rtol=1e-12)
        assert_close(units.T @ units / 20000, expected, atol=0.015)
    # the mean of a von Mises-Fisher variable is coth(k) - 1/k along the axis
    units = VonMisesFisher((0.0, 0.0, 1.0), concentration=4.0).sample(20000, random)
    assert_close(units.mean(axis=0), [0.0, 0.0, 1.0 / np.tanh(4.0) - 0.25], atol=0.01)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Aligned((0, 0, 0)),
        lambda: InPlane((1, 2)),
        lambda: VonMisesFisher(concentration=0.0),
    ],
)
def test_bad_orientations_are_refused(make):
    with pytest.raises(InputError):
        make()


@pytest.mark.parametrize("size", [1.0, 1e308, 1e-320])
def test_an_axis_may_have_any_length(size):
    """Of 1e-320 few digits are left."""
    given = (0.6 * size, -0.8 * size, 0.0)
    drawn = Aligned(given).sample(2, np.random.default_rng(0))
    assert_close(drawn, np.tile((0.6, -0.8, 0.0), (2, 1)), atol=1e-4)
    assert Aligned(given).axis == given  # as the case says it


def test_a_tilt_turns_fibers_out_of_the_plane():
    """At angle theta and tilt phi: (cos theta cos phi, sin theta cos phi, sin phi)."""
    fiber, (theta, phi) = Fiber(length=2.0, slenderness=1e-2), (2.9, 0.4)
    along = (np.cos(theta) * np.cos(phi), np.sin(theta) * np.cos(phi), np.sin(phi))
    for shape in (Straight(theta, tilt=phi), NearlyStraight(theta, 0.0, tilt=phi)):
        (curve,) = shape.curves((fiber,), np.zeros(3))
        first, last = curve.at_fractions(np.array([0.0, 1.0]))
        assert_close(last - first, 2.0 * np.array(along), atol=1e-14)
    (bent,) = NearlyStraight(theta, 5.0, tilt=phi).curves((fiber,), np.zeros(3))
    (x, y, z) = bent.position(np.array([0.5]))[0]
    assert (x, z) == (0.0, 0.0)
    assert y > 0.0  # the arc is along y all the same
