"""Second order in space and time for interacting fibers: N = 30, 60, 120 with dt proportional to h.

The spheroidal regularisation and a fixed d_0 keep the model the same on every grid.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.constraint.coupled import FixedPoint
from stokesfibers.domain import Free, Periodic
from stokesfibers.fiber.suspension import Suspension
from stokesfibers.summation.close_approach import PaperCloseApproach
from support import assert_order

COARSE = 30


def _final(intervals, count, domain):
    fiber = sf.Fiber(slenderness=1e-3, count=count)
    problem = sf.Problem(
        fiber,
        mu_bar=2e4,
        flow=sf.Shear(1.0),
        mobility=sf.NonLocal(sf.SpheroidalRegularization()),
        engine=sf.PaperEngine(intervals, dt=0.3 / intervals, beta=20.0),
        domain=domain,
        close_approach=PaperCloseApproach(d0=2e-3, near=0.0),
        tension_solver=FixedPoint(tolerance=1e-10),
    )
    placed = Suspension(seed=8, box=(2.0, 1.2, 1.2), least_gap=0.15)
    curves = placed.curves(problem.fibers, domain.lengths)
    result = sf.simulate(problem, curves, until=1.5, record=sf.every(0.5))
    assert result.status.code == "done"
    positions = result.data["trajectory"]["position"][-1].to_numpy()
    return positions[:, :: intervals // COARSE]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "domain"),
    [(2, Free()), (5, Free()), (2, Periodic((2.0, 0, 0))), (5, Periodic((2.0, 0, 0)))],
    ids=["2 free", "5 free", "2 periodic", "5 periodic"],
)
def test_second_order_for_interacting_fibers(count, domain):
    shapes = [_final(COARSE * factor, count, domain) for factor in (1, 2, 4)]
    apart = [float(np.linalg.norm(a - b, axis=-1).mean()) for a, b in pairwise(shapes)]
    assert_order(apart, between=(1.7, 2.4), final=8e-6)
