"""Velocities against formulas written out by hand, gradients against differences of them."""

# The formulas take (x, y, z, t) whether they use them or not.
# ruff: noqa: ARG005

from __future__ import annotations

import json
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.testing import assert_allclose, assert_array_equal

from stokesfibers.flow import (
    FLOWS,
    AbstractFlow,
    Extension,
    NoFlow,
    OscillatoryShear,
    PlanarExtension,
    Rotation,
    Shear,
    SumOfFlows,
    TimeDependentShear,
    Uniform,
    UserFlow,
    to_dict,
)

Formula = Callable[[float, float, float, float], tuple[float, float, float]]


def cubic(points: np.ndarray, t: float) -> np.ndarray:
    x, y, z = points.T
    return np.stack([y * z + t * x * x, x**3 - 2.0 * z, x * y * z], axis=-1)


def cubic_gradient(points: np.ndarray, t: float) -> np.ndarray:
    x, y, z = points.T
    one, nought = np.ones_like(x), np.zeros_like(x)
    rows = [[2.0 * t * x, z, y], [3.0 * x * x, nought, -2.0 * one], [y * z, x * z, x * y]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


CASES: dict[str, tuple[AbstractFlow, Formula]] = {
    "shear": (Shear(rate=0.7), lambda x, y, z, t: (0.7 * y, 0.0, 0.0)),
    "shear, negative": (Shear(rate=-2.5), lambda x, y, z, t: (-2.5 * y, 0.0, 0.0)),
    "oscillatory shear": (
        OscillatoryShear(amplitude=1.3, frequency=0.4),
        lambda x, y, z, t: (1.3 * math.sin(2.0 * math.pi * 0.4 * t) * y, 0.0, 0.0),
    ),
    "time-dependent shear": (
        TimeDependentShear(lambda t: 1.0 - 3.0 * t),
        lambda x, y, z, t: ((1.0 - 3.0 * t) * y, 0.0, 0.0),
    ),
    "extension": (Extension(rate=0.6), lambda x, y, z, t: (0.6 * x, -0.3 * y, -0.3 * z)),
    "planar extension": (PlanarExtension(rate=1.7), lambda x, y, z, t: (1.7 * x, -1.7 * y, 0.0)),
    "rotation": (
        Rotation((0.3, -0.8, 1.9)),
        lambda x, y, z, t: (-0.8 * z - 1.9 * y, 1.9 * x - 0.3 * z, 0.3 * y + 0.8 * x),
    ),
    "uniform": (Uniform((0.5, -1.5, 2.5)), lambda x, y, z, t: (0.5, -1.5, 2.5)),
    "none": (NoFlow(), lambda x, y, z, t: (0.0, 0.0, 0.0)),
    "sum": (
        SumOfFlows((Shear(2.0), SumOfFlows((PlanarExtension(0.5), Uniform((1.0, 2.0, -3.0)))))),
        lambda x, y, z, t: (2.0 * y + 0.5 * x + 1.0, -0.5 * y + 2.0, -3.0),
    ),
    "user": (
        UserFlow(cubic, cubic_gradient),
        lambda x, y, z, t: (y * z + t * x * x, x**3 - 2.0 * z, x * y * z),
    ),
    "user, differences": (
        UserFlow(cubic),
        lambda x, y, z, t: (y * z + t * x * x, x**3 - 2.0 * z, x * y * z),
    ),
}
BUILT_IN = [name for name in CASES if not name.startswith("user")]


def points_and_times(test: Callable[..., None]) -> Callable[..., None]:
    """Run `test` at two generated points `x` and a generated time `t`."""
    x = hnp.arrays(np.float64, (2, 3), elements=st.floats(-20.0, 20.0))
    return settings(max_examples=30, deadline=None)(given(x=x, t=st.floats(-5.0, 50.0))(test))


each_case = pytest.mark.parametrize("case", CASES)


def by_formula(formula: Formula, x: np.ndarray, t: float) -> np.ndarray:
    return np.array([formula(a, b, c, t) for a, b, c in x.reshape(-1, 3).tolist()]).reshape(x.shape)


def differences(formula: Formula, x: np.ndarray, t: float) -> np.ndarray:
    """Return dU_i/dx_j by differences of fourth order: for cubics exact but for rounding."""
    h = 2.0**-4
    gradient = np.empty((*x.shape, 3))
    for j in range(3):
        e = h * np.eye(3)[j]
        at = {k: by_formula(formula, x + k * e, t) for k in (-2, -1, 1, 2)}
        gradient[..., j] = (8.0 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12.0 * h)
    return gradient


@each_case
@points_and_times
def test_velocity_is_the_formula(case: str, x: np.ndarray, t: float) -> None:
    flow, formula = CASES[case]
    assert_allclose(flow.velocity(x, t), by_formula(formula, x, t), rtol=1e-13, atol=1e-12)


@each_case
@points_and_times
def test_gradient_is_the_difference_of_the_formula(case: str, x: np.ndarray, t: float) -> None:
    flow, formula = CASES[case]
    # What differences lose by rounding goes with the size of the velocity.
    size = 1.0 + np.abs(by_formula(formula, x, t)).max() + np.abs(x).max() ** 2
    atol = 2e-10 * size if case == "user, differences" else 1e-13 * size
    assert_allclose(flow.gradient(x, t), differences(formula, x, t), rtol=0.0, atol=atol)


@pytest.mark.parametrize("case", BUILT_IN)
@points_and_times
def test_built_in_flows_have_no_sources(case: str, x: np.ndarray, t: float) -> None:
    gradient = CASES[case][0].gradient(x, t)
    assert_array_equal(np.einsum("...ii->...", gradient), 0.0)


@pytest.mark.parametrize("case", [c for c in BUILT_IN if c not in ("uniform", "sum")])
@points_and_times
def test_built_in_flows_are_linear_in_space(case: str, x: np.ndarray, t: float) -> None:
    flow = CASES[case][0]
    u = flow.velocity(x, t)
    combined = flow.velocity(2.0 * x[0] - 0.5 * x[1], t)
    assert_allclose(combined, 2.0 * u[0] - 0.5 * u[1], rtol=1e-12, atol=1e-11 * (1 + abs(t)))
    assert_allclose(
        np.einsum("nij,nj->ni", flow.gradient(x, t), x), u, rtol=1e-12, atol=1e-11 * (1 + abs(t))
    )


@each_case
def test_any_leading_axes_and_fresh_results(case: str) -> None:
    flow = CASES[case][0]
    x = np.random.default_rng(3).normal(size=(4, 5, 3))
    before = x.copy()
    velocity, gradient = flow.velocity(x, 0.3), flow.gradient(x, 0.3)
    assert velocity.shape == (4, 5, 3)
    assert gradient.shape == (4, 5, 3, 3)
    for result in (velocity, gradient):
        assert result.dtype == np.float64
        assert result.flags.c_contiguous
        assert result.flags.writeable
        assert not np.shares_memory(result, x)
    assert_array_equal(flow.velocity(x[2, 1], 0.3), velocity[2, 1])
    assert_array_equal(flow.gradient(x[2, 1], 0.3), gradient[2, 1])
    velocity[...], gradient[...] = np.pi, np.pi
    assert not np.any(flow.velocity(x, 0.3) == np.pi)
    assert not np.any(flow.gradient(x, 0.3) == np.pi)
    assert_array_equal(x, before)
    assert flow.velocity(np.zeros((0, 3)), 0.0).shape == (0, 3)
    assert flow.gradient(np.zeros((0, 3)), 0.0).shape == (0, 3, 3)


@each_case
def test_points_need_three_coordinates(case: str) -> None:
    flow = CASES[case][0]
    for method in (flow.velocity, flow.gradient):
        with pytest.raises(ValueError, match=r"\(\.\.\., 3\)"):
            method(np.zeros((3, 2)), 0.0)


def test_oscillation_counts_cycles_not_radians() -> None:
    flow = OscillatoryShear(amplitude=2.0, frequency=1.0 / 25.6)
    at = np.array([0.0, 1.0, 0.0])
    quarters = [flow.velocity(at, t)[0] for t in (0.0, 6.4, 12.8, 19.2, 25.6)]
    assert_allclose(quarters, [0.0, 2.0, 0.0, -2.0, 0.0], rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("flow", [Shear(-0.7), OscillatoryShear(amplitude=1.3, frequency=0.4)])
@pytest.mark.parametrize("t", [0.9, 2.1])
def test_strain_is_the_integral_of_the_shear_rate(flow: AbstractFlow, t: float) -> None:
    z, w = np.polynomial.legendre.leggauss(30)
    rates = [flow.gradient(np.zeros(3), 0.5 * t * (1.0 + at))[0, 1] for at in z]
    assert flow.strain(t) == pytest.approx(0.5 * t * float(w @ rates), rel=1e-12)
    assert flow.strain(0.0) == 0.0


def test_rotation_along_z_turns_x_towards_y() -> None:
    assert_array_equal(Rotation().velocity(np.array([1.0, 0.0, 0.0]), 0.0), [0.0, 1.0, 0.0])


def test_shear_is_half_extension_half_rotation() -> None:
    x = np.random.default_rng(5).normal(size=(6, 3))
    rest = SumOfFlows((Shear(2.0), Rotation((0.0, 0.0, 1.0)))).gradient(x, 0.0)
    assert_array_equal(rest, np.swapaxes(rest, -1, -2))
    assert_array_equal(rest[:, 0, 1], 1.0)


@points_and_times
def test_a_sum_is_the_sum_of_its_parts(x: np.ndarray, t: float) -> None:
    parts = [flow for flow, _ in CASES.values()]
    total = SumOfFlows(tuple(parts))
    assert_array_equal(total.velocity(x, t), sum(flow.velocity(x, t) for flow in parts))
    assert_array_equal(total.gradient(x, t), sum(flow.gradient(x, t) for flow in parts))


def test_opposite_flows_cancel() -> None:
    x = np.random.default_rng(7).normal(size=(6, 3))
    rest = SumOfFlows((Extension(1.5), Extension(-1.5)))
    assert_array_equal(rest.velocity(x, 0.0), 0.0)
    assert_array_equal(rest.gradient(x, 0.0), 0.0)


@pytest.mark.parametrize(
    ("flow", "rate"),
    [
        (Shear(-2.5), 2.5),
        (OscillatoryShear(-1.5, frequency=3.0), 1.5),
        (TimeDependentShear(math.cos, scale=0.5), 0.5),
        (Extension(-3.0), 3.0),
        (PlanarExtension(-4.0), 4.0),
        (Rotation((1.0, -6.0, 2.0)), 6.0),
        (Uniform(), 0.0),
        (NoFlow(), 0.0),
        (SumOfFlows((Shear(-2.5), Uniform(), Extension(1.0))), 3.5),
    ],
)
def test_rate_scale(flow: AbstractFlow, rate: float) -> None:
    assert flow.rate_scale() == rate


def test_kinds_of_the_case_file() -> None:
    kinds = "shear oscillatory_shear extension planar_extension rotation uniform none"
    assert list(FLOWS) == kinds.split()
    others = {SumOfFlows.kind, UserFlow.kind, TimeDependentShear.kind}
    assert others == {"sum", "python", "time_dependent_shear"}


@pytest.mark.parametrize(
    "flow",
    [
        Shear(1),
        OscillatoryShear(2.0, frequency=0.5),
        Extension(-1.0),
        PlanarExtension(),
        Rotation([1, 2, 3]),  # type: ignore[arg-type]
        Uniform(np.array([1.0, 2.0, 3.0])),  # type: ignore[arg-type]
        NoFlow(),
    ],
)
def test_dict_form_rebuilds_the_flow(flow: AbstractFlow) -> None:
    record = json.loads(json.dumps(to_dict(flow)))
    kind = record.pop("kind")
    assert FLOWS[kind](**record) == flow
    assert hash(FLOWS[kind](**record)) == hash(flow)


def test_dict_form_of_a_sum_is_nested() -> None:
    flow = SumOfFlows([Shear(2.0), SumOfFlows((NoFlow(),))])  # type: ignore[arg-type]
    assert to_dict(flow) == {
        "kind": "sum",
        "flows": [
            {"kind": "shear", "rate": 2.0},
            {"kind": "sum", "flows": [{"kind": "none"}]},
        ],
    }
