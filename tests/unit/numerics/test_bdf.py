"""Difference formulas on uneven points, their error estimates, and the control of steps."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.numerics import bdf
from stokesfibers.numerics.step_control import AdaptiveSteps, FixedSteps
from support import assert_close

OFFSETS = [0.1, 0.22, 0.31, 0.45, 0.52, 0.68]
orders = pytest.mark.parametrize("order", range(1, 6))


def _derivative(order: int, new: float, old) -> float:
    weights = bdf.derivative_weights(order, OFFSETS)
    return bdf.leading_coefficient(order, OFFSETS) * new + float(np.dot(weights, old[:order]))


@orders
def test_formula_is_exact_to_its_order_and_no_further(order):
    old = -np.array(OFFSETS)
    for degree in range(order + 1):
        expected = 1.0 if degree == 1 else 0.0
        found = _derivative(order, 1.0 if degree == 0 else 0.0, old**degree)
        assert found == pytest.approx(expected, abs=1e-12)
    beyond = _derivative(order, 0.0, old ** (order + 1))
    # At 0 the slope of t^(k+1) minus its interpolant is the product of the offsets.
    assert beyond == pytest.approx(-np.prod(OFFSETS[:order]))


@pytest.mark.parametrize("order", range(1, 6))
def test_even_points_give_the_classical_formulas(order):
    leading = (1.0, 3 / 2, 11 / 6, 25 / 12, 137 / 60)[order - 1]
    even = [float(i + 1) for i in range(order)]
    assert bdf.leading_coefficient(order, even) == pytest.approx(leading, rel=1e-14)
    if order == 2:
        assert_close(bdf.derivative_weights(2, even), [-2.0, 0.5], rtol=1e-14)


def test_extrapolations_are_lagrange_weights():
    rows = bdf.extrapolations(OFFSETS)
    for degree, row in enumerate(rows):
        assert_close(row, bdf.value_weights(OFFSETS[: degree + 1]), rtol=1e-12)
        assert np.dot(row, (-np.array(OFFSETS[: degree + 1])) ** degree) == pytest.approx(
            1.0 if degree == 0 else 0.0, abs=1e-12
        )


def test_interpolation_passes_through_a_polynomial():
    old = -np.array(OFFSETS)
    weights = bdf.value_weights(OFFSETS, at=0.17)
    assert np.dot(weights, old**5) == pytest.approx((-0.17) ** 5, rel=1e-10)


@orders
def test_rate_of_the_prediction(order):
    rng = np.random.default_rng(order)
    old = rng.normal(size=len(OFFSETS))
    predictors = bdf.extrapolations(OFFSETS)
    rate = bdf.predicted_rate_weights(order, OFFSETS, predictors)
    predicted = np.dot(predictors[order], old[: order + 1])
    expected = _derivative(order, predicted, old)
    assert np.dot(rate, old[: order + 1]) == pytest.approx(expected, rel=1e-11)


@orders
def test_error_estimate_is_the_local_error(order):
    """For x = exp(t), x_t given: the formula's error against the estimate from the prediction."""
    scale = 0.02 if order < 5 else 0.1
    offsets = [scale * o for o in OFFSETS]
    old = np.exp(-np.array(offsets))
    alpha = bdf.leading_coefficient(order, offsets)
    known = np.dot(bdf.derivative_weights(order, offsets), old[:order])
    new = (1.0 - known) / alpha  # the formula with the exact derivative at the new point
    local = new - 1.0
    predicted = np.dot(bdf.extrapolations(offsets)[order], old[: order + 1])
    estimate = bdf.error_factor(order, offsets) * (new - predicted)
    assert estimate == pytest.approx(local, rel=0.02, abs=1e-16)


def test_a_step_that_errs_too_much_is_repeated_shorter():
    control = AdaptiveSteps(rtol=1e-4)
    verdict = control.judge({3: 5.0, 4: 30.0}, 0.1, 4, 9)
    assert not verdict.accepted
    assert verdict.order == 4
    assert verdict.size == pytest.approx(0.1 * 0.8 * 30.0 ** (-1 / 5))
    failed = control.judge({4: float("inf")}, 0.1, 4, 9)
    assert (failed.accepted, failed.size) == (False, 0.025)
    assert not control.judge({4: float("nan")}, 0.1, 4, 9).accepted


def test_steps_grow_within_what_the_order_stands():
    control = AdaptiveSteps(rtol=1e-4)
    for order, growth in ((4, 1.25), (5, 1.12)):
        verdict = control.judge({order: 1e-9}, 0.1, order, 0)
        assert verdict.accepted
        assert verdict.size == pytest.approx(0.1 * growth)


def test_the_order_follows_the_longest_step_once_settled():
    control = AdaptiveSteps(rtol=1e-4)
    errors = {2: 0.5, 3: 0.4, 4: 1e-3}
    assert control.judge(errors, 0.1, 3, 2).order == 3
    assert control.judge(errors, 0.1, 3, 3).order == 4
    assert control.judge({2: 1e-3, 3: 0.9, 4: 0.99}, 0.1, 3, 5).order == 2
    assert control.orders(1, 2) == (1,)
    assert control.orders(4, 7) == (3, 4, 5)
    assert control.orders(5, 7) == (4, 5)
    assert AdaptiveSteps(1e-4, highest_order=3).orders(3, 7) == (2, 3)


def test_the_higher_order_is_taken_where_growth_is_what_limits_both():
    """Steps of both could be longer than any order's growth lets them: only the order counts."""
    control = AdaptiveSteps(rtol=1e-4)
    errors = {q: (0.8 / ratio) ** (q + 1) for q, ratio in ((3, 3.0), (4, 3.1))}
    assert control.judge(errors, 0.1, 3, 3).order == 4, "though its step is hardly longer"
    errors = {q: (0.8 / ratio) ** (q + 1) for q, ratio in ((3, 1.5), (4, 1.55))}
    assert control.judge(errors, 0.1, 3, 3).order == 3


def test_what_a_step_may_commit_makes_errors_follow_the_tolerance_at_order_five():
    """h^6 errs by the allowance, h^5 is what adds up over the run: in proportion to rtol."""
    coarse, fine = (AdaptiveSteps(rtol=r).step_tolerance for r in (1e-3, 1e-6))
    steps = (fine / coarse) ** (1.0 / 6.0)
    assert steps**5 == pytest.approx(1e-3)


def test_the_first_step_is_shorter_where_things_change_faster():
    control = AdaptiveSteps(rtol=1e-4)
    assert control.first(4.0) == pytest.approx(0.25 * control.first(1.0))


def test_fixed_steps_start_short_and_reach_order_and_length():
    control = FixedSteps(dt=0.02, order=5)
    size, order, sizes = control.first(1.0), 1, []
    for known in range(1, 120):
        errors = dict.fromkeys(control.orders(order, known), 0.3)
        verdict = control.judge(errors, size, order, 0)
        assert verdict.accepted
        sizes.append(size)
        size, order = verdict.size, verdict.order
    assert (size, order) == (0.02, 5)
    assert max(np.diff(np.log(sizes))) < np.log(1.1201)


@pytest.mark.parametrize(
    ("make", "where"),
    [
        (lambda: AdaptiveSteps(rtol=0.0), "rtol"),
        (lambda: AdaptiveSteps(rtol=0.5), "rtol"),
        (lambda: AdaptiveSteps(highest_order=6), "highest_order"),
        (lambda: FixedSteps(dt=-1.0), "dt"),
        (lambda: FixedSteps(dt=0.1, order=0), "order"),
    ],
)
def test_bad_controls_are_refused(make, where):
    with pytest.raises(InputError) as caught:
        make()
    assert caught.value.where == where
