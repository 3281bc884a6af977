"""Legendre modes of a fiber with free ends: end conditions, derivatives and fits to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Legendre

from stokesfibers.core.errors import InputError
from stokesfibers.numerics.legendre import (
    FreeEndBasis,
    gauss_legendre,
    integrated,
    legendre_values,
)
from support import assert_close, assert_negligible, free_end_curve, helical_curve

counts = pytest.mark.parametrize("count", [6, 17, 32, 128])


def test_values_are_legendre_polynomials():
    sigma = np.linspace(0.0, 1.0, 23)
    found = legendre_values(sigma, 12)
    expected = np.stack([Legendre.basis(k, domain=[0, 1])(sigma) for k in range(12)], axis=-1)
    assert_close(found, expected, rtol=1e-14)


@counts
def test_gauss_legendre_integrates_to_its_degree_and_is_symmetric(count):
    nodes, weights = gauss_legendre(count)
    values = legendre_values(nodes, 2 * count)
    assert_negligible(weights @ values[:, 1:], scale=1.0, rtol=1e-13)
    assert weights.sum() == pytest.approx(1.0, rel=1e-14)
    assert_close(nodes + nodes[::-1], np.ones(count), rtol=1e-15)
    assert_close(weights, weights[::-1])


def test_antiderivative_of_a_series():
    rng = np.random.default_rng(1)
    series = rng.normal(size=(9, 1))
    found = Legendre(integrated(series)[:, 0], domain=[0, 1])
    assert_close(found.deriv().coef, series[:, 0], rtol=1e-13)
    series[0] = 0.0
    ends = Legendre(integrated(series)[:, 0], domain=[0, 1])(np.array([0.0, 1.0]))
    assert_negligible(ends, scale=1.0, rtol=1e-14)


@counts
def test_modes_satisfy_the_conditions_of_free_ends(count):
    basis = FreeEndBasis(count)
    ends = np.array([0.0, 1.0])
    inside = np.linspace(0.0, 1.0, 301)
    for order in (2, 3):
        scale = np.abs(basis.positions(inside, order)).max(axis=0)
        scale[:2] = 1.0
        assert_negligible(basis.positions(ends, order) / scale, scale=1.0, rtol=3e-12)
    tension = basis.tensions(inside)
    relative = basis.tensions(ends) / np.abs(tension).max(axis=0)
    assert_negligible(relative, scale=1.0, rtol=1e-12)


@counts
def test_each_table_is_the_derivative_of_the_one_before(count):
    basis = FreeEndBasis(count)
    nodes, weights = gauss_legendre(count + 4)
    for at in (0.07, 0.5, 1.0):
        for order in range(4):
            rise = basis.positions(np.array([0.0, at]), order)
            slope = at * weights @ basis.positions(at * nodes, order + 1)
            largest = np.abs(basis.positions(nodes, order)).max(axis=0)
            largest[:2] = 1.0  # their higher derivatives vanish
            assert_negligible((rise[1] - rise[0] - slope) / largest, scale=1.0, rtol=3e-11)
        rise = basis.tensions(np.array([0.0, at]))
        slope = at * weights @ basis.tensions(at * nodes, 1)
        assert_negligible(rise[1] - rise[0] - slope, scale=0.25, rtol=1e-13)


def test_fourth_derivatives_are_legendre_polynomials_and_the_first_two_modes_rigid():
    basis = FreeEndBasis(11)
    s = np.linspace(0.0, 1.0, 7)
    fourth = basis.positions(s, 4)
    assert_close(fourth[:, 2:], legendre_values(s, 11)[:, 2:], rtol=1e-15)
    assert_close(basis.positions(s)[:, :2], np.stack([s**0, s - 0.5], axis=-1), rtol=1e-15)
    assert_close(basis.tensions(s, 1), legendre_values(s, 11)[:, 1:], rtol=1e-15)


@pytest.mark.parametrize(("count", "allowed"), [(24, 1e-10), (40, 1e-13), (128, 1e-13)])
def test_a_free_fiber_is_fitted_spectrally(count, allowed):
    curve = free_end_curve()
    basis = FreeEndBasis(count)
    sigma, weight = gauss_legendre(2 * count)
    modes = basis.fit(curve(sigma).T, sigma, weight)
    anywhere = np.linspace(0.0, 1.0, 113)
    assert_close((basis.positions(anywhere) @ modes).T, curve(anywhere), rtol=allowed)
    slope = (basis.positions(anywhere, 1) @ modes).T
    assert_close(slope, curve(anywhere, 1), rtol=100.0 * allowed)


def test_a_curve_that_is_bent_at_its_ends_is_not_fitted_to_rounding():
    curve = helical_curve()
    basis = FreeEndBasis(40)
    sigma, weight = gauss_legendre(80)
    modes = basis.fit(curve(sigma).T, sigma, weight)
    error = np.abs((basis.positions(sigma) @ modes).T - curve(sigma)).max()
    assert 1e-8 < error < 1e-3


def test_rounding_of_a_straight_fiber_does_not_bend_it():
    basis = FreeEndBasis(64)
    sigma, weight = gauss_legendre(128)
    modes = basis.fit(np.outer(sigma, [0.6, 0.8, 0.0]), sigma, weight)
    assert_close(modes[0], [0.3, 0.4, 0.0], rtol=1e-13)
    bend = basis.positions(sigma, 1)[:, 2:] @ modes[2:]
    assert_negligible(bend, scale=1.0, rtol=3e-12)


def test_too_few_nodes_are_refused():
    with pytest.raises(InputError, match="nodes: expected a whole number, 6 or more"):
        FreeEndBasis(5)
