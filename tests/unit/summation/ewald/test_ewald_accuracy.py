"""Measured errors against the tolerance and the estimate; independence of the split."""

from __future__ import annotations

import numpy as np
import pytest

from reference.ewald_slow import relative
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.sheared import Sheared
from stokesfibers.summation.ewald import EwaldSum
from stokesfibers.summation.ewald.accuracy import estimated_error
from stokesfibers.summation.ewald.far import FarPart

pytest.importorskip("ducc0")
WORKERS = Workers(1)
COUNT = 1000
DOMAINS = {
    "periodic": Periodic((1.0, 1.0, 1.0)),
    "sheared": Sheared((1.0, 1.0, 1.0), 0.4),
    "free": Free(),
    "slab": Periodic((1.0, 1.0, 0.0)),
}
TOLERANCES = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10]


def _cloud(count=COUNT):
    rng = np.random.default_rng(11)
    f = rng.standard_normal((count, 3))
    return rng.random((count, 3)), f - f.mean(axis=0)


def _sum(domain, ewald, count=COUNT):
    x, f = _cloud(count)
    return ewald.plan(domain, x, workers=WORKERS).execute(f)


@pytest.fixture(scope="module", params=list(DOMAINS))
def exact(request):
    domain = DOMAINS[request.param]
    return domain, _sum(domain, EwaldSum(1e-12, rc=0.35))


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_error_is_below_the_tolerance_and_not_far_below(exact, tolerance):
    domain, expected = exact
    error = relative(_sum(domain, EwaldSum(tolerance, rc=0.2)), expected)
    assert tolerance / 100.0 <= error <= tolerance


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_chosen_cutoff_meets_the_tolerance(exact, tolerance):
    domain, expected = exact
    error = relative(_sum(domain, EwaldSum(tolerance)), expected)
    assert tolerance / 100.0 <= error <= tolerance


@pytest.mark.parametrize("kind", ["prolate", "gaussian"])
@pytest.mark.parametrize("rc", [0.15, 0.3])
def test_estimate_is_the_error_of_the_split(kind, rc, monkeypatch):
    # transforms ten times finer, so that the split is all that is measured
    monkeypatch.setattr("stokesfibers.summation.ewald.far.NUFFT_SHARE", 0.1)
    cube = DOMAINS["periodic"]
    expected = _sum(cube, EwaldSum(1e-12, rc=0.35))
    for tolerance in (1e-4, 1e-5, 1e-8):
        ewald = EwaldSum(tolerance, kind, rc=rc)
        plan = ewald.plan(cube, _cloud()[0], workers=WORKERS)
        error = relative(plan.execute(_cloud()[1]), expected)
        estimate = estimated_error(kind, plan.choice.split.bandwidth, rc, COUNT * rc**3)
        # mode numbers are whole, and an even number of them is a little more than asked for
        assert 0.25 * estimate < error < 1.6 * estimate


def test_a_narrower_band_is_as_much_worse_as_estimated():
    cube = DOMAINS["periodic"]
    expected = _sum(cube, EwaldSum(1e-12, rc=0.35))
    for width in (14.0, 20.0):
        error = relative(_sum(cube, EwaldSum(1e-9, rc=0.2, bandwidth=width)), expected)
        assert 0.25 < error / estimated_error("prolate", width, 0.2, COUNT * 0.2**3) < 1.6


def test_result_does_not_depend_on_the_split(exact):
    domain, expected = exact
    for ewald in (
        EwaldSum(1e-9, "gaussian", rc=0.4),
        EwaldSum(1e-9, "gaussian", rc=0.3),
        EwaldSum(1e-9, rc=0.25),
        EwaldSum(1e-9, rc=0.5),
    ):
        assert relative(_sum(domain, ewald), expected) < 1e-9


def test_the_gaussian_reaches_the_least_tolerances_too():
    cube = DOMAINS["periodic"]
    expected = _sum(cube, EwaldSum(1e-12, rc=0.35))
    for tolerance in (1e-10, 1e-11):
        ewald = EwaldSum(tolerance, "gaussian", rc=0.4)
        assert tolerance / 100.0 <= relative(_sum(cube, ewald), expected) <= tolerance


def test_few_points_are_as_accurate():
    cube = DOMAINS["periodic"]
    for count in (1, 2, 10, 100):
        expected = _sum(cube, EwaldSum(1e-12, rc=0.45), count) if count > 1 else None
        for tolerance in (1e-4, 1e-8):
            x, f = _cloud(count)
            if count == 1:
                f = np.array([[1.0, 2.0, -1.0]])
                # the lattice of one point: Hasimoto's constant
                expected = -2.8372974794806 * f / 0.75
            found = EwaldSum(tolerance).plan(cube, x, workers=WORKERS).execute(f)
            assert relative(found, expected) < tolerance


def test_wildly_uneven_clouds():
    rng = np.random.default_rng(2)
    tight = 0.5 + 1e-3 * rng.standard_normal((400, 3))
    pairs = rng.random((50, 3))
    x = np.concatenate([tight, pairs, pairs + 1e-7 * rng.standard_normal((50, 3)), [[3.0, -2, 0]]])
    f = rng.standard_normal(x.shape)
    gap = x[:, None] - x[None]
    size = np.linalg.norm(gap, axis=-1)
    np.fill_diagonal(size, np.inf)
    along = np.einsum("ijk,jk->ij", gap, f) / size**3
    expected = (1.0 / size) @ f + np.einsum("ij,ijk->ik", along, gap)
    for tolerance in (1e-3, 1e-6, 1e-9):
        found = EwaldSum(tolerance).plan(Free(), x, workers=WORKERS).execute(f)
        # close pairs have velocities 1e7 times the rest: each point by its own size
        error = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
        assert np.sqrt(np.mean(error**2)) < tolerance
        for start, stop in ((0, 400), (400, 500), (500, 501)):
            assert relative(found[start:stop], expected[start:stop]) < tolerance


def test_half_of_the_transforms_is_needed(monkeypatch):
    """Without the far part the answer is wrong: the comparison above can fail."""
    monkeypatch.setattr(FarPart, "collect", lambda self, task: self._found[task].fill(0.0))
    cube = DOMAINS["periodic"]
    assert relative(_sum(cube, EwaldSum(1e-4, rc=0.2)), _sum(cube, EwaldSum(1e-4, rc=0.3))) > 1e-2
