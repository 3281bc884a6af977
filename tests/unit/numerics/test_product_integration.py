"""Moments of the shape-free kernel against quadrature, and the weights built of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss

from stokesfibers.numerics.product_integration import (
    DEGREE,
    finite_part_weights,
    kernel_integral,
    kernel_moments,
    no_finite_part,
)
from support import assert_close, assert_negligible

POWERS = np.arange(DEGREE + 1)


def graded_panels(a: float, d: float) -> np.ndarray:
    """Return edges of panels on [0, 1], graded towards a down to a quarter of d."""
    cuts, step = [0.0, 1.0, a], 0.25 * max(d, 1e-12)
    while step < 2.0:
        cuts += [a - step, a + step]
        step *= 1.5
    return np.unique(np.clip(cuts, 0.0, 1.0))


def reference_moments(a: float, d: float) -> np.ndarray:
    """Return the moments by Gauss-Legendre panels in extended precision, d > 0 or a outside."""
    y, w = leggauss(24)
    edges = graded_panels(a, d).astype(np.longdouble)
    half = 0.5 * np.diff(edges)[:, None]
    xi = edges[:-1, None] + half * (y.astype(np.longdouble) + 1)
    kernel = half * w / np.sqrt((xi - np.longdouble(a)) ** 2 + np.longdouble(d) ** 2)
    return np.array([float(np.sum(kernel * xi**p)) for p in POWERS])


def finite_part_reference(a: float) -> np.ndarray:
    """Return the finite parts: subtract a^p, whose finite part is a^p log(a (1 - a))."""
    y, w = leggauss(8)
    out = np.zeros(DEGREE + 1)
    log = sum(np.log(part) for part in (a, 1.0 - a) if part > 0.0)
    for p in POWERS:
        for low, high in ((0.0, a), (a, 1.0)):
            xi = low + 0.5 * (high - low) * (y + 1.0)
            # (xi^p - a^p) / |xi - a| is a polynomial on either side
            quotient = sum((xi**k * a ** (p - 1 - k) for k in range(p)), np.zeros_like(xi))
            out[p] += np.sign(low - a + 0.5 * (high - low)) * 0.5 * (high - low) * (w @ quotient)
        out[p] += a**p * log
    return out


@settings(max_examples=300)
@given(
    st.one_of(st.floats(-3.0, 4.0), st.integers(-200, 200), st.just(0.5), st.floats(-1e3, 1e3)),
    st.floats(-8.0, 3.0).map(lambda e: 10.0**e),
)
def test_moments_are_the_integrals(a, d):
    found = kernel_moments(np.array(float(a)), np.array(d))
    expected = reference_moments(float(a), d)
    assert (np.abs(found - expected) <= 1e-12 * np.abs(expected)).all(), (found, expected)


@pytest.mark.parametrize("place", [2.4999, 2.5, 2.5001, -1.4999, -1.5001])
@pytest.mark.parametrize("d", [0.0, 1e-8, 1e-3, 0.3, 1.9999, 2.0001])
def test_both_sides_of_the_change_from_closed_form_to_quadrature(place, d):
    found = kernel_moments(np.array(place), np.array(d))
    assert_close(found / reference_moments(place, d), np.ones(DEGREE + 1), rtol=1e-12)


@pytest.mark.parametrize("a", [0.0, 1.0, 0.5, 0.25, 1e-3, 0.987])
def test_finite_parts_without_regularisation(a):
    found = kernel_moments(np.array(a), np.array(0.0))
    assert_close(found, finite_part_reference(a), rtol=1e-13)


@settings(max_examples=50)
@given(st.floats(0.05, 0.95))
def test_finite_part_is_the_limit_without_the_divergent_logarithm(a):
    """m_p(a, d) = finite part + a^p log(4 / d^2) + O(d^2 log d)."""
    d = 1e-6
    limit = kernel_moments(np.array(a), np.array(d)) - a**POWERS * np.log(4.0 / d**2)
    assert_close(limit, kernel_moments(np.array(a), np.array(0.0)), rtol=1e-8)


def test_moments_keep_the_shape_of_their_arguments():
    a = np.linspace(-3.0, 3.0, 6).reshape(2, 3)
    found = kernel_moments(a, np.array(0.1))
    assert found.shape == (2, 3, DEGREE + 1)
    assert_close(found[1, 2], kernel_moments(np.array(3.0), np.array(0.1)), rtol=1e-15)


@pytest.fixture(scope="module")
def delta() -> tuple[np.ndarray, np.ndarray]:
    n = 24

    def profile(s):
        return 0.02 + 0.03 * np.sin(np.pi * s)

    return profile(np.linspace(0.0, 1.0, n + 1)), profile((np.arange(n) + 0.5) / n)


def test_sums_of_moments_are_the_integral_35(delta):
    w = finite_part_weights(*delta)
    s, half = np.linspace(0.0, 1.0, 25), (np.arange(24) + 0.5) / 24
    for found, place, d in ((w.phi, s, delta[0]), (w.phi_half, half, delta[1])):
        printed = np.log(
            (1.0 - place + np.hypot(1.0 - place, d)) * (place + np.hypot(place, d)) / d**2
        )
        assert_close(found, printed, rtol=1e-13)
        assert_close(kernel_integral(place, d), printed, rtol=1e-13)
    assert_close(w.hat.sum(axis=1), w.phi, rtol=1e-14)
    # (hat_k + hat_{k+1})^2 = 1 on each interval
    total = w.hat_square.sum(axis=1) + 2.0 * w.hat_product.sum(axis=1)
    assert_close(total, w.phi, rtol=1e-14)
    assert_close(w.moments_half[:, 0].sum(axis=1), w.phi_half, rtol=1e-14)
    middle = np.log((0.5 + np.hypot(0.5, 0.05)) ** 2 / 0.05**2)
    assert w.phi_0 == pytest.approx(middle, rel=1e-14)


def test_weights_are_integrals_of_hat_functions(delta):
    """Against quadrature of the hats themselves, at a node near the end and one inside."""
    w = finite_part_weights(*delta)
    n = 24
    y, g = leggauss(20)
    for i in (1, 13):
        edges = np.concatenate([j + graded_panels(i - j, delta[0][i] * n) for j in range(n)])
        edges = np.unique(edges)
        half = 0.5 * np.diff(edges)[:, None]
        at = (edges[:-1, None] + half * (y + 1.0)).ravel()
        kernel = (half * g).ravel() / np.hypot(at - i, delta[0][i] * n)
        hats = np.maximum(0.0, 1.0 - np.abs(at - np.arange(n + 1)[:, None]))
        assert_close(w.hat[i], hats @ kernel, rtol=1e-12)
        assert_close(w.hat_square[i], hats**2 @ kernel, rtol=1e-12)
        assert_close(w.hat_product[i, :-1], (hats[:-1] * hats[1:]) @ kernel, rtol=1e-12)
        assert w.hat_product[i, -1] == 0.0


def test_unregularised_weights_have_no_divergent_part():
    w = finite_part_weights(np.zeros(11), np.zeros(10))
    assert w.phi_0 == 0.0
    s = np.linspace(0.0, 1.0, 11)
    # Legendre's P_1 is an eigenfunction: S[P_1] = -2 P_1, exactly for linear functions.
    p1 = 2.0 * s - 1.0
    assert_close(w.hat @ p1 - w.phi * p1, -2.0 * p1, rtol=1e-13)
    assert_negligible(w.hat @ np.ones(11) - w.phi, scale=float(np.abs(w.phi).max()), rtol=1e-13)


def test_no_finite_part_is_nothing():
    w = no_finite_part(10)
    assert w.hat.shape == (11, 11)
    assert w.moments_half.shape == (10, DEGREE + 1, 10)
    for values in (w.hat, w.hat_square, w.hat_product, w.phi, w.moments_half, w.phi_half):
        assert not values.any()
