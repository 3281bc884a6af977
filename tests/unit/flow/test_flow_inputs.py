"""What the checks of single values and the built-in flows accept and refuse."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.flow import (
    Extension,
    OscillatoryShear,
    PlanarExtension,
    Rotation,
    Shear,
    SumOfFlows,
    TimeDependentShear,
    Uniform,
    UserFlow,
)

NOT_NUMBERS: list[Any] = [
    True,
    np.True_,
    "1.0",
    None,
    1j,
    [1.0],
    np.array([1.0]),
    math.nan,
    math.inf,
    -math.inf,
    np.float64("nan"),
    np.float32("inf"),
    10**400,
]
NOT_VECTORS: list[Any] = [
    1.0,
    "123",
    None,
    (1.0, 2.0),
    (1.0, 2.0, 3.0, 4.0),
    {1.0, 2.0, 3.0},
    np.eye(3),
    (1.0, math.nan, 0.0),
    (1.0, True, 0.0),
    (1.0, "2", 0.0),
]


@pytest.mark.parametrize("check", [checks.finite, checks.positive, checks.non_negative])
class TestNumbers:
    @pytest.mark.parametrize("value", [2, 2.0, np.int32(2), np.float32(2.0), np.array(2.0)])
    def test_numbers_of_any_kind_become_floats(
        self, check: Callable[[str, object], float], value: Any
    ) -> None:
        result = check("rate", value)
        assert type(result) is float
        assert result == 2.0

    def test_long_double(self, check: Callable[[str, object], float]) -> None:
        assert type(check("rate", np.longdouble(2.0))) is float

    @pytest.mark.parametrize("value", NOT_NUMBERS, ids=lambda v: str(v)[:12])
    def test_anything_else_is_refused(
        self, check: Callable[[str, object], float], value: Any
    ) -> None:
        with pytest.raises(InputError) as caught:
            check("rate", value)
        assert caught.value.where == "rate"
        assert caught.value.expected.startswith("a finite number")


@pytest.mark.parametrize(
    ("check", "value", "good"),
    [
        (checks.finite, -1.0, True),
        (checks.finite, 0.0, True),
        (checks.non_negative, -5e-324, False),
        (checks.non_negative, 0, True),
        (checks.positive, -1.0, False),
        (checks.positive, 0.0, False),
        (checks.positive, 5e-324, True),
    ],
)
def test_signs(check: Callable[[str, object], float], value: float, good: bool) -> None:
    if good:
        assert check("rate", value) == value
    else:
        with pytest.raises(InputError, match="rate: expected a finite number"):
            check("rate", value)


@pytest.mark.parametrize("value", [(1, 2, 3), [1.0, 2, 3.0], np.array([1, 2, 3])])
def test_vectors_become_tuples_of_floats(value: Any) -> None:
    result = checks.vector3("axis", value)
    assert result == (1.0, 2.0, 3.0)
    assert type(result) is tuple
    assert [type(v) for v in result] == [float] * 3


@pytest.mark.parametrize("value", NOT_VECTORS, ids=str)
def test_other_vectors_are_refused(value: Any) -> None:
    with pytest.raises(InputError, match=r"^axis"):
        checks.vector3("axis", value)


def test_the_wrong_entry_of_a_vector_is_named() -> None:
    with pytest.raises(InputError, match=r"^axis\[2\]: expected a finite number, got nan\.$"):
        checks.vector3("axis", (0.0, 1.0, math.nan))


@pytest.mark.parametrize("value", [3, np.int64(3), np.array(3)])
def test_whole_numbers(value: Any) -> None:
    result = checks.whole("count", value, 3)
    assert type(result) is int
    assert result == 3


@pytest.mark.parametrize("value", [2, -3, 3.0, np.float64(3.0), True, "3", None, math.nan, [3]])
def test_other_whole_numbers_are_refused(value: Any) -> None:
    with pytest.raises(InputError, match="count: expected a whole number, 3 or more, got"):
        checks.whole("count", value, 3)


def test_text_is_shown_as_text() -> None:
    with pytest.raises(InputError) as caught:
        checks.finite("rate", "1.0")
    assert str(caught.value) == "rate: expected a finite number, got the text '1.0'."
    assert str(caught.value.at("flow")).startswith("flow.rate: ")


def same(points: np.ndarray, t: float) -> np.ndarray:  # noqa: ARG001
    return points


def bad_fields() -> list[Any]:
    numbers: list[tuple[str, Callable[[Any], Any]]] = [
        ("rate", lambda v: Shear(rate=v)),
        ("rate", lambda v: Extension(rate=v)),
        ("rate", lambda v: PlanarExtension(rate=v)),
        ("amplitude", lambda v: OscillatoryShear(amplitude=v, frequency=1.0)),
        ("frequency", lambda v: OscillatoryShear(frequency=v)),
        ("scale", lambda v: TimeDependentShear(math.sin, scale=v)),
        ("length_scale", lambda v: UserFlow(same, length_scale=v)),
    ]
    vectors: list[tuple[str, Callable[[Any], Any]]] = [
        ("angular_velocity", lambda v: Rotation(angular_velocity=v)),
        ("stream_velocity", lambda v: Uniform(stream_velocity=v)),
    ]
    table = [(field, make, value) for field, make in numbers for value in NOT_NUMBERS]
    table += [(field, make, value) for field, make in vectors for value in NOT_VECTORS]
    table += [(numbers[4][0], numbers[4][1], v) for v in (0.0, -1.0)]
    table += [(numbers[5][0], numbers[5][1], -1.0)]
    table += [(numbers[6][0], numbers[6][1], v) for v in (0.0, -1.0)]
    table += [("rate", TimeDependentShear, v) for v in (1.0, None, "sin")]
    table += [("velocity_function", UserFlow, v) for v in (1.0, None, "f")]
    table += [("gradient_function", lambda v: UserFlow(same, v), v) for v in (1.0, "f")]
    table += [("name", lambda v: UserFlow(same, name=v), v) for v in ("", None, 3)]
    table += [("flows", SumOfFlows, v) for v in ((), [], None, Shear(), "shear")]
    return table


@pytest.mark.parametrize(("field", "make", "value"), bad_fields())
def test_bad_fields_are_refused_by_name(field: str, make: Callable[[Any], Any], value: Any) -> None:
    with pytest.raises(InputError) as caught:
        make(value)
    assert caught.value.where.partition("[")[0] == field


def test_a_bad_part_of_a_sum_is_named() -> None:
    with pytest.raises(InputError, match=r"^flows\[1\]: expected a flow"):
        SumOfFlows((Shear(), "shear"))  # type: ignore[arg-type]


def test_flows_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        Shear().rate = 2.0  # type: ignore[misc]


def test_frequency_must_be_given() -> None:
    with pytest.raises(TypeError, match="frequency"):
        OscillatoryShear(1.0)  # type: ignore[call-arg]
