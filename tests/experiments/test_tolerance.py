"""The error asked for and the error got; rows fail where they differ by more than ten."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.domain import Free, Periodic
from stokesfibers.experiments import tolerance
from stokesfibers.experiments.tolerance_cases import CASES, spatial
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.load import Gravity, NoLoad
from stokesfibers.slender.mobility import LocalDrag, NonLocal


@pytest.fixture(scope="module")
def reproduced(quick):
    return quick("tolerance").data()


def test_quick(reproduced):
    data = reproduced
    ratio = data["error"].to_numpy() / data["rtol"].to_numpy()
    assert ratio.max() < tolerance.FACTOR
    assert (data["error"].to_numpy()[:, 0] > 3.0 * data["error"].to_numpy()[:, -1]).all()
    assert (data["passing_error"] >= data["error"]).all()
    assert (data["length_error"] <= data["recorded_length_error"] + 1e-10).all()


def test_an_error_of_eleven_tolerances_is_told(reproduced):
    data = reproduced.copy(deep=True)
    data["error"][1, 0] = 11.0 * data["rtol"][0]
    wrong = [row.quantity for row in tolerance.check(data) if row.verdict == "differs"]
    assert len(wrong) == 2
    assert wrong[0] == f"worst true error over rtol, {tolerance.label(data, 1)}"
    assert wrong[1] == "true error over rtol, largest of all"


def test_a_length_error_above_ten_squares_is_told(reproduced):
    data = reproduced.copy(deep=True)
    data["length_error"][0, -1] = 1.01 * tolerance.allowed_length_error(data["rtol"][-1].values)
    name = f"worst length error over what is allowed, {tolerance.label(data, 0)}"
    verdicts = [
        {row.quantity: row.verdict for row in tolerance.check(d)} for d in (reproduced, data)
    ]
    assert [v[name] for v in verdicts] == ["agrees", "differs"]


def test_length_errors_allowed():
    allowed = tolerance.allowed_length_error(np.array([1e-2, 1e-6]))
    np.testing.assert_allclose(allowed, [1e-3, 1e-8], rtol=1e-12)


def test_cases_are_varied():
    assert len(CASES) == 28
    assert len({(c.name, c.mu_bar, c.eps) for c in CASES}) == 28
    assert (min(c.mu_bar for c in CASES), max(c.mu_bar for c in CASES)) == (1e3, 1e6)
    assert (min(c.eps for c in CASES), max(c.eps for c in CASES)) == (1e-4, 10.0**-1.5)
    assert len({type(c.flow) for c in CASES}) == 5
    assert {type(c.mobility) for c in CASES} == {NonLocal, LocalDrag}
    assert {type(c.load) for c in CASES} == {NoLoad, Gravity}
    assert {type(c.domain) for c in CASES} == {Free, Periodic}
    counts = [len(c.starts) for c in CASES]
    assert (counts.count(1), counts.count(2)) == (23, 5)
    for case in CASES:
        assert case.problem(1e-3).flow.rate_scale() in (0.0, 1.0)
        assert len(case.problem(1e-3).fibers) == len(case.curves())


def test_the_second_fiber_is_a_curve_of_its_own_beside_the_first():
    one, other = next(c for c in CASES if len(c.starts) == 2).curves()
    sigma = np.linspace(0.0, 1.0, 21)
    apart = other.at_fractions(sigma) - one.at_fractions(sigma)
    assert np.linalg.norm(apart, axis=-1).min() > 0.1
    assert np.ptp(apart, axis=0).max() > 0.1, "not the first one shifted"
    alpha, h = np.linspace(0.05, 0.95, 7), 1e-5
    slope = (other.position(alpha + h) - other.position(alpha - h)) / (2.0 * h)
    np.testing.assert_allclose(other.tangent(alpha), slope, atol=1e-8)


def test_spatial_start_is_a_smooth_curve_of_unit_length_out_of_the_plane():
    curve = spatial(2.0, 0.05, 0.04)(Fiber(length=1.0, slenderness=1e-2, rigidity=1.0))
    assert curve.length() == pytest.approx(1.0, rel=1e-12)
    alpha, h = np.linspace(0.05, 0.95, 19), 1e-5
    slope = (curve.position(alpha + h) - curve.position(alpha - h)) / (2.0 * h)
    np.testing.assert_allclose(curve.tangent(alpha), slope, atol=1e-9)
    points = curve.position(alpha)
    assert np.ptp(points[:, 2]) > 0.02
    ends = curve.tangent(np.array([0.0, 0.01, 0.99, 1.0]))
    assert np.abs(ends - ends[0]).max() < 1e-3, "straight at the ends, as free ends are"


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    assert full("tolerance").ours("true error over rtol, largest of all") < tolerance.FACTOR
