"""Drag of Section 4.1 with the errata, against the exact prolate spheroid, and Jeffery's period."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import stokesfibers as sf
from stokesfibers.slender.discrete import DiscreteFiber
from support import assert_close, assert_negligible, assert_order

# r, exact along, slender body along, exact across, slender body across: F / (mu U b)
TABLE = np.array(
    [
        [10, 49.897338, 50.351437, 71.845619, 71.895498],
        [20, 78.632028, 78.813707, 119.979717, 119.997443],
        [100, 261.866368, 261.891193, 433.447004, 433.448872],
        [1000, 1769.684707, 1769.686415, 3102.461803, 3102.461899],
    ]
)
PERIODS = {10: 63.46017, 20: 125.97787, 50: 314.28493, 100: 628.38136}
DIRECTION = np.array([2.0, -1.0, 2.0]) / 3.0
ACROSS = np.array([1.0, 2.0, 0.0]) / np.sqrt(5.0)


def exact_drag(r: float) -> tuple[float, float]:
    """Return F / (mu U b) of a prolate spheroid along and across its axis (Kim & Karrila)."""
    e = np.sqrt(1.0 - r**-2)
    log = np.log((1.0 + e) ** 2 * r**2)  # log((1 + e) / (1 - e)) without cancellation
    along = 8.0 / 3.0 * e**3 / (-2.0 * e + (1.0 + e**2) * log)
    across = 16.0 / 3.0 * e**3 / (2.0 * e + (3.0 * e**2 - 1.0) * log)
    return 6.0 * np.pi * r * along, 6.0 * np.pi * r * across


def resistance(eps: float, regularization, intervals: int = 24) -> np.ndarray:
    """Return the force per velocity of a straight fiber of length 1 in fluid of viscosity 1.

    The discrete operator Lambda + K_delta is inverted for a uniform velocity along each axis.
    """
    fiber = DiscreteFiber.build(
        1.0, eps, rigidity=1.0, intervals=intervals, mobility=sf.NonLocal(regularization)
    )
    shape = fiber.shape(np.outer(DIRECTION, np.linspace(-0.5, 0.5, intervals + 1)))
    size = 3 * (intervals + 1)
    columns = []
    for unit in np.eye(size).reshape(size, 3, -1):
        along = np.sum(shape.xs * unit, axis=0)
        local = fiber.local.a * unit + fiber.local.b * shape.xs * along
        columns.append((local + fiber.finite_part(shape, unit)).ravel())
    operator = np.array(columns).T
    velocity = np.repeat(np.eye(3), intervals + 1, axis=1).reshape(3, size)
    density = np.linalg.solve(operator, 8.0 * np.pi * velocity.T).reshape(3, intervals + 1, 3)
    return np.einsum("inj,n->ij", density, fiber.grid.weights)


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"r={row[0]:g}")
@pytest.mark.parametrize(
    "regularization", [sf.SpheroidalRegularization(), sf.NoRegularization()], ids=lambda r: r.kind
)
def test_drag_of_a_straight_fiber_is_that_of_the_table(row, regularization):
    r, exact_along, along, exact_across, across = row
    eps = 0.5 / r
    found = resistance(eps, regularization, 12) * 2.0 * r  # per b, with L = 2 r b = 1
    c = np.log(eps**2 * np.e)
    assert_close(found, found.T, atol=1e-9 * across)
    assert DIRECTION @ found @ DIRECTION == pytest.approx(along, abs=1e-6)
    assert ACROSS @ found @ ACROSS == pytest.approx(across, abs=1e-6)
    assert_negligible(ACROSS @ found @ DIRECTION, scale=across, rtol=1e-10)
    assert along == pytest.approx(8.0 * np.pi * 2.0 * r / (-2.0 * c), abs=1e-6)
    assert across == pytest.approx(8.0 * np.pi * 2.0 * r / (2.0 - c), abs=1e-6)
    # The printed coefficients with log(1/eps), normalised by half the length (errata).
    normalised = found / (6.0 * np.pi * r)
    log = np.log(1.0 / eps)
    expected = (2.0 / 3.0 / (log - 0.5), 4.0 / 3.0 / (log + 0.5))
    assert DIRECTION @ normalised @ DIRECTION == pytest.approx(expected[0], rel=1e-10)
    assert ACROSS @ normalised @ ACROSS == pytest.approx(expected[1], rel=1e-10)
    assert exact_drag(r) == pytest.approx((exact_along, exact_across), abs=1e-6)


def test_drag_error_falls_as_eps_squared_log():
    """Relative error about 3.7 eps^2 along; across, eps^2 over a logarithm, hence above 2."""
    ratios = np.array([10.0, 20.0, 40.0, 80.0, 160.0])
    found = [resistance(0.5 / r, sf.PaperRegularization(), 8) * 2.0 * r for r in ratios]
    along = [
        DIRECTION @ f @ DIRECTION / exact_drag(r)[0] - 1.0
        for f, r in zip(found, ratios, strict=True)
    ]
    across = [
        ACROSS @ f @ ACROSS / exact_drag(r)[1] - 1.0 for f, r in zip(found, ratios, strict=True)
    ]
    assert_order(along, between=(1.97, 2.0), final=4e-5)
    assert_order(across, between=(2.1, 2.25), final=1.6e-6)


@pytest.mark.parametrize(("r", "period"), PERIODS.items())
def test_period_of_jefferys_orbit(r, period):
    """Integrate (46) over one turn with 2 eps in place of eps, eps = 1 / (2 r)."""
    two_eps = 1.0 / r

    def time_per_angle(angle):
        return (1.0 + two_eps**2) / (np.sin(angle) ** 2 + two_eps**2 * np.cos(angle) ** 2)

    turn = 4.0 * quad(time_per_angle, 0.0, 0.5 * np.pi, epsrel=1e-12, limit=200)[0]
    assert turn == pytest.approx(period, abs=6e-6)
    assert turn == pytest.approx(2.0 * np.pi * (r + two_eps), rel=1e-10)
