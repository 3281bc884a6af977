"""Close filaments: the reference against other quadratures, and the quick tier's statements."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Chebyshev
from scipy.spatial.distance import cdist

from reference.pair_twins import by_parts, plain
from stokesfibers.experiments import close_pair_curves as curves
from stokesfibers.experiments import close_pair_tensions as tensions
from stokesfibers.experiments.close_pair_rows import NEAR
from support import assert_close, assert_negligible

WEIGHT = 0.5 * 0.01**2


def _force(s):
    shape = curves.lower_filament().sample(s)
    return shape.xsss - curves.given_tension(s) * shape.xs


def _density(s):
    """The derivative of F, by interpolation."""
    parts = [
        Chebyshev.interpolate(lambda t, d=d: _force(t)[d], 70, domain=[0, 1]) for d in range(3)
    ]
    return np.stack([part.deriv()(s) for part in parts])


def test_distance_is_the_smallest_of_the_centrelines():
    s = np.linspace(0.0, 1.0, 1201)
    for distance in (1.0, 0.1, 0.02):
        pair = curves.lower_filament(), curves.upper_filament(distance)
        found = cdist(*(filament.sample(s).x.T for filament in pair)).min()
        assert distance * (1.0 - 1e-12) <= found <= distance * (1.0 + 1e-4)


def test_curves_have_unit_tangents_and_free_ends():
    s = np.linspace(0.0, 1.0, 101)
    for filament in (curves.lower_filament(), curves.upper_filament(0.3)):
        shape = filament.sample(s)
        assert_close(np.linalg.norm(shape.xs, axis=0), np.ones(101), rtol=1e-12)
        largest = np.abs(shape.xsss).max()
        assert largest > 5.0
        assert_negligible(shape.xsss[:, [0, -1]], scale=largest, rtol=1e-8)
        assert_close(np.gradient(shape.x, s, axis=1)[:, 1:-1], shape.xs[:, 1:-1], rtol=1e-3)


@pytest.mark.parametrize("distance", [0.3, NEAR])
def test_reference_is_the_plain_forms_and_the_forms_by_parts(distance):
    lower = curves.lower_filament()
    targets = np.ascontiguousarray(curves.upper_filament(distance).sample([0.2, 0.56, 0.9]).x.T)
    parts, error = curves.exact_velocity(lower, targets, WEIGHT)
    assert error < 1e-10
    found = parts.sum(axis=0)
    expected = [plain(p, lambda s: lower.sample(s).x, _density, WEIGHT) for p in targets]
    assert_close(found, expected, rtol=1e-9)
    s = np.linspace(0.0, 1.0, 4001)
    shape, force = lower.sample(s), _force(s)
    expected = [by_parts(p, shape.x.T, shape.xs.T, force.T, s[1], WEIGHT) for p in targets]
    assert_close(found, expected, rtol=2e-7)  # the rule's end correction, second order


def test_isolated_filaments_are_the_limit_of_filaments_far_apart():
    system = tensions.assembled(tensions.CASES[0], tensions.discretised(20), 200.0)
    assert_close(tensions.direct(system), tensions.isolated(system), rtol=1e-4)
    close = tensions.assembled(tensions.CASES[0], tensions.discretised(20), 0.1)
    assert np.abs(tensions.direct(close) / tensions.isolated(close) - 1.0).max() > 0.01


def test_a_solver_that_gives_up_is_left_out():
    five_parallel = tensions.CASES[3]
    system = tensions.assembled(five_parallel, tensions.discretised(20), 0.5 * 0.05)
    counts, errors = tensions.solved(system, np.zeros_like(system.right))
    assert np.isnan(counts[0])
    assert np.isnan(errors[0])
    assert 15 < counts[1] <= 200


def test_quick(quick):
    found = quick("close_pair")
    data = found.data()
    name = "largest error, 1 L to 3 d_0, {} rule, eps = 0.01, N = 100"
    assert found.ours(name.format("plain")) == pytest.approx(1.2e-4, rel=0.03)
    assert found.ours(name.format("refined")) == pytest.approx(3.2e-3, rel=0.3)
    missing = data["error"].sel(rule="plain").isnull()
    assert not missing.sel(distance=slice(NEAR - 1e-9, None)).any()
    # from 2 d_0 down the default is another model and is not compared
    blended = data["error"].sel(rule="default", eps=1e-2)
    assert blended.sel(distance=slice(0.0, 0.0399)).isnull().all()
    assert found.ours("sweeps, 2 crossing, distance 50 d_0") == 3
    assert found.ours("gmres, 2 crossing, distance 50 d_0") == 2
    assert found.ours("largest distance/d_0 at which the sweeps gave up") == 1.0


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_full(full):
    found = full("close_pair")
    name = "largest error, 1 L to 3 d_0, {} rule, eps = 0.001, N = 200"
    assert found.ours(name.format("plain")) == pytest.approx(3.0e-5, rel=0.03)
    assert found.ours(name.format("refined")) == pytest.approx(3.5e-3, rel=0.03)
    assert found.ours("largest distance/d_0 at which the sweeps gave up") == 1.5
