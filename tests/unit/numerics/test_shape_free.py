"""Shape-free weights against adaptive quadrature, the spectrum of (B.5), and their series."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from stokesfibers.numerics.legendre import gauss_legendre, legendre_values
from stokesfibers.numerics.shape_free import (
    binomials,
    no_weights,
    shape_free_weights,
    terms_needed,
)
from support import assert_close, assert_negligible


def _smooth(s):
    return np.cos(3.0 * s) + s**5


@pytest.mark.parametrize("eps", [3e-2, 1e-3, 1e-5])
@pytest.mark.parametrize("count", [16, 40])
def test_weights_integrate_smooth_functions(count, eps):
    nodes, _ = gauss_legendre(count)
    delta = 4.0 * eps * np.sqrt(nodes * (1.0 - nodes) + 4.0 * eps**2)
    weights = shape_free_weights(delta)
    found = np.stack([weights.finite, *weights.corrections]) @ _smooth(nodes)
    for i in range(0, count, 3):
        s, d = nodes[i], delta[i]
        low, high = -np.arcsinh(s / d), np.arcsinh((1.0 - s) / d)

        def integrand(t, n, s=s, d=d):
            own = _smooth(s) if n == 0 else 0.0
            return (_smooth(s + d * np.sinh(t)) - own) * np.tanh(t) ** (2 * n)

        for n, factor in enumerate(binomials(len(weights.corrections))):
            exact = quad(integrand, low, high, args=(n,), epsabs=1e-13, epsrel=1e-12, limit=200)[0]
            assert found[n, i] == pytest.approx(factor * d ** (2 * n) * exact, rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("count", [32, 128])
def test_without_regularisation_legendre_polynomials_are_eigenfunctions(count):
    nodes, _ = gauss_legendre(count)
    finite = shape_free_weights(np.zeros(count)).finite
    harmonic = np.concatenate([[0.0], np.cumsum(1.0 / np.arange(1, count))])
    values = legendre_values(nodes, count)
    assert_close(finite @ values, -2.0 * harmonic * values, rtol=1e-12)


@pytest.mark.parametrize("count", [32, 128])
def test_small_delta_approaches_no_delta(count):
    nodes, _ = gauss_legendre(count)
    bare = shape_free_weights(np.zeros(count)).finite
    small = shape_free_weights(np.full(count, 1e-9)).finite
    assert_close(small @ _smooth(nodes), bare @ _smooth(nodes), rtol=1e-7)


@pytest.mark.parametrize("count", [24, 96])
@pytest.mark.parametrize("delta", [0.0, 1e-3, 0.1])
def test_constants_have_no_finite_part(count, delta):
    weights = shape_free_weights(np.full(count, delta))
    assert_negligible(weights.finite @ np.ones(count), scale=10.0, rtol=1e-13)


def test_the_series_is_the_kernel_of_a_bent_fiber():
    """Summed for constant h, the series is the kernel with |R|^2 = u^2 q, q = 1 / (1 + h u^2)."""
    count, delta, h = 64, 0.02, 30.0
    nodes, _ = gauss_legendre(count)
    weights = shape_free_weights(np.full(count, delta))
    terms = len(weights.corrections)
    factors = h ** np.arange(1, terms + 1)
    row = weights.finite + np.tensordot(factors, weights.corrections, 1)
    i = count // 3
    s = nodes[i]

    def kernel(x):
        u2 = (s - x) ** 2
        q = 1.0 / (1.0 + h * u2)
        return np.sqrt(q) / np.sqrt(u2 * q + delta**2) * _smooth(x)

    def plain(x):
        return _smooth(s) / np.hypot(s - x, delta)

    exact = quad(lambda x: kernel(x) - plain(x), 0, 1, points=[s], epsabs=1e-13, limit=300)[0]
    assert abs(row[i] @ _smooth(nodes) - exact) < 1e-11
    assert weights.remainder(delta**2 * h) < 1e-12
    without = abs(weights.finite[i] @ _smooth(nodes) - exact)
    assert without > 1e-3, "the corrections must matter here"


def test_the_local_model_has_no_weights():
    weights = no_weights(8)
    assert weights.nodes == 8
    assert not weights.finite.any()
    assert not weights.corrections.any()
    assert weights.corrections.shape == (2, 8, 8)


def test_thicker_fibers_keep_more_terms_and_the_remainder_is_the_first_left_out():
    assert [terms_needed(d) for d in (2e-5, 2e-3, 2e-2, 0.2)] == [2, 4, 10, 10]
    weights = shape_free_weights(np.full(12, 2e-3))
    z = 0.3
    kept = binomials(4) @ z ** np.arange(5)
    assert (
        abs((1.0 + z) ** -0.5 - kept) < weights.remainder(z) < 4.0 * abs((1.0 + z) ** -0.5 - kept)
    )
    assert weights.remainder(1.5) == float("inf")
