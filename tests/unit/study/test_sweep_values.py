"""Values, ranges and names of swept parameters."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stokesfibers.core.errors import InputError
from stokesfibers.study.sweep_values import (
    leaves,
    seeds_of,
    short_names,
    toml_text,
    values_of,
    word,
)


def test_nested_and_quoted_keys_are_the_same_and_ranges_are_values():
    nested = {"fluid": {"mu_bar": [1.0, 2.0]}, "fiber": {"slenderness": {"linspace": [1, 2, 3]}}}
    quoted = {"fluid.mu_bar": [1.0, 2.0], "fiber.slenderness": {"linspace": [1, 2, 3]}}
    assert dict(leaves(nested)) == dict(leaves(quoted)) == quoted


@pytest.mark.parametrize(
    ("given_range", "expected"),
    [
        ({"linspace": [0.5, 2.0, 4]}, [0.5, 1.0, 1.5, 2.0]),
        ({"geomspace": [1.0, 8.0, 4]}, [1.0, 2.0, 4.0, 8.0]),
        ({"logspace": [0.0, 3.0, 4]}, [1.0, 10.0, 100.0, 1000.0]),
    ],
)
def test_ranges_are_those_of_numpy(given_range, expected, assert_close):
    assert_close(values_of("x", given_range), expected, rtol=1e-14)


def test_ranges_are_rounded_but_for_their_ends():
    """In binary the third of seven is 40000.00000000001."""
    found = values_of("x", {"geomspace": [1e4, 6.4e5, 7]})
    assert found == tuple(1e4 * 2.0**k for k in range(7))
    third = 1.0 / 3.0
    assert values_of("x", {"linspace": [third, 1.0 + third, 2]}) == (third, 1.0 + third)


@pytest.mark.parametrize(
    ("value", "expected", "got"),
    [
        ([], "a list of values", "[]"),
        (3.0, "a list of values", "3.0"),
        ([1.0, 2.0, 1.0], "different values", "1.0 at places 0 and 2"),
        ({"linspace": [1.0, 2.0]}, "first value, last value and how many", "[1.0, 2.0]"),
        ({"linspace": [1.0, 2.0, 2.5]}, "a whole number, 1 or more", "2.5"),
        ({"linspace": [1.0, "b", 2]}, "a finite number", "the text 'b'"),
        ({"geomspace": [0.0, 2.0, 2]}, "ends of one sign", "[0.0, 2.0, 2]"),
        ({"logspace": [1e3, 1e5, 3]}, "numbers that are finite", "[1000.0, 100000.0, 3]"),
    ],
)
def test_values_that_cannot_be_used_are_refused(value, expected, got):
    with pytest.raises(InputError) as caught:
        values_of("grid.x", value)
    assert caught.value.where.startswith("grid.x")
    assert caught.value.expected.startswith(expected)
    assert caught.value.got == got


def test_arrays_become_plain_numbers():
    found = values_of("x", np.array([1, 2]))
    assert found == (1, 2)
    assert all(type(v) is int for v in found)


def test_seeds():
    assert seeds_of(3) == (0, 1, 2)
    assert seeds_of([5, 2]) == (5, 2)
    for wrong in (0, [], [1, 1], [-1], "ten", True):
        with pytest.raises(InputError, match="seeds"):
            seeds_of(wrong)


_SCALARS = st.one_of(
    st.booleans(), st.integers(-(2**60), 2**60), st.floats(allow_nan=False), st.text(max_size=8)
)
_VALUES = st.recursive(
    _SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=8,
)


@given(_VALUES)
def test_toml_text_reads_back(value):
    assert tomllib.loads(f"x = {toml_text(value)}")["x"] == value


def test_words_are_safe_for_file_names():
    assert word(1e5) == "100000"
    assert word(0.001) == "0.001"
    assert word("../a b") == ".._a_b"
    assert word({"kind": "x"}) == "kind_x"
    assert word("?") == "_"
    assert len(word("x" * 300)) < 30


def test_short_names_are_as_short_as_can_be_told_apart():
    found = short_names(["fluid.mu_bar", "fiber[0].length", "fiber[1].length"])
    assert found == {
        "fluid.mu_bar": "mu_bar",
        "fiber[0].length": "fiber_0_length",
        "fiber[1].length": "fiber_1_length",
    }


def test_the_place_of_an_entry_stays_with_its_key():
    found = short_names(["load.force.1", "load.force[0]", "fiber.1.length", "fluid.mu_bar"])
    assert list(found.values()) == ["force_1", "force_0", "length", "mu_bar"]
