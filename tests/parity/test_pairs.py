"""The sums over other fibers: kernels against their twins, by parts against plain, decay laws."""

from __future__ import annotations

import numpy as np
import pytest

from reference.pair_twins import by_parts, doublet, plain, stokeslet
from stokesfibers.kernels import forces, pairs
from stokesfibers.kernels import stokeslet as lines
from support import assert_close, assert_order, free_end_curve, helical_curve

EPS = 0.02
WEIGHT = 0.5 * EPS**2
FREE = (np.zeros(3), np.zeros((1, 3)), np.zeros((3, 0)))
FAR_APART = (0.0, 5.0, np.zeros(1), False)  # no refinement, no blend


def _force(s, order=0):
    """An integrated force F that vanishes at both ends, or its derivative f, (3, *s.shape)."""
    s = np.asarray(s)
    window, slope = s * (1 - s), 1 - 2 * s
    waves = np.stack([np.cos(2 * s), np.sin(3 * s) - 0.4, 0.7 + s**2])
    if order == 0:
        return window * waves
    rates = np.stack([-2 * np.sin(2 * s), 3 * np.cos(3 * s), 2 * s])
    return slope * waves + window * rates


def _sum(points, curve, intervals, images=FREE, close=FAR_APART, own=-1, force=None):
    s = np.linspace(0.0, 1.0, intervals + 1)
    x, xs = curve(s)[None], curve(s, 1)[None]
    force = (_force(s) if force is None else force)[None]
    weights = np.full(intervals + 1, 1.0 / intervals)
    weights[[0, -1]] *= 0.5
    moments = np.einsum("kan,kbn,n->kab", xs, force, weights)
    return pairs.others_velocity(
        np.ascontiguousarray(points),
        np.asarray(points[0], dtype=float),
        own,
        x,
        xs,
        force,
        np.array([1.0 / intervals]),
        np.array([WEIGHT]),
        images,
        close,
        np.zeros_like(x),
        moments,
        np.ascontiguousarray(x[:, :, intervals // 2]),
    )


def test_sum_equals_the_slow_twin_of_the_forms_by_parts():
    curve, s = helical_curve(), np.linspace(0.0, 1.0, 31)
    points = np.array([[0.3, 0.5, 0.2], [-1.0, 2.0, 0.4], [0.0, 0.1, -0.9]])
    expected = [
        by_parts(p, curve(s).T, curve(s, 1).T, _force(s).T, 1.0 / 30, WEIGHT) for p in points
    ]
    assert_close(_sum(points, curve, 30), expected, rtol=1e-13)


def test_forms_by_parts_converge_to_the_plain_forms_at_second_order():
    curve = helical_curve()
    point = np.array([0.35, 0.3, 0.25])
    exact = plain(point, curve, lambda s: _force(s, 1), WEIGHT)
    errors = [
        np.abs(_sum(point[None], curve, n)[0] - exact).max() / np.abs(exact).max()
        for n in (40, 80, 160)
    ]
    assert_order(errors, between=(1.9, 2.2), final=5e-5)


def _near_errors(distance):
    """Relative errors of the plain rule and of the paper's refinement at a distance, h = 0.01."""
    curve, intervals = free_end_curve(), 100
    middle, tangent = curve(np.array(0.43)), curve(np.array(0.43), 1)
    across = np.cross(tangent, [0.3, -0.2, 1.0])
    point = (middle + distance * across / np.linalg.norm(across))[None]
    exact = plain(point[0], curve, lambda s: _force(s, 1), WEIGHT, panels=2000)
    scale = np.abs(exact).max()
    refined = (12.0, 5.0, np.zeros(1), False)
    sums = (_sum(point, curve, intervals), _sum(point, curve, intervals, close=refined))
    return [np.abs(found[0] - exact).max() / scale for found in sums]


def test_refinement_is_needed_at_one_spacing():
    coarse, fine = _near_errors(0.01)
    assert coarse > 0.05
    assert fine < 5e-3


@pytest.mark.parametrize("distance", [0.03, 0.06, 0.1])
def test_refinement_costs_accuracy_from_three_spacings_on(distance):
    # The plain rule is exponentially accurate in distance / h. Cutting only the near intervals
    # leaves the end correction h^2/12 g' of the rule where the cuts stop, at 12 h.
    coarse, fine = _near_errors(distance)
    assert coarse < 2e-4
    assert 5e-4 < fine < 5e-3


def test_stokeslet_part_decays_as_distance_squared_and_doublet_part_two_orders_faster():
    curve, s = helical_curve(), np.linspace(0.0, 1.0, 201)
    direction = np.array([0.6, -0.5, 0.62])
    distances = np.array([20.0, 40.0, 80.0])

    def magnitudes(weight):
        both = []
        for w in (0.0, weight):
            both.append(
                [
                    by_parts(d * direction, curve(s).T, curve(s, 1).T, _force(s).T, 0.005, w)
                    for d in distances
                ]
            )
        plain_part, total = np.array(both)
        return np.linalg.norm(plain_part, axis=1), np.linalg.norm(total - plain_part, axis=1)

    v, w = magnitudes(1.0)
    slopes = [np.polyfit(np.log(distances), np.log(part), 1)[0] for part in (v, w)]
    assert_close(slopes, [-2.0, -4.0], atol=0.05)


def test_opposite_images_together_decay_as_the_cube_of_their_number():
    curve = helical_curve()
    point = np.array([[0.3, 0.5, 0.2]])
    numbers = np.array([8, 16, 32])
    sizes = []
    for p in numbers:
        shifts = np.array([[2.0 * p, 0.0, 0.0], [-2.0 * p, 0.0, 0.0]])
        images = (np.array([2.0, 0.0, 0.0]), shifts, np.zeros((3, 0)))
        sizes.append(np.linalg.norm(_sum(point, curve, 200, images=images)))
    assert_close(np.polyfit(np.log(numbers), np.log(sizes), 1)[0], -3.0, atol=0.1)


def test_far_images_by_moments_approach_the_exact_images():
    # the moment tensor is symmetric, as (41) needs, only for a torque-free fiber
    curve, s = free_end_curve(), np.linspace(0.0, 1.0, 401)
    tension = s * (1.0 - s) * (3.0 + np.sin(4.0 * s))
    force = curve(s, 3) - tension * curve(s, 1)
    point = np.array([[0.3, 0.5, 0.2]])
    errors = []
    for p in (4, 8, 16):
        shift = np.array([[2.0 * p, 0.0, 0.0]])
        periods = np.array([2.0, 0.0, 0.0])
        exact = _sum(point, curve, 400, images=(periods, shift, np.zeros((3, 0))), force=force)
        images = (periods, np.zeros((0, 3)), shift.T.copy())
        moments = _sum(point, curve, 400, images=images, force=force)
        errors.append(np.abs(exact - moments).max() / np.abs(exact).max())
    assert_order(errors, between=(0.8, 1.3), final=5e-2)


def test_a_point_within_d0_gets_the_centreline_value_and_the_blend_is_as_stated():
    curve, intervals = free_end_curve(), 50
    s = np.linspace(0.0, 1.0, intervals + 1)
    x, xs, force = curve(s)[None], curve(s, 1)[None], _force(s)[None]
    centreline = np.stack([1.0 + s, 2.0 - s, 0.5 * s])[None]
    across = np.cross(curve(0.5, 1), [0.3, -0.2, 1.0])
    across /= np.linalg.norm(across)

    def at(distance, smooth):
        point = (curve(0.5) + distance * across)[None]
        return pairs.others_velocity(
            point, point[0], -1, x, xs, force, np.array([1.0 / intervals]), np.array([WEIGHT]),
            FREE, (12.0, 5.0, np.array([0.05]), smooth), centreline, np.zeros((1, 3, 3)),
            np.zeros((1, 3)),
        )[0]  # fmt: skip

    own = np.array([1.5, 1.5, 0.25])
    assert_close(at(0.049, False), own, rtol=1e-2)
    outer = _sum((curve(0.5) + 0.08 * across)[None], curve, intervals,
                 close=(12.0, 5.0, np.zeros(1), False))[0]  # fmt: skip
    assert_close(at(0.08, False), 0.6 * outer + 0.4 * own, rtol=1e-2)
    step = pairs.blend_weight(0.08, 0.05, True)
    assert_close(step, 0.6**3 * (10 - 15 * 0.6 + 6 * 0.36), rtol=1e-12)
    assert_close(at(0.08, True), step * outer + (1 - step) * own, rtol=1e-2)


def test_the_fiber_itself_is_left_out_but_its_images_are_not():
    curve, s = helical_curve(), np.linspace(0.0, 1.0, 31)
    points = curve(s).T
    assert not _sum(points, curve, 30, own=0).any()
    shifts = np.array([[-2.0, 0.0, 0.0], [0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    images = (np.array([2.0, 0.0, 0.0]), shifts, np.zeros((3, 0)))
    expected = [
        sum(
            by_parts(p + shift, curve(s).T, curve(s, 1).T, _force(s).T, 1.0 / 30, WEIGHT)
            for shift in shifts[[0, 2]]
        )
        for p in points
    ]
    assert_close(_sum(points, curve, 30, images=images, own=0), expected, rtol=1e-12)


@pytest.mark.parametrize("own", [-1, 0, 1])
def test_sum_of_forces_per_length_equals_the_slow_twin_with_its_images(own):
    """Two sources of other radii, near enough that the doublets count; the nearest image first."""
    rng = np.random.default_rng(5)
    x, force = rng.normal(size=(2, 3, 5)), rng.normal(size=(2, 3, 5))
    x[1] += np.array([[4.0], [0.0], [0.0]])
    weights, weight = rng.uniform(0.1, 0.3, size=(2, 5)), np.array([0.02, 0.05])
    points = x[own, :, :2].T + 1e-2 if own >= 0 else np.array([[0.3, 0.5, 0.2], [0.1, 0.1, -0.4]])
    middle = points.mean(axis=0)
    periods, shifts = np.array([2.5, 0.0, 0.0]), np.array([[0.0, 0, 0], [-2.5, 0, 0], [2.5, 0, 0]])
    expected = np.zeros((2, 3))
    for k in range(2):
        nearest = -2.5 * np.round((middle[0] - x[k, 0, 2]) / 2.5)
        for shift in shifts[:, 0] + nearest:
            if k == own and shift == 0.0:
                continue
            for i, j in np.ndindex(2, 5):
                r = points[i] + np.array([shift, 0.0, 0.0]) - x[k, :, j]
                found = stokeslet(r, force[k, :, j]) + weight[k] * doublet(r, force[k, :, j])
                expected[i] += weights[k, j] * found
    sums = forces.forces_velocity(points, middle, own, x, force, weights, weight, periods, shifts)
    assert_close(sums, expected, rtol=1e-12)


def test_line_integral_off_a_fiber_equals_the_slow_twin():
    """Next to the fiber, where the doublet is as large as the Stokeslet; f is linear in between."""
    curve, count, weight = helical_curve(), 40, 2e-3
    s = np.linspace(0.0, 1.0, count + 1)
    values = _force(s, 1)
    side = np.cross(curve(0.43, 1), [0.3, -0.2, 1.0])
    points = np.array([curve(0.43) + 0.06 * side / np.linalg.norm(side), [0.5, 0.7, -0.6]])
    z, w = np.polynomial.legendre.leggauss(6)
    found = lines.line_velocity(
        points,
        np.ascontiguousarray(curve(s)),
        np.ascontiguousarray(curve(s, 1)),
        values,
        1.0 / count,
        weight,
        0.5 * (z + 1.0),
        0.5 * w,
        64,
    )

    def force(at):
        return np.stack([np.interp(at, s, row) for row in values])

    expected = [plain(p, curve, force, weight, 10 * count) for p in points]
    without = plain(points[0], curve, force, 0.0, 10 * count)
    assert np.abs(without - expected[0]).max() > 0.2 * np.abs(expected[0]).max()
    assert_close(found, expected, rtol=1e-5)
