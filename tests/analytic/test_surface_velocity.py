"""The fluid velocity (5) on the fiber's surface against the fiber's own velocity (2).

The constant doublet weight eps^2/2 of (5) is that of a cylinder of radius eps. On the surface
r(s) = 2 eps sqrt(s (1 - s)) it therefore meets (2) point by point at mid-length only, where
r = eps. Elsewhere the mismatch 2 n n . f (1 - eps^2 / r^2) averages out around the fiber.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

import stokesfibers as sf
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.observe.velocity import fluid_velocity
from stokesfibers.stepping.paper import PaperStepper

INTERVALS = 200


def _bent_points() -> np.ndarray:
    s = np.linspace(0.0, 1.0, 2001)
    turn = cumulative_simpson(2.0 * 256.0 * (s * (1.0 - s)) ** 4, x=s, initial=0.0)
    planar = [cumulative_simpson(f(turn), x=s, initial=0.0) for f in (np.cos, np.sin)]
    return np.stack([*planar, 0.0 * s], axis=-1)[::20]


def _mismatch(eps: float) -> tuple[float, float, float]:
    """Return the largest mismatch at mid-length, of the mean around the fiber, and at a quarter."""
    fiber = sf.Fiber(slenderness=eps)
    problem = sf.Problem(
        fiber,
        mu_bar=1e3,
        flow=sf.Shear(1.0),
        mobility=sf.NonLocal(sf.SpheroidalRegularization()),
        engine=sf.PaperEngine(INTERVALS, dt=1e-3),
    )
    stepper = PaperStepper(problem)
    curve = sf.shapes.through_points(_bent_points())
    start = curve.at_fractions(np.linspace(0.0, 1.0, INTERVALS + 1))[None]
    carry = stepper.init(start)
    snapshot = Snapshot.take(0.0, stepper.fibers, carry.positions, carry.tension)
    discrete, shape = stepper.fibers[0], snapshot.shapes[0]
    own = (carry.slow[0] + discrete.bending_velocity(shape)) / problem.drag
    places = np.array([50, 80, 100, 120, 150])
    s = discrete.nodes[places]
    radius = 2.0 * eps * np.sqrt(s * (1.0 - s))
    tangent = shape.xs[:, places].T
    normal = np.stack([-tangent[:, 1], tangent[:, 0], 0.0 * s], axis=-1)
    differences = []
    for angle in np.arange(8) * np.pi / 4.0:
        outward = np.cos(angle) * np.array([0.0, 0.0, 1.0]) + np.sin(angle) * normal
        points = shape.x[:, places].T + radius[:, None] * outward
        differences.append(fluid_velocity(problem, snapshot, points) - own[:, places].T)
    found = np.array(differences) / np.abs(own).max()
    return (
        float(np.abs(found[:, 2]).max()),
        float(np.abs(found.mean(axis=0)).max()),
        float(np.abs(found[:, 0]).max()),
    )


@pytest.fixture(scope="module")
def mismatches() -> np.ndarray:
    return np.array([_mismatch(eps) for eps in (4e-2, 2e-2, 1e-2)])


def test_surface_velocity_meets_the_fiber_at_mid_length_to_order_eps(mismatches):
    orders = np.log2(mismatches[:-1, 0] / mismatches[1:, 0])
    assert orders.min() > 0.9
    assert mismatches[-1, 0] < 0.025


def test_surface_velocity_averaged_around_the_fiber_meets_it_to_order_eps(mismatches):
    orders = np.log2(mismatches[:-1, 1] / mismatches[1:, 1])
    assert orders.min() > 0.9
    assert mismatches[-1, 1] < 0.008


def test_constant_doublet_weight_leaves_an_angular_mismatch_away_from_mid_length(mismatches):
    assert mismatches[-1, 2] > 0.01


def test_velocity_inside_a_fiber_is_not_a_number_and_far_away_is_the_flow():
    fiber = sf.Fiber(slenderness=1e-2)
    problem = sf.Problem(fiber, mu_bar=1e3, flow=sf.Shear(1.0), engine=sf.PaperEngine())
    stepper = PaperStepper(problem)
    start = sf.shapes.straight(fiber, angle=0.7).at_fractions(np.linspace(0.0, 1.0, 101))
    carry = stepper.init(start[None])
    snapshot = Snapshot.take(0.0, stepper.fibers, carry.positions, carry.tension)
    assert np.isnan(fluid_velocity(problem, snapshot, np.array([1e-3, 0.0, 0.0]))).all()
    far = np.array([[[0.0, 200.0, 0.0]], [[30.0, 40.0, 100.0]]])
    found = fluid_velocity(problem, snapshot, far)
    assert found.shape == far.shape
    # force-free: the disturbance decays as 1/R^2
    assert np.abs(found - problem.flow.velocity(far, 0.0)).max() < 1e-4
    with pytest.raises(sf.InputError, match="points"):
        fluid_velocity(problem, snapshot, np.zeros((4, 2)))
