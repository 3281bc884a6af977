"""A step in which fibers move far past others is looked at for crossings in parts."""

from __future__ import annotations

import numpy as np

import stokesfibers as sf
from stokesfibers.domain.sheared import Sheared
from stokesfibers.run.advance import _parts

S = np.linspace(-0.5, 0.5, 11)
BEFORE = np.array([[[s, 0.0, z] for s in S] for z in (0.3, 0.7)])


def _problem(**space):
    return sf.Problem(sf.Fiber(count=2, slenderness=1e-2), mu_bar=10.0, **space)


def test_only_motion_past_others_counts():
    """One fiber moves by a length past the other, both fall by a hundred: half a length each."""
    problem = _problem()
    fallen = BEFORE - np.array([0.0, 100.0, 0.0])
    assert _parts(problem, BEFORE, fallen, (0.0, 0.1)) <= 1
    fallen[1, :, 0] += 1.0
    assert _parts(problem, BEFORE, fallen, (0.0, 0.1)) == 10


def test_what_moves_with_a_sheared_cell_does_not_count():
    cell = Sheared((2.0, 2.0, 2.0))
    problem = _problem(flow=sf.Shear(1.0), domain=cell)
    after = BEFORE + np.array([[[0.0, 0.4, 0.0]], [[0.0, -0.4, 0.0]]])
    carried = after + 0.5 * after[..., 1:2] * np.array([1.0, 0.0, 0.0])
    assert _parts(problem, BEFORE, carried, (0.0, 0.5)) == _parts(_problem(), BEFORE, after, (0, 1))
