"""N_1 over a half-turn in shear of fibers that interact: nothing is left unless they buckle.

A straight fiber alone has N_1(-t) = -N_1(t) about the time when it stands upright. The mirror image
of a flow of rigid fibers in shear is the same flow backwards; fibers whose middles differ along
the vorticity only are their own mirror image when upright, so that N_1 of the pair is odd however
strongly they interact. Middles in general positions break this by as much as fibers interact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import trapezoid

import stokesfibers as sf
from stokesfibers.core.arrays import Array
from stokesfibers.domain import Periodic

EPS = 1e-2
UPRIGHT = 8.0
"""Time at which a straight fiber alone stands upright; runs end at twice that."""
ANGLE = np.pi - float(np.arctan2(1.0, UPRIGHT))
RIGID, FLEXIBLE = 200.0, 8e4
"""mu_bar: a twelfth of what buckles a straight fiber, and 32 times that."""
ALONE = np.zeros((1, 3))
PAIR = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]])
CLOSE_PAIR = 0.4 * PAIR
SCATTERED = np.array([[0.0, 0.0, 0.0], [1.1, 0.5, 0.4], [2.1, -0.4, 0.7]])
PERIOD = Periodic((3.0, 0.0, 0.0))


@dataclass(frozen=True)
class HalfTurn:
    """N_1 per fiber and Sigma_12 per fiber over a run, over mu_bar; elastic energy of all."""

    time: Array
    n1: Array
    shear_stress: Array
    energy: Array

    @property
    def net(self) -> float:
        """The integral of N_1 over the integral of |N_1|."""
        return float(trapezoid(self.n1, self.time) / trapezoid(np.abs(self.n1), self.time))


def _half_turn(mu_bar: float, middles: Array, intervals: int = 28, **settings) -> HalfTurn:
    kind = sf.Fiber(slenderness=EPS, count=len(middles))
    problem = sf.Problem(
        kind,
        mu_bar=mu_bar,
        flow=sf.Shear(1.0),
        mobility=sf.NonLocal(sf.SpheroidalRegularization()),
        engine=sf.PaperEngine(intervals, dt=0.032, beta=12.0),
        **settings,
    )
    # amplitudes of either sign: fibers that buckle do so in different shapes
    shapes = tuple(
        sf.shapes.nearly_straight(kind, angle=ANGLE, amplitude=1e-2 * (-1.0) ** k, centre=middle)
        for k, middle in enumerate(middles)
    )
    record = sf.every(2.0 * UPRIGHT, observables=0.032)
    result = sf.simulate(problem, shapes, until=2.0 * UPRIGHT, record=record, threads=1)
    assert result.status.code == "done"
    seen = result.data["observables"].to_dataset()
    assert float(seen["length_error"].max()) < 5e-3
    each = mu_bar * len(middles)
    return HalfTurn(
        seen["time"].to_numpy(),
        seen["first_normal_stress_difference"].to_numpy() / each,
        seen["shear_stress"].to_numpy() / each,
        seen["elastic_energy"].sum("fiber").to_numpy(),
    )


@pytest.fixture(scope="module")
def alone() -> HalfTurn:
    return _half_turn(RIGID, ALONE)


def test_rigid_pair_leaves_nothing_though_it_interacts(alone):
    pair = _half_turn(RIGID, CLOSE_PAIR)
    assert abs(alone.net) < 2e-4
    assert abs(pair.net) < 1e-3
    # dragged along by the other one, each resists the flow less than alone
    assert 0.85 < np.abs(pair.n1).max() / np.abs(alone.n1).max() < 0.97
    assert 0.85 < pair.shear_stress.max() / alone.shear_stress.max() < 0.97
    assert pair.n1[5] < 0.0 < pair.n1[-1]


def test_pair_that_buckles_leaves_a_positive_normal_stress():
    pair = _half_turn(FLEXIBLE, PAIR)
    assert pair.energy.max() > 20.0
    assert 0.015 < pair.net < 0.05


@pytest.mark.slow
def test_rigid_fibers_leave_less_the_farther_apart_they_are(alone):
    near, far = (abs(_half_turn(RIGID, f * SCATTERED).net - alone.net) for f in (1.0, 3.0))
    assert far < 0.1 * near
    assert near < 5e-3


@pytest.mark.slow
def test_suspension_that_buckles_leaves_a_positive_normal_stress():
    rigid, flexible = (
        _half_turn(mu_bar, SCATTERED, 36, domain=PERIOD) for mu_bar in (RIGID, 1.2e5)
    )
    assert flexible.energy.max() > 30.0
    assert flexible.net > 0.02
    assert abs(rigid.net) < 0.3 * flexible.net
