"""Flows from a user's functions: differences, and refusals that say where."""

from __future__ import annotations

import functools
import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from stokesfibers.core.errors import InputError
from stokesfibers.flow import SumOfFlows, TimeDependentShear, UserFlow, to_dict


def cells(points: np.ndarray, t: float, size: float = 1.0) -> np.ndarray:
    """Return the velocity of Taylor-Green cells of size `size`; Stokes or not does not matter."""
    x, y, z = points.T / size
    speed = size * (1.0 + t)
    return speed * np.stack(
        [np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y), np.sin(x + 2.0 * z)], axis=-1
    )


def cells_gradient(points: np.ndarray, t: float, size: float = 1.0) -> np.ndarray:
    x, y, z = points.T / size
    ss, cc, c = np.sin(x) * np.sin(y), np.cos(x) * np.cos(y), np.cos(x + 2.0 * z)
    nought = np.zeros_like(x)
    rows = [[cc, -ss, nought], [ss, -cc, nought], [c, nought, 2.0 * c]]
    return (1.0 + t) * np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e4])
def test_differences_of_a_curved_field_in_any_units(size: float) -> None:
    x = size * np.random.default_rng(1).uniform(-3.0, 3.0, size=(7, 4, 3))
    flow = UserFlow(functools.partial(cells, size=size), length_scale=size)
    exact = cells_gradient(x.reshape(-1, 3), 0.5, size).reshape(7, 4, 3, 3)
    assert_allclose(flow.gradient(x, 0.5), exact, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("distance", [1e2, 1e4])
def test_differences_far_from_the_origin(distance: float) -> None:
    x = distance + np.random.default_rng(2).uniform(-3.0, 3.0, size=(20, 3))

    def velocity(points: np.ndarray, t: float) -> np.ndarray:
        return points[:, [1, 2, 0]] + cells(points, t)

    exact = np.eye(3)[[1, 2, 0]] + cells_gradient(x, 0.0)
    found = UserFlow(velocity).gradient(x, 0.0)
    assert_allclose(found, exact, rtol=0.0, atol=1e-10 * distance ** (2.0 / 3.0))


def test_a_given_gradient_is_used_as_it_is() -> None:
    x = np.random.default_rng(3).normal(size=(4, 3))
    flow = UserFlow(cells, cells_gradient)
    assert_array_equal(flow.gradient(x, 0.25), cells_gradient(x, 0.25))
    # The transpose would be another flow, so the order of the two axes is settled here.
    assert np.abs(cells_gradient(x, 0.25) - cells_gradient(x, 0.25).swapaxes(1, 2)).max() > 0.1


def test_the_function_may_spoil_its_argument_and_keep_its_result() -> None:
    kept = np.ones((2, 3))

    def velocity(points: np.ndarray, t: float) -> np.ndarray:  # noqa: ARG001
        points *= 0.0
        return kept

    x = np.full((2, 3), 7.0)
    flow = UserFlow(velocity)
    flow.velocity(x, 0.0)[...] = 5.0
    assert_array_equal(x, 7.0)
    assert_array_equal(flow.velocity(x, 0.0), 1.0)


def test_lists_and_integers_from_the_function_become_floats() -> None:
    flow = UserFlow(lambda points, t: [[1, 2, 3]] * len(points))  # noqa: ARG005
    velocity = flow.velocity(np.zeros((2, 3)), 0.0)
    assert velocity.dtype == np.float64
    assert_array_equal(velocity, [[1.0, 2.0, 3.0]] * 2)


def nan_beyond_one(points: np.ndarray, t: float) -> np.ndarray:  # noqa: ARG001
    return np.where(points[:, :1] > 1.0, np.nan, points)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_the_first_point_that_is_not_finite_is_named(bad: float) -> None:
    def velocity(points: np.ndarray, t: float) -> np.ndarray:  # noqa: ARG001
        return np.where(points == 4.0, bad, points)

    x = np.arange(12.0).reshape(2, 2, 3)
    with pytest.raises(InputError) as caught:
        UserFlow(velocity, name="jet").velocity(x, 0.125)
    message = str(caught.value)
    assert "velocity function" in message
    assert velocity.__qualname__ in message
    assert "flow 'jet' at t = 0.125" in message
    assert f"(3, {bad:g}, 5) at point (3, 4, 5)" in message


def test_differences_notice_a_velocity_that_is_not_finite() -> None:
    flow = UserFlow(nan_beyond_one)
    assert_allclose(flow.gradient(np.zeros(3), 0.0), np.eye(3), rtol=0.0, atol=1e-12)
    with pytest.raises(InputError, match="nan_beyond_one"):
        flow.gradient(np.array([1.0, 0.0, 0.0]), 0.0)


@pytest.mark.parametrize(
    ("result", "reason"),
    [
        (np.zeros(3), r"shape \(3,\)"),
        (np.zeros((3, 2)), r"shape \(3, 2\)"),
        (np.zeros((1, 3)), r"shape \(1, 3\)"),
        (0.0, r"shape \(\)"),
        (None, r"shape \(\)"),
        (np.zeros((2, 3), dtype=complex), "real numbers, got values of type complex128"),
        (np.zeros((2, 3), dtype=bool), "real numbers, got values of type bool"),
        ([[1.0, 2.0, 3.0], [1.0]], "ValueError"),
    ],
)
def test_wrong_results_are_refused(result: Any, reason: str) -> None:
    x = np.array([[0.5, 0.25, 0.75], [1.0, 1.0, 1.0]])
    flow = UserFlow(lambda points, t: result)  # noqa: ARG005
    with pytest.raises(InputError, match=reason) as caught:
        flow.velocity(x, 2.5)
    assert "t = 2.5" in str(caught.value)
    assert "point (0.5, 0.25, 0.75)" in str(caught.value)


def test_a_wrong_gradient_is_refused() -> None:
    flow = UserFlow(cells, lambda points, t: cells(points, t))
    with pytest.raises(InputError, match=r"gradient function.*\(2, 3, 3\), got shape \(2, 3\)"):
        flow.gradient(np.zeros((2, 3)), 0.0)
    flow = UserFlow(cells, lambda points, t: np.full((len(points), 3, 3), t))
    with pytest.raises(InputError, match=r"gradient function.*finite values"):
        flow.gradient(np.zeros((2, 3)), math.nan)


def test_a_function_that_raises_is_an_input_error_with_its_cause() -> None:
    def velocity(points: np.ndarray, t: float) -> np.ndarray:  # noqa: ARG001
        raise KeyError("table")

    with pytest.raises(InputError, match="KeyError: 'table'") as caught:
        UserFlow(velocity).velocity(np.zeros((2, 3)), 0.0)
    assert isinstance(caught.value.__cause__, KeyError)


def test_rate_scale_is_of_the_size_of_the_gradient() -> None:
    linear = UserFlow(lambda points, t: 3.0 * math.cos(t) * points[:, [2, 0, 1]])
    assert linear.rate_scale() == pytest.approx(3.0, rel=1e-9)
    small = UserFlow(lambda points, t: 1e3 * cells(points, t, 1e-6), length_scale=1e-6)
    assert 1e3 < small.rate_scale() < 4e3
    assert UserFlow(nan_beyond_one, length_scale=100.0).rate_scale() == pytest.approx(1.0)
    assert UserFlow(lambda points, t: points * np.nan).rate_scale() == 0.0  # noqa: ARG005


class TestTimeDependentShear:
    def test_arrays_without_axes_are_numbers(self) -> None:
        flow = TimeDependentShear(lambda t: np.array(2.0 * t))  # type: ignore[arg-type,return-value]
        assert_array_equal(flow.velocity(np.array([0.0, 3.0, 0.0]), 0.5), [3.0, 0.0, 0.0])

    @pytest.mark.parametrize("value", [math.nan, math.inf, "1", None, True, np.ones(2)])
    def test_wrong_rates_are_refused(self, value: Any) -> None:
        flow = TimeDependentShear(lambda t: value)  # noqa: ARG005
        with pytest.raises(InputError, match=r"<lambda>' at t = 0\.5: expected a finite number"):
            flow.velocity(np.zeros(3), 0.5)

    def test_a_rate_that_raises(self) -> None:
        flow = TimeDependentShear(lambda t: 1.0 / t)
        with pytest.raises(InputError, match=r"at t = 0: .*ZeroDivisionError"):
            flow.gradient(np.zeros(3), 0.0)

    def test_dict_form(self) -> None:
        record = json.loads(json.dumps(to_dict(TimeDependentShear(ramp, scale=2.0))))
        assert record == {
            "kind": "time_dependent_shear",
            "rate": f"{__name__}.ramp",
            "scale": 2.0,
            "sources": [this_file()],
        }


def ramp(t: float) -> float:
    return min(t, 1.0)


def this_file() -> dict[str, str]:
    path = Path(__file__).resolve()
    return {"path": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}


def test_dict_form_of_functions() -> None:
    record = json.loads(json.dumps(to_dict(SumOfFlows((UserFlow(cells, cells_gradient),)))))
    assert record["flows"] == [
        {
            "kind": "python",
            "velocity_function": f"{__name__}.cells",
            "gradient_function": f"{__name__}.cells_gradient",
            "name": "user",
            "length_scale": 1.0,
            "sources": [this_file()],
        }
    ]


def test_dict_form_of_unusual_callables() -> None:
    class Vortex:
        def __call__(self, points: np.ndarray, t: float) -> np.ndarray:
            return points * t

    record = to_dict(UserFlow(Vortex(), functools.partial(cells_gradient, size=2.0)))
    assert record["velocity_function"].endswith("Vortex")
    assert record["gradient_function"] == f"partial of {__name__}.cells_gradient"
    assert record["sources"] == [this_file()]
    typed: dict[str, Any] = {}
    exec("def f(points, t): return points", typed)
    assert to_dict(UserFlow(typed["f"]))["sources"] == []
