"""Accuracy tables of the Ewald sum, and the slow sums they are made with."""

from __future__ import annotations

import numpy as np
import pytest

from reference.ewald_slow import lattice_sum
from reference.periodic_slow import one_periodic, three_periodic, total, two_periodic_modes
from stokesfibers.experiments import slow_sums as slow
from stokesfibers.experiments.slow_sums import Pairs
from support import assert_close

pytest.importorskip("ducc0")


def _pairs(height: float = 0.0) -> Pairs:
    """Return 3 targets, `height` above 10 sources; forces add up to zero."""
    random = np.random.default_rng(5)
    forces = random.standard_normal((10, 3))
    targets = random.random((3, 3)) + np.array([0.0, 0.0, height])
    return Pairs(targets, random.random((10, 3)), forces - forces.mean(axis=0))


def _expected(pairs: Pairs, tensor) -> np.ndarray:
    return total(tensor, pairs.targets, pairs.sources, pairs.forces)


def test_slow_sums_of_one_and_three_directions_are_those_of_others():
    pairs = _pairs()
    expected = _expected(pairs, lambda r: one_periodic(r, 1.1, 1))
    assert_close(slow.one_direction(pairs, 1.1, 1), expected, rtol=1e-10)
    periods = (1.0, 1.2, 0.9)
    expected = _expected(pairs, lambda r: three_periodic(r, periods))
    assert_close(slow.three_directions(pairs, periods), expected, rtol=1e-11)


def test_slow_sum_of_two_directions_is_that_of_its_modes():
    pairs = _pairs(height=1.5)
    expected = _expected(pairs, lambda r: two_periodic_modes(r, (1.0, 1.3)))
    assert_close(slow.two_directions(pairs, (1.0, 1.3)), expected, rtol=1e-9)


def test_copies_are_the_sheared_lattice():
    pairs = _pairs()
    copies, periods = slow.sheared_as_copies(pairs, (1.0, 1.2, 0.9), (1, 3))
    assert periods == (1.0, pytest.approx(3.6), 0.9)
    vectors = np.array([[1.0, 0.0, 0.0], [1.0 / 3.0, 1.2, 0.0], [0.0, 0.0, 0.9]])
    expected = lattice_sum(pairs.targets, pairs.sources, pairs.forces, vectors)
    assert_close(slow.three_directions(copies, periods), expected, rtol=1e-10)


def test_a_lattice_may_have_any_angles_and_far_targets():
    pairs = _pairs()
    vectors = np.array([[1.0, 0.0, 0.0], [0.37, 1.2, 0.0], [0.1, -0.2, 0.9]])
    expected = lattice_sum(pairs.targets, pairs.sources, pairs.forces, vectors)
    assert_close(slow.lattice(pairs, vectors), expected, rtol=1e-10)
    far = Pairs(pairs.targets + [[3.0, -2.0, 4.0]] @ vectors, pairs.sources, pairs.forces)
    assert_close(slow.lattice(far, vectors), expected, rtol=1e-10)


def test_a_point_feels_its_images_and_not_itself():
    one = np.array([[0.3, 0.2, 0.1]])
    alone = Pairs(one, one, np.array([[0.0, 0.0, 1.0]]))
    found = slow.three_directions(alone, (1.0, 1.0, 1.0))
    assert_close(found[0], [0.0, 0.0, -2.8372974794806 / 0.75], rtol=1e-11)


@pytest.mark.timeout(1800)
def test_quick(quick):
    data = quick("ewald").data()
    over = (data["error"] / data["tolerance"]).to_numpy()
    assert np.all((over >= 0.01) & (over <= 1.0))
    prolate, gaussian = (data["rc"].sel(split=name) for name in ("prolate", "gaussian"))
    assert bool((prolate <= gaussian * 1.0001).all()), "a narrower band lets the cut-off be shorter"
    # each domain is summed by itself: no two have the same error
    assert len(np.unique(data["error"].sel({"split": "prolate", "tolerance": 1e-6}))) == 5


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    assert full("ewald").data().sizes["tolerance"] == 8
