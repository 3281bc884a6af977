"""Chebyshev points: quadrature and interpolation of polynomials, and of what is analytic."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.numerics.chebyshev import ChebyshevGrid
from support import assert_close


@pytest.mark.parametrize("intervals", [2, 8, 16])
def test_polynomials_up_to_the_degree_are_exact(intervals):
    grid = ChebyshevGrid(2.5, intervals)
    assert grid.nodes[0] == 0.0
    assert grid.nodes[-1] == pytest.approx(2.5, rel=1e-15)
    s = np.linspace(0.0, 2.5, 31)
    for degree in range(intervals + 1):
        values = (grid.nodes / 2.5) ** degree
        assert grid.weights @ values == pytest.approx(2.5 / (degree + 1), rel=1e-13)
        assert_close(grid.interpolate(values, s), (s / 2.5) ** degree, atol=1e-13)


def test_weights_are_positive_and_quadrature_converges_spectrally():
    errors = []
    for intervals in (8, 16, 32):
        grid = ChebyshevGrid(1.0, intervals)
        assert grid.weights.min() > 0.0
        errors.append(abs(grid.weights @ np.exp(3.0 * grid.nodes) - (np.exp(3.0) - 1.0) / 3.0))
    assert errors[0] < 1e-5
    assert errors[1] < 1e-13
    assert errors[2] < 1e-13


def test_interpolation_at_nodes_is_exact_and_keeps_trailing_axes():
    grid = ChebyshevGrid(0.7, 10)
    values = np.random.default_rng(1).normal(size=(11, 3))
    found = grid.interpolate(values, np.array([grid.nodes[4], 0.2, grid.nodes[10]]))
    assert found.shape == (3, 3)
    assert np.array_equal(found[[0, 2]], values[[4, 10]])
