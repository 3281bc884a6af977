"""Fig. 14: eigenvalues and crossings; the formula takes no time in either tier."""

from __future__ import annotations

import pytest

from stokesfibers.experiments.fig14 import by_quadrature, eigenvalues


def test_crossings(quick):
    fig14 = quick("fig14")
    for eps, last in (("0.01", 33), ("0.001", 340), ("0.0001", 3404)):
        assert fig14.ours(f"largest n with c + lambda_n < 0, eps = {eps}") == last


@pytest.mark.parametrize("n", [1, 2, 7, 50])
def test_formula_against_quadrature_of_the_operator(n):
    assert by_quadrature(n) == pytest.approx(eigenvalues(n)[-1], rel=1e-11)


def test_first_eigenvalues():
    assert eigenvalues(3) == pytest.approx([0.0, 2.0, 3.0, 11.0 / 3.0])
