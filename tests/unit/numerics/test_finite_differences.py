"""The stencils of Appendix A: exact on polynomials of their degree, second order, mirrored."""

from __future__ import annotations

import numpy as np
import pytest

from reference import twins
from stokesfibers.numerics.finite_differences import UniformGrid, difference_matrix
from support import assert_close, assert_negligible, assert_order

orders = pytest.mark.parametrize("order", [1, 2, 3, 4])


@orders
@pytest.mark.parametrize("intervals", [8, 11, 40])
def test_stencils_are_those_of_appendix_a(order, intervals):
    found = difference_matrix(order, intervals, 1.0 / intervals)
    assert_close(found, twins.differences(order, intervals), rtol=1e-15)


@orders
def test_polynomials_up_to_degree_order_plus_one_are_differentiated_exactly(order):
    """Error O(h^2) means exact for degree p + 1; no row is more accurate by accident of a typo."""
    intervals, length = 12, 3.0
    d = difference_matrix(order, intervals, length / intervals)
    s = np.linspace(0.0, length, intervals + 1)
    for degree in range(order + 2):
        p = np.polynomial.Polynomial.basis(degree)
        size = np.abs(d).max() * np.abs(p(s)).max()
        assert_negligible(d @ p(s) - p.deriv(order)(s), scale=size, rtol=1e-14)


@orders
def test_every_row_is_of_second_order(order):
    k, phase = 2.0, 0.3

    def error(intervals: int, rows: slice) -> float:
        s = np.linspace(0.0, 1.0, intervals + 1)
        found = difference_matrix(order, intervals, 1.0 / intervals) @ np.sin(k * s + phase)
        exact = k**order * np.sin(k * s + phase + 0.5 * np.pi * order)
        return float(np.abs(found - exact)[rows].max())

    errors = [error(n, slice(None)) for n in (32, 64, 128)]
    final = {1: 2e-4, 2: 1.5e-3, 3: 6e-3, 4: 2.5e-2}[order]
    assert_order(errors, between=(1.85, 2.15), final=final)
    # Inside, the leading term of the error is known.
    coefficient = {1: 1 / 6, 2: 1 / 12, 3: 1 / 4, 4: 1 / 6}[order]
    s = np.linspace(0.0, 1.0, 129)[2:-2]
    largest = np.abs(k ** (order + 2) * np.sin(k * s + phase + 0.5 * np.pi * order)).max()
    leading = coefficient * largest / 128**2
    assert error(128, slice(2, -2)) == pytest.approx(leading, rel=0.02)


@orders
def test_mirror_image(order):
    d = difference_matrix(order, 15, 0.1)
    assert_close(d[::-1, ::-1], (-1) ** order * d)


def test_grid_of_a_length():
    grid = UniformGrid(length=2.5, intervals=10)
    assert grid.spacing == 0.25
    assert_close(grid.nodes, np.linspace(0.0, 2.5, 11))
    assert_close(grid.half_points, np.linspace(0.125, 2.375, 10), rtol=1e-15)
    assert grid.weights.sum() == pytest.approx(2.5, rel=1e-15)
    assert grid.weights @ grid.nodes == pytest.approx(3.125, rel=1e-15)
    for order, d in enumerate(grid.stacked_differences(), start=1):
        assert_close(d, difference_matrix(order, 10, 0.25))
