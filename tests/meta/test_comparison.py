"""The tests' own comparisons can fail, and refuse tolerances with which they could not."""

from __future__ import annotations

import numpy as np
import pytest

from support import assert_close, assert_negligible, assert_order, observed_orders

EXPECTED = np.array([1.0, -2.0, 0.0])


def test_close_is_two_sided():
    for sign in (1.0, -1.0):
        assert_close(EXPECTED + sign * 1.9e-6, EXPECTED, rtol=1e-6)
        with pytest.raises(AssertionError, match="largest difference"):
            assert_close(EXPECTED + sign * 2.1e-6, EXPECTED, rtol=1e-6)
        with pytest.raises(AssertionError, match="largest difference"):
            assert_close(EXPECTED + sign * 2.1e-6, EXPECTED, atol=2e-6)
    assert_close(EXPECTED, EXPECTED)
    with pytest.raises(AssertionError):
        assert_close(np.nextafter(EXPECTED, 9.0), EXPECTED)
    with pytest.raises(AssertionError):
        assert_close(-EXPECTED, EXPECTED, rtol=0.9)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_close_refuses_what_is_not_finite(bad):
    broken = np.array([1.0, bad, 0.0])
    for pair in ((broken, EXPECTED), (EXPECTED, broken), (broken, broken)):
        with pytest.raises(AssertionError, match="not finite"):
            assert_close(*pair, rtol=1e-3)


@pytest.mark.parametrize(
    "tolerances",
    [{"atol": 2.0}, {"atol": 1e9}, {"rtol": 1.0}, {"rtol": 0.5, "atol": 1.0}, {"atol": np.inf}],
)
def test_close_refuses_vacuous_tolerances(tolerances):
    with pytest.raises(ValueError, match="vacuous"):
        assert_close(EXPECTED, EXPECTED, **tolerances)
    with pytest.raises(ValueError, match="vacuous"):
        assert_close(np.zeros(3), np.zeros(3), atol=1e-9)


@pytest.mark.parametrize("tolerances", [{"atol": -1.0}, {"rtol": np.nan}])
def test_close_refuses_senseless_tolerances(tolerances):
    with pytest.raises(ValueError, match="zero or more"):
        assert_close(EXPECTED, EXPECTED, **tolerances)


def test_close_compares_shapes():
    with pytest.raises(AssertionError, match="shapes"):
        assert_close(EXPECTED, 1.0, rtol=0.1)
    with pytest.raises(AssertionError, match="nothing"):
        assert_close(np.empty(0), np.empty(0))


def test_negligible_needs_a_scale():
    assert_negligible(1e-12, scale=1.0, rtol=1e-11)
    with pytest.raises(AssertionError):
        assert_negligible([0.0, -1e-10], scale=1.0, rtol=1e-11)
    with pytest.raises(AssertionError, match="finite"):
        assert_negligible(np.nan, scale=1.0, rtol=1e-11)
    for senseless in ({"scale": 0.0, "rtol": 1e-9}, {"scale": 1.0, "rtol": 0.1}):
        with pytest.raises(ValueError, match="vacuous"):
            assert_negligible(0.0, **senseless)


def test_orders():
    assert_close(observed_orders([16.0, 4.0, 1.0]), np.array([2.0, 2.0]))
    assert_order([1.6, 0.4, 0.1], between=(1.9, 2.1), final=0.2)
    for errors, final in (([1.6, 0.4, 0.2], 0.3), ([1.6, 0.4, 0.1], 0.09)):
        with pytest.raises(AssertionError):
            assert_order(errors, between=(1.9, 2.1), final=final)
    with pytest.raises(AssertionError, match="finite"):
        observed_orders([1.0, np.nan])
    with pytest.raises(AssertionError, match="vanish"):
        observed_orders([1.0, 0.0])
    with pytest.raises(ValueError, match="too wide"):
        assert_order([1.6, 0.4, 0.1], between=(1.9, 2.1), final=0.5)
