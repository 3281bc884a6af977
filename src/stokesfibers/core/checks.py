"""Checks of single values given by a user: numbers, vectors of three, whole numbers.

Each takes the name of the item and its value, and returns the value in its plain Python type or
raises `InputError`. Integers and NumPy scalars pass as floats; booleans and text never do, since
``rate = true`` or ``rate = "1"`` in a case file is a slip and not a number.
"""

from __future__ import annotations

import math

import numpy as np

from stokesfibers.core.errors import InputError


def finite(where: str, value: object) -> float:
    """Return `value` as a float; InputError unless it is a finite number."""
    return _number(where, value, "a finite number")


def positive(where: str, value: object) -> float:
    """Return `value` as a float; InputError unless it is a finite number above zero."""
    expected = "a finite number above zero"
    number = _number(where, value, expected)
    if number <= 0.0:
        raise InputError(where, expected, _shown(value))
    return number


def non_negative(where: str, value: object) -> float:
    """Return `value` as a float; InputError unless it is a finite number, zero or above."""
    expected = "a finite number, zero or above"
    number = _number(where, value, expected)
    if number < 0.0:
        raise InputError(where, expected, _shown(value))
    return number


def vector3(where: str, value: object) -> tuple[float, float, float]:
    """Return `value`, a tuple, list or array, as three floats; InputError unless all are finite.

    The error names the entry, e.g. ``angular_velocity[2]``, if it is one entry that is wrong.
    """
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, tuple | list) or len(value) != 3:
        raise InputError(where, "three finite numbers", _shown(value))
    x, y, z = (finite(f"{where}[{i}]", entry) for i, entry in enumerate(value))
    return x, y, z


def whole(where: str, value: object, least: int, most: int | None = None) -> int:
    """Return `value` as an int; InputError unless it is a whole number, `least` to `most`."""
    expected = (
        f"a whole number, {least} or more" if most is None else f"a whole number, {least} to {most}"
    )
    value = _unwrapped(value)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(where, expected, _shown(value))
    if value < least or (most is not None and value > most):
        raise InputError(where, expected, _shown(value))
    return value


def _unwrapped(value: object) -> object:
    """Return the Python value of a NumPy scalar or of an array without axes."""
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0):
        return value.item()
    return value


def _number(where: str, value: object, expected: str) -> float:
    # Long doubles have no Python twin: `item` hands them back unchanged, hence np.floating.
    plain = _unwrapped(value)
    if isinstance(plain, bool) or not isinstance(plain, int | float | np.floating):
        raise InputError(where, expected, _shown(value))
    try:
        number = float(plain)
    except OverflowError:
        raise InputError(where, expected, "an integer too large for a float") from None
    if not math.isfinite(number):
        raise InputError(where, expected, _shown(value))
    return number


def _shown(value: object) -> str:
    """Return `value` for a message; text keeps its quotes, or "1.0" would look like a number."""
    return f"the text {value!r}" if isinstance(value, str) else repr(value)
