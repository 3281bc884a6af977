"""Identities of the extra stress (48) and the elastic energy (49), and the balance of power."""

from __future__ import annotations

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.observe import observables
from stokesfibers.observe.snapshot import Snapshot, Surroundings
from stokesfibers.slender.discrete import DiscreteFiber
from support import advance, assert_close, assert_negligible, assert_order, free_end_curve

CURVE = free_end_curve()
TENSION = np.polynomial.Polynomial([0.0, 40.0, -90.0, 130.0, -80.0])  # zero at 0 and 1


def snapshot(intervals: int, tension, *, length: float = 1.0, rigidity: float = 1.0) -> Snapshot:
    fiber = DiscreteFiber.build(
        length, 1e-2, rigidity=rigidity, intervals=intervals, mobility=sf.LocalDrag()
    )
    positions = (length * CURVE.nodes(intervals)).T[None]
    return Snapshot.take(0.0, (fiber,), positions, tension(fiber.nodes / length)[None])


def test_curve_has_free_ends():
    ends = np.array([0.0, 1.0])
    assert np.abs(CURVE(np.linspace(0, 1, 9), 2)).max() > 1.0
    assert_negligible(CURVE(ends, 2), scale=1.0, rtol=1e-10)
    assert_negligible(CURVE(ends, 3), scale=1.0, rtol=1e-8)
    assert TENSION(0.0) == TENSION(1.0) == 0.0


def test_trace_of_the_bending_stress_is_twice_the_elastic_energy():
    moment = snapshot(30, lambda s: 0.0 * s, length=2.0, rigidity=3.0)
    trace = np.trace(observables.fiber_stress(moment)[0])
    assert trace == pytest.approx(2.0 * observables.elastic_energy(moment)[0], rel=1e-14)
    exact = snapshot(400, lambda s: 0.0 * s, length=2.0, rigidity=3.0)
    assert trace == pytest.approx(np.trace(observables.fiber_stress(exact)[0]), rel=0.02)


def test_energy_and_tensile_stress_converge_to_their_integrals():
    s, w = np.polynomial.legendre.leggauss(40)
    s, w = 0.5 * (s + 1.0), 0.5 * w
    energy = 0.5 * np.sum(CURVE(s, 2) ** 2, axis=0) @ w
    stress = np.einsum("n,in,jn->ij", w * TENSION(s), CURVE(s, 1), CURVE(s, 1))
    stress += np.einsum("n,in,jn->ij", w, CURVE(s, 2), CURVE(s, 2))
    errors = []
    for intervals in (25, 50, 100):
        moment = snapshot(intervals, TENSION)
        found = observables.fiber_stress(moment)[0]
        errors.append(
            [
                abs(observables.elastic_energy(moment)[0] / energy - 1.0),
                np.abs(found - stress).max() / np.abs(stress).max(),
            ]
        )
    for column, final in zip(np.array(errors).T, (4e-4, 4e-4), strict=True):
        assert_order(column, between=(1.9, 2.1), final=final)


def test_printed_form_of_48_converges_to_the_symmetric_one():
    differences, lopsided = [], []
    for intervals in (100, 200, 400):
        moment = snapshot(intervals, TENSION)
        weak = observables.fiber_stress(moment)[0]
        direct = observables.fiber_stress_direct(moment)[0]
        scale = np.linalg.norm(weak)
        assert_negligible(weak - weak.T, scale=scale, rtol=1e-15)
        differences.append(np.linalg.norm(direct - weak) / scale)
        lopsided.append(np.linalg.norm(direct - direct.T) / scale)
    assert_order(differences, between=(1.7, 2.1), final=9e-5)
    assert_order(lopsided, between=(1.6, 2.1), final=9e-5)


def test_tension_pulls_with_a_positive_first_normal_stress_difference():
    """A straight fiber stretched along x: Sigma_11 = int T ds."""
    fiber = DiscreteFiber.build(1.0, 1e-2, rigidity=1.0, intervals=20, mobility=sf.NonLocal())
    s = fiber.nodes
    positions = np.stack([s - 0.5, 0.0 * s, 0.0 * s], axis=1)[None]
    moment = Snapshot.take(0.0, (fiber,), positions, (s * (1.0 - s))[None])
    stress = observables.extra_stress(moment)
    area = fiber.grid.weights @ (s * (1.0 - s))
    assert_close(stress, np.diag([area, 0.0, 0.0]), atol=1e-12)
    assert observables.first_normal_stress_difference(moment) == pytest.approx(area)
    assert observables.fiber_stress_direct(moment)[0, 0, 0] == pytest.approx(1 / 6, abs=2e-3)


def _askew(surroundings=None) -> Snapshot:
    """A straight fiber of length 2 along (2, 3, 6) / 7 from (1, -1, 0.5), with T = s (2 - s)."""
    fiber = DiscreteFiber.build(2.0, 1e-2, rigidity=1.0, intervals=200, mobility=sf.LocalDrag())
    s = fiber.nodes
    x = np.array([1.0, -1.0, 0.5]) + s[:, None] * np.array([2.0, 3.0, 6.0]) / 7.0
    return Snapshot.take(0.0, (fiber,), x[None], (s * (2.0 - s))[None], surroundings=surroundings)


def test_parts_of_the_stress_of_a_fiber_askew():
    """Sigma = p p int T ds with int T ds = 4/3, all its entries different."""
    moment, pull = _askew(), 4.0 / 3.0 / 49.0
    for observable, expected in (
        (observables.first_normal_stress_difference, 4.0 - 9.0),
        (observables.second_normal_stress_difference, 9.0 - 36.0),
        (observables.shear_stress, 6.0),
    ):
        assert float(observable(moment)) == pytest.approx(expected * pull, rel=1e-4)


def test_where_a_fiber_askew_is_and_points():
    moment, along = _askew(), 2.0 * np.array([[2.0, 3.0, 6.0]]) / 7.0
    assert_close(observables.end_to_end(moment), along, rtol=1e-12)
    middle = np.array([[1.0, -1.0, 0.5]]) + 0.5 * along
    assert_close(observables.centre(moment), middle, rtol=1e-12)


def test_a_load_adds_its_virial_about_the_centre():
    """g = (0, 0, y - y_c) has -int g (y - y_c) ds = -(3/7)^2 L^3 / 12 in Sigma_32; f is f_e - g."""
    middle = -1.0 + 3.0 / 7.0
    load = sf.UserLoad(lambda x, t: (x[:, 1:2] - middle) * [0.0, 0.0, 1.0])  # noqa: ARG005
    loaded, plain = _askew(Surroundings(load=load)), _askew()
    added = observables.extra_stress(loaded) - observables.extra_stress(plain)
    size = -(8.0 / 12.0) * np.array([2.0, 3.0, 6.0]) / 7.0 * 3.0 / 7.0
    expected = np.zeros((3, 3))
    expected[2] = size
    assert_close(added, expected, rtol=1e-4)


@pytest.mark.parametrize("mobility", [sf.NonLocal(sf.SpheroidalRegularization()), sf.LocalDrag()])
def test_power_of_the_flow_is_stored_or_dissipated(mobility):
    """Sigma : grad U = dE/dt + (1 / 8 pi mu) int f . (Lambda + K) f ds, at second order."""
    flow = sf.PlanarExtension(rate=-1.0)
    start = free_end_curve(8.0, 5.0)
    gradient = np.diag([-1.0, 1.0, 0.0])
    errors = []
    for intervals in (20, 40, 80):
        case = sf.Problem(
            sf.Fiber(slenderness=1e-2),
            mu_bar=4e3,
            flow=flow,
            mobility=mobility,
            engine=sf.PaperEngine(intervals=intervals, dt=0.2 / intervals),
        )
        stepper, carry = advance(case, start.nodes(intervals), 0)
        fiber = stepper.fibers[0]
        energies, gains = [], []
        for step in range(2 * intervals + 1):
            if step:
                carry, _ = stepper.step(carry)
            moment = Snapshot.take(0.0, stepper.fibers, carry.positions, carry.tension)
            shape, tension = moment.shapes[0], carry.tension[0]
            force = shape.xssss - fiber.tensile_force(shape, tension)
            # -(Lambda + K) f, 8 pi mu times the velocity through the fluid
            moved = fiber.bending_velocity(shape) + fiber.tensile_velocity(shape, tension)
            lost = -np.sum(force * moved, axis=0) @ fiber.grid.weights / case.drag
            power = np.sum(observables.fiber_stress(moment)[0] * gradient)
            assert lost > 0.0
            energies.append(observables.elastic_energy(moment)[0])
            gains.append(power - lost)
        start_at = intervals // 2  # after the first moments, when the ends settle
        late = np.array(gains[start_at:])
        work = (late.sum() - 0.5 * (late[0] + late[-1])) * 0.2 / intervals
        errors.append(abs(work - (energies[-1] - energies[start_at])) / max(energies))
    assert_order(errors, between=(2.0, 2.5), final=6e-3)
