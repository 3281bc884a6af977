"""The toolbox of the figures: the straight filament, norms and orders, bisection."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp, trapezoid

from stokesfibers.experiments import convergence, straight
from stokesfibers.experiments.stable_dt import largest
from stokesfibers.experiments.tiers import FULL, QUICK
from stokesfibers.fiber.curves import PAPER_ANGLE
from support import assert_close

MU_BAR, EPS = 3e5, 1e-3


def test_angle_solves_45():
    start = straight.angle(np.array(0.0), 4.0)
    solved = solve_ivp(lambda _, a: -(np.sin(a) ** 2), (0.0, 9.0), [start], rtol=1e-11, atol=1e-13)
    assert_close(solved.y[0, -1], straight.angle(np.array(9.0), 4.0), rtol=1e-9)


def test_initial_angle_of_the_full_tier_is_the_papers():
    assert_close(FULL.angle, PAPER_ANGLE, rtol=1e-14)
    assert_close(FULL.angle / np.pi, 0.9936, atol=5e-5)


@pytest.mark.parametrize("theta", [0.3, 1.2, 2.0, 2.9])
def test_stress_of_the_straight_filament_is_the_integral_of_its_tension(theta):
    amplitude = straight.tension_amplitude(np.array(theta), MU_BAR, EPS)
    total = quad(lambda s: float(amplitude) * s * (1.0 - s), 0.0, 1.0)[0]
    p = np.array([np.cos(theta), np.sin(theta)])
    sigma = total * np.outer(p, p)
    found = straight.normal_stress_difference(np.array(theta), MU_BAR, EPS)
    assert_close(found, sigma[0, 0] - sigma[1, 1], rtol=1e-12)
    found = straight.shear_stress(np.array(theta), MU_BAR, EPS)
    assert_close(found, sigma[0, 1], rtol=1e-12)


def test_tension_is_negative_under_compression_and_positive_under_extension():
    assert straight.tension_amplitude(np.array(0.75 * np.pi), MU_BAR, EPS) < -1e3
    assert straight.tension_amplitude(np.array(0.25 * np.pi), MU_BAR, EPS) > 1e3


def _curve(intervals: int, error: float) -> np.ndarray:
    s = np.linspace(0.0, 1.0, intervals + 1)
    shape = np.stack([s, np.sin(3.0 * s), 0.0 * s], axis=1)
    return shape + error / intervals**2 * np.stack([np.cos(5.0 * s), s, s**2], axis=1)


def test_order_of_a_second_order_error_is_two():
    solutions = [_curve(n, 1.0) for n in (10, 20, 40)]
    assert_close(convergence.order(solutions), 2.0, rtol=1e-10)
    assert_close(convergence.order_by_pairs(solutions), 2.0, rtol=0.02)


def test_distance_is_the_mean_over_the_coarse_nodes():
    coarse, fine = np.zeros((3, 3)), np.zeros((5, 3))
    fine[:, 1] = [1.0, 100.0, 2.0, 100.0, 6.0]
    assert convergence.distance(coarse, fine) == pytest.approx(3.0)


def test_distance_refuses_grids_that_do_not_nest():
    with pytest.raises(ValueError, match="nodes of the coarse"):
        convergence.distance(np.zeros((5, 3)), np.zeros((7, 3)))


def test_centred_points_have_their_trapezoidal_mean_at_the_origin():
    points = convergence.centred(_curve(10, 0.0) + np.array([3.0, -2.0, 1.0]))
    mean = trapezoid(points, dx=0.1, axis=0)
    assert np.abs(mean).max() < 1e-14
    assert np.abs(points).max() > 0.4


def test_extrapolated_value_is_exact_for_an_error_in_h_squared():
    assert convergence.extrapolated(5.0 + 0.4, 5.0 + 0.1) == pytest.approx(5.0, rel=1e-14)


@pytest.mark.parametrize("guess", [1e-3, 0.0314, 0.7])
def test_bisection_finds_the_limit_from_either_side(guess):
    tried = []

    def stable(dt: float) -> bool:
        tried.append(dt)
        return dt < 1.0 / 30.0

    found = largest(stable, guess, 0.01)
    assert found < 1.0 / 30.0 <= found * 1.0101
    assert len(tried) < 40


def test_bisection_gives_up_where_nothing_is_stable():
    assert np.isnan(largest(lambda dt: False, 0.1, 0.01))  # noqa: ARG005


@pytest.mark.parametrize("chosen", [FULL, QUICK], ids=["full", "quick"])
def test_all_steps_divide_the_frame_and_the_window_is_symmetric(chosen):
    for n in chosen.levels:
        assert (0.512 * n / chosen.step_ratio) % 1.0 == pytest.approx(0.0, abs=1e-9)
    assert chosen.at(chosen.last_frame) == pytest.approx(chosen.until)
    assert 2.0 * chosen.vertical - chosen.until >= -1e-9
