"""Choices of delta: eigenvalues, and changes against an independent quadrature."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from stokesfibers.experiments import regularization_rows
from stokesfibers.experiments.regularization import (
    change,
    force,
    largest_change,
    on_legendre_nodes,
    on_uniform_grid,
)
from stokesfibers.slender.regularization import (
    ConstantRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)

CHOICES = (SpheroidalRegularization(), PaperRegularization(), ConstantRegularization())


@pytest.fixture(scope="module")
def reproduced(quick):
    return quick("regularization").data()


def test_quick(reproduced):
    data = reproduced
    assert data["shape_difference"][0] == 0.0
    assert (data["shape_difference"][1:] > 1e-8).all()


@pytest.mark.parametrize(
    ("choice", "values"),
    [
        (SpheroidalRegularization(), (0.96, 0.50, 0.39)),
        (PaperRegularization(), (0.64, -0.90, -2.40)),
        (ConstantRegularization(), (1.03, 0.53, 0.40)),
    ],
)
def test_eigenvalues_on_legendre_nodes_are_those_of_an_independent_calculation(choice, values):
    found = [on_legendre_nodes(choice, 1e-2, n) for n in (32, 64, 128)]
    assert found == pytest.approx(values, abs=0.006)


def test_both_kinds_of_nodes_tend_to_the_same_bound():
    for choice in (SpheroidalRegularization(), ConstantRegularization()):
        legendre, uniform = on_legendre_nodes(choice, 1e-2, 128), on_uniform_grid(choice, 1e-2, 200)
        assert legendre == pytest.approx(regularization_rows.BOUND, abs=0.02)
        assert uniform == pytest.approx(regularization_rows.BOUND, abs=0.01)


@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("s", [1e-3, 0.02, 0.37, 0.95])
def test_change_of_the_operator_against_adaptive_quadrature(choice, s):
    delta = float(choice.delta(np.array(s), 1e-2))
    here = float(force(np.array(s)))

    def integrand(u):
        bare, round_off = 1.0 / abs(u), 1.0 / np.hypot(u, delta)
        return (float(force(np.array(s + u))) - here) * (round_off - bare)

    cuts = {"limit": 400, "epsabs": 1e-13, "epsrel": 1e-11}
    pieces = [-s, -min(s, 3.0 * delta), 0.0, min(1.0 - s, 3.0 * delta), 1.0 - s]
    expected = sum(quad(integrand, a, b, **cuts)[0] for a, b in pairwise(pieces) if b - a > 1e-14)
    assert change(s, delta) == pytest.approx(expected, rel=1e-7, abs=1e-12)


def test_spheroidal_choice_is_closest_to_the_bare_theory():
    for eps in (1e-2, 1e-3):
        spheroidal, paper, constant = (largest_change(choice, eps) for choice in CHOICES)
        assert spheroidal < 0.8 * paper < paper < constant


def test_a_choice_of_first_order_is_told(reproduced):
    data = reproduced.copy(deep=True)
    data["change"][0] = data["change"].sel(choice="constant")
    wrong = [row.quantity for row in regularization_rows.rows(data) if row.verdict == "differs"]
    assert any("slope" in quantity and "spheroidal" in quantity for quantity in wrong)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    regularization = full("regularization")
    least = regularization.ours("least eigenvalue, (16), Gauss-Legendre nodes, eps = 0.01")
    assert least < -3.8
