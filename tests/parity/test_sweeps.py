"""The sweeps (39) against the loop they state."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.constraint.coupled import CoupledSystem, FixedPoint
from stokesfibers.core.parallel import Workers
from stokesfibers.kernels import sweeps

COUNT, SIZE = 11, 7


def system(threads: int = 1) -> CoupledSystem:
    rng = np.random.default_rng(3)
    own = rng.normal(size=(COUNT, SIZE, SIZE)) + 20.0 * np.eye(SIZE)
    influence = 0.4 * rng.normal(size=(COUNT, SIZE, COUNT, SIZE))
    return CoupledSystem(own, influence, rng.normal(size=(COUNT, SIZE)), Workers(threads))


def test_one_sweep_is_the_loop_with_the_newest_tensions():
    s = system()
    tension = np.random.default_rng(4).normal(size=(COUNT, SIZE))
    expected = tension.copy()
    change = 0.0
    for k in range(COUNT):
        rest = sum(s.influence[k, :, j] @ expected[j] for j in range(COUNT) if j != k)
        new = np.linalg.solve(s.own[k] + s.influence[k, :, k], s.right[k] - rest)
        change = max(change, np.abs(new - expected[k]).max() / np.abs(new).max())
        expected[k] = new
    known = s.right - s.later(tension)
    found = sweeps.sweep(s.influence, s.inverses(), known, tension)
    np.testing.assert_allclose(tension, expected, rtol=0.0, atol=1e-13)
    assert found == pytest.approx(change, rel=1e-10)


def test_the_solution_does_not_depend_on_threads():
    one, count = FixedPoint().solve(system(1), np.zeros((COUNT, SIZE)))
    two, again = FixedPoint().solve(system(2), np.zeros((COUNT, SIZE)))
    assert count == again > 2
    np.testing.assert_array_equal(one, two)
    whole = system().influence.copy()
    for k in range(COUNT):
        whole[k, :, k] += system().own[k]
    flat = whole.reshape(COUNT * SIZE, COUNT * SIZE) @ one.ravel()
    np.testing.assert_allclose(flat, system().right.ravel(), rtol=0.0, atol=1e-5)
