"""Order of convergence of whole runs, in space and time together, through a mild buckling."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import stokesfibers as sf
from support import advance, assert_order

STEP = 0.64  # dt / h: half the paper's, which at N = 25 the penalisation would not allow
TIMES = (1.92, 2.56)
"""Most bent (curvature 10.5), and straightening again."""


@cache
def solution(intervals: int, until: float) -> tuple[np.ndarray, float, float]:
    """Return positions (3, node), the relative length error and the largest curvature."""
    fiber = sf.Fiber(slenderness=1e-2)
    case = sf.Problem(
        fiber,
        mu_bar=1e5,
        flow=sf.Shear(rate=1.0),
        engine=sf.PaperEngine(intervals=intervals, dt=STEP / intervals),
    )
    start = sf.shapes.nearly_straight(fiber, angle=0.85 * np.pi, amplitude=-4.0)
    x = start.at_fractions(np.linspace(0.0, 1.0, intervals + 1)).T
    stepper, carry = advance(case, x, round(until / STEP * intervals))
    end = stepper.fibers[0].shape(carry.x[0])
    length = np.linalg.norm(end.xs, axis=0) @ stepper.fibers[0].grid.weights
    return carry.x[0], abs(float(length) - 1.0), float(np.linalg.norm(end.xss, axis=0).max())


def distances(grids: tuple[int, ...], until: float) -> list[float]:
    """Return the paper's norm of consecutive differences: mean distance of common nodes."""
    shapes = [solution(n, until)[0] for n in grids]
    return [
        float(np.linalg.norm(fine[:, ::2] - coarse, axis=0).mean())
        for coarse, fine in pairwise(shapes)
    ]


@pytest.mark.parametrize("until", TIMES)
def test_positions_and_length_converge_through_mild_buckling(until):
    grids = (25, 50, 100)
    differences = distances(grids, until)
    lengths = [solution(n, until)[1] for n in grids]
    assert_order(differences, between=(1.8, 2.3), final=2.2e-3)  # three times N = 100's error
    assert (np.array(lengths[:-1]) > 4.0 * np.array(lengths[1:])).all(), lengths
    assert lengths[-1] < 1.1e-4


@pytest.mark.slow
@pytest.mark.parametrize("until", TIMES)
def test_positions_converge_at_second_order_on_finer_grids(until):
    differences = distances((50, 100, 200), until)
    assert_order(differences, between=(1.9, 2.15), final=5e-4)


def test_the_run_does_buckle():
    assert solution(100, TIMES[0])[2] == pytest.approx(10.5, abs=0.2)
    assert solution(100, TIMES[1])[2] == pytest.approx(3.6, abs=0.1)
