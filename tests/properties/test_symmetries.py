"""Symmetries of the equations that a run must keep: to rounding, or where stated at its order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation as Turn

import stokesfibers as sf
from stokesfibers.observe import observables
from stokesfibers.observe.snapshot import Snapshot
from support import SpaceCurve, advance, assert_close, assert_order, free_end_curve

INTERVALS, STEPS, EXAMPLES = 16, 4, 12
MOBILITIES = (sf.NonLocal(), sf.NonLocal(sf.SpheroidalRegularization()), sf.LocalDrag())
ROUNDING = 1e-9
"""Fourth differences lose h^-4 = 7e4 digits of 1e-16, the systems as much again."""


class Linear:
    """U = A x + u: velocity and gradient functions of a user's flow."""

    def __init__(self, matrix: np.ndarray, uniform: np.ndarray | None = None) -> None:
        self.matrix = matrix
        self.uniform = np.zeros(3) if uniform is None else uniform

    def velocity(self, x, t):  # noqa: ARG002
        return x @ self.matrix.T + self.uniform

    def gradient(self, x, t):  # noqa: ARG002
        return np.broadcast_to(self.matrix, (*x.shape[:-1], 3, 3)).copy()

    def flow(self) -> sf.UserFlow:
        return sf.UserFlow(self.velocity, self.gradient)


def case(flow, mobility=MOBILITIES[0], intervals: int = INTERVALS) -> sf.Problem:
    engine = sf.PaperEngine(intervals=intervals, dt=0.16 / intervals, beta=20.0)
    fiber = sf.Fiber(slenderness=1e-2)
    return sf.Problem(fiber, mu_bar=2e4, flow=flow, mobility=mobility, engine=engine)


def moved(problem: sf.Problem, x: np.ndarray, steps: int = STEPS) -> tuple[np.ndarray, Snapshot]:
    """Return positions (3, node) after some steps and the snapshot there."""
    stepper, carry = advance(problem, x, steps)
    return carry.x[0], Snapshot.take(0.0, stepper.fibers, carry.positions, carry.tension)


unit = st.floats(-1.0, 1.0)
bends = st.tuples(st.floats(5.0, 25.0), st.floats(-25.0, 25.0))
vectors = st.tuples(unit, unit, unit).map(np.array)
turns = st.tuples(unit, unit, unit).map(lambda v: Turn.from_rotvec(3.0 * np.array(v)).as_matrix())
flows = st.lists(unit, min_size=8, max_size=8)
mobilities = st.sampled_from(MOBILITIES)


def curve(bend: tuple[float, float]) -> np.ndarray:
    return free_end_curve(*bend).nodes(INTERVALS)


def traceless(entries: list[float]) -> np.ndarray:
    matrix = np.array([*entries, 0.0]).reshape(3, 3)
    matrix[2, 2] = -matrix[0, 0] - matrix[1, 1]
    return matrix


@settings(max_examples=EXAMPLES)
@given(bends, flows, vectors, vectors, mobilities)
def test_translation_and_a_uniform_wind(bend, entries, shift, wind, mobility):
    """Shift the fiber and the flow's origin, and add a wind: the run is carried along."""
    x, a = curve(bend), traceless(entries)
    here, _ = moved(case(Linear(a).flow(), mobility), x)
    there, _ = moved(case(Linear(a, -a @ shift).flow(), mobility), x + shift[:, None])
    assert_close(there - shift[:, None], here, rtol=ROUNDING)
    drifting, _ = moved(case(Linear(0.0 * a, wind).flow(), mobility), x)
    still, _ = moved(case(Linear(0.0 * a).flow(), mobility), x)
    elapsed = STEPS * 0.16 / INTERVALS
    assert_close(drifting, still + elapsed * wind[:, None], rtol=ROUNDING)


@settings(max_examples=EXAMPLES)
@given(bends, flows, turns, mobilities)
def test_rotation_of_everything(bend, entries, turn, mobility):
    x, a = curve(bend), traceless(entries)
    here, plain = moved(case(Linear(a).flow(), mobility), x)
    there, turned = moved(case(Linear(turn @ a @ turn.T).flow(), mobility), turn @ x)
    assert_close(there, turn @ here, rtol=ROUNDING)
    scale = max(np.abs(plain.tension).max(), 1.0)
    assert np.abs(turned.tension - plain.tension).max() <= 1e-8 * scale
    stress = turn @ observables.extra_stress(plain) @ turn.T
    assert_close(observables.extra_stress(turned), stress, rtol=1e-8)


@settings(max_examples=EXAMPLES)
@given(bends, flows, mobilities)
def test_point_reflection_mirrors_the_run_and_keeps_the_stress(bend, entries, mobility):
    """x -> -x in a linear flow, which does not notice: even the normal stresses are the same."""
    x, flow = curve(bend), Linear(traceless(entries)).flow()
    here, plain = moved(case(flow, mobility), x)
    there, mirrored = moved(case(flow, mobility), -x)
    assert_close(there, -here, rtol=ROUNDING)
    assert_close(observables.extra_stress(mirrored), observables.extra_stress(plain), rtol=1e-8)


@settings(max_examples=EXAMPLES)
@given(bends, flows, vectors.filter(lambda v: np.linalg.norm(v) > 0.1), mobilities)
def test_reflection_in_a_plane(bend, entries, normal, mobility):
    unit_normal = normal / np.linalg.norm(normal)
    mirror = np.eye(3) - 2.0 * np.outer(unit_normal, unit_normal)
    x, a = curve(bend), traceless(entries)
    here, _ = moved(case(Linear(a).flow(), mobility), x)
    there, _ = moved(case(Linear(mirror @ a @ mirror).flow(), mobility), mirror @ x)
    assert_close(there, mirror @ here, rtol=ROUNDING)


def test_shear_of_the_package_and_a_plane_fiber_stays_in_its_plane():
    plane = SpaceCurve.from_angles(lambda s: 2.0 + 8.0 * s**3 * (1 - s) ** 3, lambda s: 0.0 * s)
    here, moment = moved(case(sf.Shear(rate=1.0)), plane.nodes(INTERVALS))
    assert np.abs(here[2]).max() == 0.0
    assert np.abs(here[1]).max() > 0.1
    assert observables.second_normal_stress_difference(moment) == pytest.approx(
        observables.extra_stress(moment)[1, 1], rel=1e-14
    )


@settings(max_examples=EXAMPLES)
@given(bends, flows)
def test_reversal_of_arclength_is_exact_with_local_drag(bend, entries):
    x, flow = curve(bend), Linear(traceless(entries)).flow()
    here, _ = moved(case(flow, sf.LocalDrag()), x)
    there, _ = moved(case(flow, sf.LocalDrag()), x[:, ::-1])
    assert_close(there[:, ::-1], here, rtol=ROUNDING)


def test_reversal_of_arclength_holds_to_better_than_second_order_with_the_non_local_tension():
    """Q_2 takes its third node from the left: the discrete equations know a direction."""
    shape, flow = free_end_curve(25.0, 15.0), sf.PlanarExtension(rate=-1.0)
    positions, tensions = [], []
    for intervals in (20, 40, 80):
        problem = case(flow, MOBILITIES[1], intervals)
        x = shape.nodes(intervals)
        here, plain = moved(problem, x, intervals // 2)
        there, reverse = moved(problem, x[:, ::-1], intervals // 2)
        positions.append(np.abs(there[:, ::-1] - here).max())
        tensions.append(
            np.abs(reverse.tension[0, ::-1] - plain.tension[0]).max() / np.abs(plain.tension).max()
        )
    # Second order would do; Q_2 from either side differs by h^3 T_sss.
    assert_order(positions, between=(2.7, 3.2), final=6e-8)
    assert_order(tensions, between=(2.7, 3.2), final=6e-6)


@settings(max_examples=EXAMPLES)
@given(
    bends,
    mobilities,
    st.floats(-7.0, 1.0),
    st.floats(-3.0, 3.0),
    st.floats(-4.0, 1.0),
)
def test_units_do_not_matter(bend, mobility, log_length, log_rate, log_viscosity):
    """The same groups in SI-like units give the same run, times and stresses scaled."""
    length, rate, mu = 10.0**log_length, 10.0**log_rate, 10.0**log_viscosity
    mu_bar = 2e4
    rigidity = 8.0 * np.pi * mu * rate * length**4 / mu_bar
    x = curve(bend)
    plain, one = moved(case(sf.Shear(rate=1.0), mobility), x)
    fiber = sf.Fiber(length=length, radius=1e-2 * length, rigidity=rigidity)
    problem = sf.Problem(
        fiber,
        viscosity=mu,
        flow=sf.Shear(rate=rate),
        mobility=mobility,
        engine=sf.PaperEngine(intervals=INTERVALS, dt=0.16 / INTERVALS / rate),
    )
    scaled, other = moved(problem, length * x)
    assert_close(scaled / length, plain, rtol=ROUNDING)
    force = rigidity / length**2
    assert_close(other.tension / force, one.tension, rtol=1e-8)
    for observable, unit_of in (
        (observables.elastic_energy, rigidity / length),
        (observables.extra_stress, force * length),
        (observables.length_error, 1.0),
        (observables.largest_curvature, 1.0 / length),
    ):
        assert_close(observable(other) / unit_of, observable(one), rtol=1e-8)
