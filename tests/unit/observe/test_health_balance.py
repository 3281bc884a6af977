"""Net force and torque of a fiber, and the balance of power, against what is known exactly."""

from __future__ import annotations

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.domain import Free
from stokesfibers.load import Gravity
from stokesfibers.numerics.chebyshev import ChebyshevGrid
from stokesfibers.observe.balance import (
    Motion,
    _derivative,
    elastic_force,
    force_error,
    torque_error,
)
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.run import health_motion
from stokesfibers.run.health_motion import balance_of
from stokesfibers.run.health_nodes import MoreNodes
from stokesfibers.run.moment import snapshot
from stokesfibers.run.start import first_carry
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.spectral_forces import resisted_forces
from stokesfibers.stepping.engines import stepper_of
from support import assert_close, free_end_curve

SPECTRAL = sf.SpectralEngine(nodes=32, rtol=1e-6)
PAPER = sf.PaperEngine(intervals=100, dt=1e-3, beta=20.0)


def _after(problem, curve, steps):
    """Return stepper and carry after some steps."""
    stepper = stepper_of(problem, threads=1)
    carry = first_carry(stepper, curve)
    for _ in range(steps):
        carry, _ = stepper.step(carry)
    return stepper, carry


def _bent(engine, count=1, **changes):
    arguments = {"mu_bar": 2e4, "flow": sf.Shear(1.0), "engine": engine} | changes
    fiber = sf.Fiber(slenderness=1e-2, count=count)
    return sf.Problem(fiber, **arguments), free_end_curve().nodes(60).T[None]


def _on_grid(curve, tension, intervals):
    fiber = DiscreteFiber.build(
        1.0, 1e-2, rigidity=2.0, intervals=intervals, mobility=sf.LocalDrag()
    )
    points = curve(fiber.nodes).T[None]
    return Snapshot.take(0.0, (fiber,), points, tension(fiber.nodes)[None])


def test_free_ends_balance_up_to_the_grid_error():
    """With T = 0 and free ends the exact force and torque vanish; differences err by h^2."""
    curve = free_end_curve()
    moments = [_on_grid(curve, lambda s: 80.0 * s * (1.0 - s), n) for n in (100, 200)]
    for error in (force_error, torque_error):
        coarse, fine = (float(error(moment)[0]) for moment in moments)
        assert 1e-7 < fine < 5e-3
        assert coarse > 1.7 * fine


def test_the_elastic_force_is_that_of_the_curve():
    """f_e = E x_ssss - T_s x_s - T x_ss with E = 2, away from the ends to the grid's error."""
    curve, tension = free_end_curve(), np.polynomial.Polynomial([0.0, 110.0, -190.0, 80.0])
    moment = _on_grid(curve, tension, 400)
    inner = slice(20, -20)
    s = moment.fibers[0].grid.nodes[inner]
    bending, pull = 2.0 * curve(s, 4), tension(s) * curve(s, 2) + tension.deriv()(s) * curve(s, 1)
    assert 0.3 < np.abs(pull).max() / np.abs(bending).max() < 3.0
    assert_close(elastic_force(moment)[0][:, inner], bending - pull, rtol=2e-3)


def test_slopes_on_the_points_that_the_spectral_engine_shows():
    grid = ChebyshevGrid(2.0, 8)
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.7, 3.0])
    assert_close(_derivative(grid) @ cubic(grid.nodes), cubic.deriv()(grid.nodes), rtol=1e-12)


def test_torque_is_about_the_centre():
    """With a net force it would depend on the origin otherwise."""
    curve, tension = free_end_curve(), np.polynomial.Polynomial([0.0, 30.0])
    here = _on_grid(curve, tension, 100)
    moved = _on_grid(lambda s: curve(s) + np.array([[5.0], [-3.0], [2.0]]), tension, 100)
    assert float(force_error(here)[0]) > 1e-2
    assert_close(torque_error(moved), torque_error(here), rtol=1e-8)


def test_parts_of_a_balance():
    """By hand: two fibers of lengths 1 and 2 with constant forces that move along x and y."""
    weights = np.array([[0.25, 0.5, 0.25], [0.5, 1.0, 0.5]])
    one = np.ones((2, 3, 3))
    motion = Motion(0.5, 5.0 * one, 2.0 * one, 0.75 * one, 0.5 * one, weights)
    turning = np.zeros((2, 3, 3))
    turning[0, 1] = [-1.0, 0.0, 1.0]  # mean square 1/2 along the fiber
    balance = motion.balance(0.5 * one + turning, 7.0)
    length = 3.0
    assert balance.dissipation == pytest.approx(3.0 * (5.0 - 2.0) * (0.75 - 0.5) * length)
    assert balance.flow_power == pytest.approx(3.0 * (5.0 - 2.0) * 0.75 * length)
    assert balance.load_power == pytest.approx(3.0 * 2.0 * 0.5 * length)
    expected = 7.0 + balance.dissipation - balance.flow_power - balance.load_power
    assert balance.residual == pytest.approx(expected)
    assert balance.defect == pytest.approx(np.sqrt(0.5))
    assert balance.pace == pytest.approx(np.sqrt(0.5)), "without the mean"
    assert balance.speed == pytest.approx(np.sqrt(0.5 + 3.0 * (0.5 - 0.75) ** 2)), "less the flow"


def test_an_end_under_tension_is_seen():
    """T(L) = 30 pulls with 30: the net force over int |f| ds."""
    moment = _on_grid(free_end_curve(), lambda s: 30.0 * s, 200)
    force = moment.integrate(np.linalg.norm(elastic_force(moment), axis=1))[0]
    assert float(force_error(moment)[0]) == pytest.approx(30.0 / force, rel=0.05)
    assert float(torque_error(moment)[0]) > 1e-2


def test_both_engines_see_the_same_elastic_force():
    found = []
    for engine in (SPECTRAL, PAPER):
        stepper, carry = _after(*_bent(engine), 0)
        moment = snapshot(stepper, carry)
        force = np.linalg.norm(elastic_force(moment), axis=1)
        found.append(moment.integrate(force)[0])
    assert_close(found[0], found[1], rtol=0.02)


@pytest.mark.parametrize("engine", [SPECTRAL, PAPER], ids=["spectral", "paper"])
def test_a_straight_fiber_dissipates_what_the_flow_gives(engine):
    """With the tension (44) and f = -(T x_s)_s the power of the flow is, by parts,

    int f . U_0 = int T x_s . grad U_0 x_s = rate sin(theta) cos(theta) int T ds, with
    int T ds = -(mu_bar / 8) sin(2 theta) / (c + 2) / 6.
    """
    angle, mu_bar, eps = 2.0, 50.0, 1e-3
    problem = sf.Problem(
        sf.Fiber(slenderness=eps),
        mu_bar=mu_bar,
        flow=sf.Shear(1.0),
        engine=engine,
        mobility=sf.NonLocal(sf.NoRegularization()) if engine is PAPER else sf.NonLocal(),
    )
    stepper, carry = _after(problem, sf.shapes.straight(problem.fibers[0], angle=angle), 3)
    balance = balance_of(stepper, 1)(carry)
    c = np.log(eps**2 * np.e)
    turned = np.arctan2(1.0, 1.0 / np.tan(angle) + stepper.time(carry))  # (45)
    pull = -mu_bar / 8.0 * np.sin(2.0 * turned) / (c + 2.0) / 6.0
    exact = np.sin(turned) * np.cos(turned) * pull
    assert_close(balance.flow_power, exact, rtol=2e-3 if engine is PAPER else 5e-2)
    assert_close(balance.dissipation, balance.flow_power, rtol=1e-3)
    assert abs(balance.elastic_rate) < 1e-6 * exact


@pytest.mark.parametrize(
    ("engine", "share"), [(SPECTRAL, 1e-4), (PAPER, 5e-3)], ids=["spectral", "paper"]
)
@pytest.mark.parametrize("weight", [0.0, 100.0])
def test_power_balances_while_a_fiber_bends(engine, share, weight):
    load = {"load": Gravity((0.0, -weight, 0.0)), "domain": Free()} if weight else {}
    stepper, carry = _after(*_bent(engine, **load), 40)
    balance = balance_of(stepper, 1)(carry)
    size = abs(balance.flow_power) + abs(balance.load_power) + abs(balance.elastic_rate)
    assert abs(balance.elastic_rate) > 2.0 * share * size
    assert (abs(balance.load_power) > 0.01 * size) == (weight > 0.0)
    assert abs(balance.residual) < share * size
    assert balance.defect < 10.0 * share * balance.pace
    falls = np.sqrt(balance.speed**2 - balance.pace**2)  # about |c| g / (8 pi mu) = 0.04 to 0.08
    assert (0.04 < falls < 0.08) if weight else falls < 0.02


@pytest.mark.parametrize("kind", ["spectral", "paper"])
def test_balances_do_not_depend_on_units(kind):
    """The same run of a longer, stiffer fiber in a slower flow, powers in units of E rate / L."""

    def weighed(length, rigidity, rate):
        if kind == "spectral":
            engine = sf.SpectralEngine(nodes=24, dt=0.02 / rate, order=2)
        else:
            engine = sf.PaperEngine(intervals=40, dt=0.01 / rate, beta=20.0 * rate)
        weight = 100.0 * rigidity / length**3
        problem = sf.Problem(
            sf.Fiber(slenderness=1e-2, length=length, rigidity=rigidity),
            mu_bar=2e4 / rate,  # 8 pi mu L^4 / E, a time
            flow=sf.Shear(rate),
            engine=engine,
            load=Gravity((0.0, -weight, 0.0)),
        )
        stepper, carry = _after(problem, length * free_end_curve().nodes(60).T[None], 8)
        found, moment = balance_of(stepper, 1)(carry), snapshot(stepper, carry)
        power = rigidity / length * rate
        parts = found.elastic_rate, found.dissipation, found.flow_power, found.load_power
        numbers = [part / power for part in parts] + [found.pace / rate]
        if kind == "paper":  # with the other these are small
            numbers += [found.defect / rate, force_error(moment)[0], torque_error(moment)[0]]
        return np.array(numbers)

    one, other = weighed(1.0, 1.0, 1.0), weighed(2.0, 3.0, 0.5)
    assert np.abs(one).min() > 1e-6
    assert_close(other / one, np.ones(one.shape), rtol=1e-5)


@pytest.mark.parametrize(
    ("engine", "share", "off"),
    [
        (sf.SpectralEngine(nodes=24, dt=5e-3, order=3), 1e-5, 1e-5),
        (sf.PaperEngine(intervals=50, dt=2e-3, beta=20.0), 1e-2, 1e-3),
    ],
    ids=["spectral", "paper"],
)
def test_power_balances_between_two_fibers(engine, share, off):
    problem, one = _bent(engine, count=2)
    both = np.concatenate([one, one + np.array([0.05, 0.1, 0.12])])
    stepper, carry = _after(problem, both, 16)
    balance = balance_of(stepper, 1)(carry)
    size = abs(balance.flow_power) + abs(balance.dissipation)
    assert abs(balance.residual) < share * size
    assert balance.defect < off * balance.pace


def test_the_operator_on_more_nodes_takes_the_place_of_the_run_s_own(monkeypatch):
    """If it makes up for what the run's motion is off, nothing is left; sign and drag count."""
    problem, curve = _bent(SPECTRAL)
    stepper, carry = _after(problem, curve, 4)
    own = {}
    monkeypatch.setattr(health_motion, "resisted_forces", _kept(resisted_forces, own))
    monkeypatch.setattr(MoreNodes, "lasting", lambda _, off, *_rest: own.setdefault("off", off))
    unit = problem.fibers[0].rigidity
    monkeypatch.setattr(MoreNodes, "resisted", lambda *_: unit * own["found"])
    assert balance_of(stepper, 1)(carry).defect > 0.0
    made_up = unit * own["found"] - problem.drag * own["off"]
    monkeypatch.setattr(MoreNodes, "resisted", lambda *_: made_up)
    monkeypatch.setattr(MoreNodes, "lasting", lambda _, off, *_rest: off)
    assert balance_of(stepper, 1)(carry).defect < 1e-9 * np.abs(own["off"]).max()


def _kept(function, into):
    def called(*arguments):
        into["found"] = function(*arguments)
        return into["found"]

    return called
