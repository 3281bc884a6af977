"""Stiff and extreme cases of the high-order engine run without hand-tuning."""

from __future__ import annotations

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.problem.engine import SpectralEngine
from support import assert_close

RTOL = 1e-4


def run(fiber, *, until, rtol=RTOL, rate=1.0, **fluid):
    """Return a run of the paper's buckling in shear, with nothing chosen but the tolerance."""
    problem = sf.Problem(fiber, flow=sf.Shear(rate), engine=SpectralEngine(rtol=rtol), **fluid)
    curve = sf.shapes.nearly_straight(fiber)
    result = sf.simulate(problem, curve, until=until, record=sf.every(until / 4.0), threads=1)
    assert result.status.code == "done"
    assert result.status.time == until
    return result


def shapes(result, length=1.0):
    """Return positions over the length, (time, point, 3)."""
    return result.data["trajectory"]["position"].to_numpy()[:, 0] / length


@pytest.mark.slow
@pytest.mark.parametrize(("eps", "mu_bar"), [(1e-3, 1e7), (1e-5, 4e5), (1e-5, 1e7)])
def test_very_soft_and_very_thin_fibers(eps, mu_bar):
    fiber = sf.Fiber(slenderness=eps)
    found = run(fiber, until=61.44, mu_bar=mu_bar)
    finer = run(fiber, until=61.44, rtol=0.1 * RTOL, mu_bar=mu_bar)
    assert_close(shapes(found), shapes(finer), atol=RTOL)
    bend = found.data["observables"]["largest_curvature"].to_numpy().max()
    assert bend > 10.0, "it buckles"
    assert found.status.explanation == ""
    assert found.data["observables"]["length_error"].to_numpy().max() < 1e-6
    assert found.data["numerics"].sizes["step"] < 500


@pytest.mark.parametrize(("rate", "buckles"), [(1.0, False), (200.0, True)])
def test_actin_in_si_units(rate, buckles):
    """10 micrometres long, 4 nm in radius, 1e-25 N m^2, in water: a relation of 1e-21 to 1."""
    length, radius, rigidity, viscosity = 10e-6, 4e-9, 1e-25, 1e-3
    until = 55.0 / rate
    actin = sf.Fiber(length=length, radius=radius, rigidity=rigidity)
    found = run(actin, until=until, rate=rate, viscosity=viscosity)
    twin = sf.Fiber(slenderness=radius / length)
    mu_bar = 8.0 * np.pi * viscosity * rate * length**4 / rigidity
    expected = run(twin, until=55.0, mu_bar=mu_bar)
    assert_close(shapes(found, length), shapes(expected), atol=1e-7)
    observed, unit = found.data["observables"], expected.data["observables"]
    assert (observed["largest_curvature"].to_numpy().max() * length > 1.0) == buckles
    moment = rigidity / length  # of the stress: force times length
    assert_close(
        observed["extra_stress"].to_numpy() / moment, unit["extra_stress"].to_numpy(), rtol=1e-5
    )


def _neighbours(gap, mu_bar):
    """Return a bent fiber and one 100 times shorter beside it, and their shapes at the start."""
    long, short = sf.Fiber(slenderness=1e-3), sf.Fiber(length=0.01, slenderness=1e-3)
    bent = sf.shapes.nearly_straight(long, angle=2.3, amplitude=0.3)
    centre = bent.at_fractions(np.array([0.4]))[0] + np.array([0.0, 0.0, gap])
    beside = sf.shapes.segment(short, centre=tuple(centre), direction=np.array([0.6, 0.8, 0.0]))
    options = {"mu_bar": mu_bar, "flow": sf.Shear(1.0)}
    return (long, short), (bent, beside), options


@pytest.mark.parametrize(
    ("gap", "mu_bar"), [(0.02, 1e4), pytest.param(0.008, 1e5, marks=pytest.mark.slow)]
)
def test_a_fiber_a_hundred_times_shorter_than_its_neighbour(gap, mu_bar):
    """Its bending is 1e8 times faster, but neither its bend nor its start dictates the steps."""
    fibers, shapes_, options = _neighbours(gap, mu_bar)

    def go(kinds, curves, rtol):
        problem = sf.Problem(kinds, engine=SpectralEngine(rtol=rtol), **options)
        result = sf.simulate(problem, curves, until=2.0, record=sf.every(0.5), threads=1)
        assert result.status.code == "done"
        assert result.status.explanation == ""
        return result

    found, fine = go(fibers, shapes_, RTOL), go(fibers, shapes_, 0.01 * RTOL)
    alone = go(fibers[:1], shapes_[:1], RTOL)
    steps = found.data["numerics"]
    assert steps.sizes["step"] < 1.25 * alone.data["numerics"].sizes["step"]
    assert steps["step_size"].to_numpy()[0] > 1e-7
    position, expected = (r.data["trajectory"]["position"].to_numpy() for r in (found, fine))
    assert_close(position[:, 0], expected[:, 0], atol=0.1 * RTOL)
    assert_close(position[:, 1], expected[:, 1], atol=5.0 * RTOL * 0.01)
    assert np.abs(position[-1, 1] - position[0, 1]).max() > 0.01, "it moves"
    assert found.data["observables"]["length_error"].to_numpy().max() < 1e-7
