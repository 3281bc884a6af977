"""The tension of (22) does what it is for: the velocity of the centreline does not stretch it."""

from __future__ import annotations

import numpy as np
import pytest

import stokesfibers as sf
from support import advance, assert_order, free_end_curve

GRADIENT = np.array([[0.3, 1.0, -0.4], [0.2, -0.5, 0.6], [-0.7, 0.1, 0.2]])


def velocity_function(x, t):  # noqa: ARG001
    return x @ GRADIENT.T


@pytest.mark.parametrize(
    "mobility",
    [sf.LocalDrag(), sf.NonLocal(sf.SpheroidalRegularization()), sf.NonLocal()],
    ids=("local_drag", "spheroidal", "paper"),
)
def test_velocity_of_a_bent_fiber_is_inextensible_at_second_order(mobility):
    """x_s . dv/ds, v from (20) term by term, against the largest of its three parts."""
    curve = free_end_curve()
    errors = []
    for intervals in (50, 100, 200):
        case = sf.Problem(
            sf.Fiber(slenderness=1e-2),
            mu_bar=2e3,
            flow=sf.UserFlow(velocity_function),
            mobility=mobility,
            engine=sf.PaperEngine(intervals=intervals, dt=1e-3, beta=0.0),
        )
        stepper, carry = advance(case, curve.nodes(intervals), 0)
        fiber = stepper.fibers[0]
        shape = fiber.shape(carry.x[0])
        parts = (
            case.drag * GRADIENT @ shape.x,
            fiber.tensile_velocity(shape, carry.tension[0]),
            fiber.bending_velocity(shape),
        )
        inner = slice(intervals // 10, -intervals // 10)
        stretching = [np.sum(shape.xs * fiber.derivative(v), axis=0)[inner] for v in parts]
        sizes = [np.abs(s).max() for s in stretching]
        assert min(sizes) > 0.2 * max(sizes), "all three parts must matter"
        errors.append(np.abs(sum(stretching)).max() / max(sizes))
    assert_order(errors, between=(1.9, 2.2), final=3e-4)
