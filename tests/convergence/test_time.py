"""Order in time of the scheme (29) at a fixed grid: BDF2, with everything extrapolated to match."""

from __future__ import annotations

import numpy as np
import pytest

import stokesfibers as sf
from support import advance, assert_order, free_end_curve

INTERVALS, UNTIL = 20, 0.48


def positions(flow, steps: int) -> np.ndarray:
    case = sf.Problem(
        sf.Fiber(slenderness=1e-2),
        mu_bar=3e4,
        flow=flow,
        mobility=sf.NonLocal(sf.SpheroidalRegularization()),
        engine=sf.PaperEngine(intervals=INTERVALS, dt=UNTIL / steps, beta=20.0),
    )
    _, carry = advance(case, free_end_curve().nodes(INTERVALS), steps)
    return carry.x[0]


@pytest.mark.parametrize(
    ("flow", "final"),
    [
        (sf.Shear(rate=1.0), 1.4e-6),
        (sf.OscillatoryShear(amplitude=2.0, frequency=3.0), 4.5e-5),
    ],
    ids=("steady", "oscillating"),
)
def test_second_order_in_time(flow, final):
    exact = positions(flow, 1920)
    errors = [np.linalg.norm(positions(flow, n) - exact, axis=0).max() for n in (60, 120, 240)]
    assert_order(errors, between=(1.85, 2.2), final=final)
