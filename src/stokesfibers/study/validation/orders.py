"""Orders of convergence of both engines, in space and in time, from short runs of a bent fiber.

A finding holds the order between the last two resolutions; a second one the last error itself, so
that an order of something that is wrong by a constant does not pass.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import Polynomial

from stokesfibers.core.arrays import Array, Points
from stokesfibers.experiments.base import Settings
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.numerics.step_control import FixedSteps
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import SpheroidalRegularization
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.stepping.paper import PaperStepper
from stokesfibers.stepping.spectral import SpectralStepper
from stokesfibers.study.validation.record import Entry, Finding

_EPS = 1e-2
_UNTIL = 1.5
_STEPS = (0.06, 0.03)
_FINE = (0.005, 5)
_NODES = 36
_POINTS = np.linspace(0.0, 1.0, 31)
_MILDER = 30.0  # bend of the paper's runs, whose first, implicit Euler step sharper ones show
_BANDS = {1: (0.8, 1.2), 2: (1.7, 2.3), 3: (2.6, 3.6), 4: (3.4, 4.9), 5: (4.2, 6.8)}
"""What the order between two steps may be, by the order of the formula."""
_LAST = {1: 3e-2, 2: 5e-4, 3: 2e-5, 4: 8e-7, 5: 9e-8}
"""What the error of the tension at the shorter step may be, by the order of the formula."""
NON_LOCAL = NonLocal(SpheroidalRegularization())


def bent(sigma: Array, bend: float = 90.0) -> Points:
    """Return points of a curve in space with free ends, x_ss = x_sss = 0, by arclength in [0, 1].

    The angles of its tangent are polynomials whose first and second derivatives vanish at the ends.
    """
    rise = Polynomial([0.0, 0.0, 0.0, 1.0 / 3.0, -0.5, 0.2])
    skew = Polynomial([0.0, 0.0, 0.0, 0.0, 0.25, -0.4, 1.0 / 6.0])
    turn, lift = 0.3 + bend * rise + 10.0 * skew, 0.1 + 18.0 * rise - 21.0 * skew
    z, w = np.polynomial.legendre.leggauss(40)
    s = 0.5 * sigma[:, None] * (z + 1.0)
    flat = np.cos(lift(s))
    tangent = np.stack([np.cos(turn(s)) * flat, np.sin(turn(s)) * flat, np.sin(lift(s))], axis=-1)
    return 0.5 * sigma[:, None] * np.einsum("q,nqi->ni", w, tangent)


@cache
def high_order(nodes: int, step: float, order: int) -> tuple[Array, Array]:
    """Return shape (3, point) and tension at the end of a run with fixed steps."""
    fiber = SpectralFiber.build(1.0, _EPS, rigidity=1.0, nodes=nodes, mobility=NON_LOCAL)
    control = FixedSteps(step, order)
    stepper = SpectralStepper((fiber,), drag=1e5, flow=Shear(1.0), control=control, threads=1)
    carry = stepper.init((bent,))
    while carry.time < _UNTIL:
        carry, _ = stepper.step(carry)
    state = stepper.interpolate(carry, _UNTIL)
    return fiber.position(state.modes[0], _POINTS), fiber.tension(state.tensions[0], _POINTS)


def by_paper(intervals: int, dt: float, until: float = 0.48) -> Array:
    """Return positions at the nodes (3, node) at the end of a run by the paper's scheme."""
    engine = PaperEngine(intervals=intervals, dt=dt, beta=20.0)
    fiber = Fiber(slenderness=_EPS)
    problem = Problem(fiber, mu_bar=3e4, flow=Shear(1.0), mobility=NON_LOCAL, engine=engine)
    stepper = PaperStepper(problem, 1)
    places = np.linspace(0.0, 1.0, intervals + 1)
    carry = stepper.init(bent(places, _MILDER)[None])
    for _ in range(round(until / dt)):
        carry, _ = stepper.step(carry)
    return carry.x[0]


def _found(
    name: str, errors: list[float], band: tuple[float, int, float], last: float
) -> list[Finding]:
    """Return findings of the order between the last two errors, in a band, and of the last one."""
    low, stated, high = band
    order = float(np.log2(errors[-2] / errors[-1]))
    return [
        Finding(f"order, {name}", order, f"order {stated}", low, high),
        Finding(f"error, {name}", errors[-1], None, None, last),
    ]


def _time(_: Settings) -> Iterator[Finding]:
    exact = high_order(_NODES, *_FINE)[1]
    scale = np.abs(exact).max()
    for order, band in _BANDS.items():
        found = [high_order(_NODES, step, order)[1] for step in _STEPS]
        errors = [float(np.abs(tension - exact).max() / scale) for tension in found]
        name = f"tension, formula of order {order}, dt = {_STEPS[-1]}"
        yield from _found(name, errors, (band[0], order, band[1]), _LAST[order])


def _nodes(_: Settings) -> Iterator[Finding]:
    fine = high_order(64, 0.05, 4)[0]
    counts = (16, 24, 32)
    errors = [float(np.abs(high_order(n, 0.05, 4)[0] - fine).max()) for n in counts]
    words = "faster than any power of the nodes"
    for k in (0, 1):
        quantity = f"shape error falls by, {counts[k]} to {counts[k + 1]} nodes"
        yield Finding(quantity, errors[k] / errors[k + 1], words, 20.0, None)
    yield Finding("shape error over length, 32 nodes", errors[-1], None, None, 1.5e-6)


def _paper_time(_: Settings) -> Iterator[Finding]:
    exact = by_paper(20, 0.48 / 1920)
    steps = (120, 240)
    errors = [float(np.linalg.norm(by_paper(20, 0.48 / n) - exact, axis=0).max()) for n in steps]
    yield from _found(
        "positions, paper's scheme, dt = 0.002, N = 20", errors, (1.85, 2, 2.2), 1.4e-6
    )


def _paper_space(_: Settings) -> Iterator[Finding]:
    """Differences of consecutive grids, each twice the one before, at one short step."""
    counts = (20, 40, 80, 160)
    found = [by_paper(n, 0.004, 0.12)[:, :: n // 20] for n in counts]
    apart = [float(np.linalg.norm(one - other, axis=0).mean()) for one, other in pairwise(found)]
    name = "positions, paper's scheme, N = 40, 80, 160"
    yield from _found(name, apart, (1.7, 2, 2.4), 4e-5)


ENTRIES = (
    Entry("order-time", "orders", "High-order engine in time", "formulas of order 1 to 5", _time),
    Entry("order-nodes", "orders", "High-order engine in nodes", "Legendre modes", _nodes),
    Entry("order-paper-time", "orders", "Paper's scheme in time", "BDF2, (29)", _paper_time),
    Entry("order-paper-space", "orders", "Paper's scheme in space", "Section 3", _paper_space),
)
