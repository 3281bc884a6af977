"""The registry of case keys: complete, and a help to who writes a path nearly right."""

from __future__ import annotations

from typing import Any

import pytest

from stokesfibers.config.case import apply_setting
from stokesfibers.config.keys import KEYS, key_at
from stokesfibers.config.schema import case_schema
from stokesfibers.core.errors import InputError


def _leaves(schema: dict[str, Any], path: str, whole: dict[str, Any]) -> set[str]:
    """Return the paths of the keys below `path` that hold values; parts of sums are flows too."""
    if "$ref" in schema:
        if path == "flow.flows":
            return {path}
        schema = whole["$defs"][schema["$ref"].rpartition("/")[2]]
    choices = schema.get("oneOf", [])
    found = set().union(*(_leaves(one, path, whole) for one in choices if "required" not in one))
    found |= set().union(*(_leaves(one, path, whole) for one in choices if "properties" in one))
    if isinstance(schema.get("items"), dict):
        found |= _leaves(schema["items"], path, whole)
    for key, inside in schema.get("properties", {}).items():
        found |= _leaves(inside, f"{path}.{key}".removeprefix("."), whole)
    if "enum" in schema or "const" in schema or schema.get("type") not in (None, "object", "array"):
        found.add(path)
    if schema.get("type") == "array" and "properties" not in schema["items"]:
        found.add(path)
    return found


def test_each_key_of_the_schema_is_in_the_registry_and_no_other():
    schema = case_schema()
    found = _leaves(schema, "", schema) - {"fiber", "stop"}  # lists of tables
    assert found == set(KEYS)


def test_numbers_have_units_and_all_have_meanings():
    assert all(key.meaning for key in KEYS.values())
    assert KEYS["fluid.viscosity"].attrs() == {
        "units": "force time length^-2",
        "symbol": r"\mu",
        "long_name": "viscosity of the fluid",
    }
    assert KEYS["flow.kind"].attrs() == {"long_name": "kind of flow"}
    assert key_at("fiber[12].length") is KEYS["fiber.length"]
    assert key_at("fiber.lenght") is None


def test_an_entry_of_a_vector_says_which_in_its_meaning():
    for path in ("load.force.1", "load.force[1]"):
        found = key_at(path)
        assert found is not None
        assert found.path == path
        assert found.attrs() == {
            "units": "force length^-1",
            "long_name": "load per length, along y",
        }


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("mu_bar=1e5", "'fluid.mu_bar'"),
        ("kind=shear", "'flow.kind' or 'domain.kind' or 'load.kind', ..."),
        ("nodse=3", "'discretization.nodes'"),
        ("model.m=3.0", "'model.regularization.m'"),
    ],
)
def test_the_paths_that_may_be_meant_are_named(setting, told):
    with pytest.raises(InputError) as caught:
        apply_setting({}, setting)
    assert caught.value.hint == f"Did you mean {told}?"


@pytest.mark.parametrize(
    "setting",
    ["fiber[0].length=2.0", "engine=paper", "flow.flows[0].rate=1.0", "fiber={length=1.0}"],
)
def test_paths_that_are_right_go_through(setting):
    tables: dict[str, Any] = {"fiber": [{}], "flow": {"flows": [{}]}}
    before = repr(tables)
    apply_setting(tables, setting)
    assert repr(tables) != before
