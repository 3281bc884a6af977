"""The JSON Schema of the case file: it takes the shipped cases and refuses slips."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from stokesfibers.config.schema import case_schema
from stokesfibers.flow import FLOWS

CASES = sorted((Path(__file__).parents[3] / "cases").glob("*.toml"))
_PYTHON = {"object": dict, "array": list, "string": str, "boolean": bool}


def accepts(schema: dict[str, Any], value: Any, root: dict[str, Any]) -> bool:
    """Return whether `value` fits: the part of JSON Schema that ours uses."""
    if "$ref" in schema:
        name = schema["$ref"].removeprefix("#/$defs/")
        return accepts(root["$defs"][name], value, root)
    kind = schema.get("type")
    number = isinstance(value, int | float) and not isinstance(value, bool)
    checks = [
        kind not in _PYTHON or isinstance(value, _PYTHON[kind]),
        kind != "number" or number,
        kind != "integer" or (number and float(value).is_integer()),
        "const" not in schema or value == schema["const"],
        "enum" not in schema or value in schema["enum"],
        "oneOf" not in schema or sum(accepts(s, value, root) for s in schema["oneOf"]) == 1,
    ]
    if isinstance(value, dict):
        properties = schema.get("properties", {})
        checks += [name in value for name in schema.get("required", [])]
        for name, entry in value.items():
            if name in properties:
                checks.append(accepts(properties[name], entry, root))
            else:
                checks.append(schema.get("additionalProperties", True))
    if isinstance(value, list):
        checks += [accepts(schema.get("items", {}), entry, root) for entry in value]
        checks.append(schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", 1 << 30))
    return all(checks)


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    return json.loads(json.dumps(case_schema()))


@pytest.mark.parametrize("file", CASES, ids=lambda p: p.stem)
def test_shipped_cases_fit(file, schema):
    assert accepts(schema, tomllib.loads(file.read_text()), schema)


@pytest.mark.parametrize(
    "change",
    [
        {"fluids": {}},
        {"fluid": {"mu_bar": 1.0, "viscosity": 1.0}},
        {"fluid": {}},
        {"fiber": {"slenderness": 1e-3, "lenght": 1.0}},
        {"fiber": {"slenderness": 1e-3, "radius": 1e-3}},
        {"fiber": {"length": 1.0}},
        {"fiber": []},
        {"flow": {"kind": "sheer"}},
        {"flow": {"kind": "shear", "frequency": 1.0}},
        {"flow": {"kind": "uniform"}},
        {"flow": {"kind": "uniform", "stream_velocity": [1.0, 0.0, 0.0]}},
        {"flow": {"kind": "python"}},
        {"flow": {"kind": "sum", "flows": []}},
        {"initial": {"kind": "straight", "centre": [0.0, 0.0]}},
        {"initial": {"kind": "file"}},
        {"model": {"regularization": {"kind": "none", "m": 2.0}}},
        {"model": {"mobility": "slender"}},
        {"stepping": {"dt": 0.1}},
        {"stepping": {"dt": "0.1", "until": 1.0}},
        {"record": {"points": 10.5}},
        {"engine": "spectrel"},
    ],
    ids=str,
)
def test_slips_do_not_fit(change, schema):
    good = tomllib.loads(CASES[0].read_text())
    assert not accepts(schema, {**good, **change}, schema)


@pytest.mark.parametrize(
    "change",
    [
        {"flow": {"kind": "uniform", "velocity": [1.0, 0.0, 0.0]}},
        {"flow": {"kind": "sum", "flows": [{"kind": "shear"}, {"kind": "rotation"}]}},
        {"flow": {"kind": "python", "file": "flow.py", "velocity": "wind"}},
        {"flow": {"kind": "oscillatory_shear", "frequency": 0.1}},
        {"fiber": [{"radius": 1e-3}]},
        {"initial": {"kind": "file", "path": "a.npy"}},
        {"model": {"mobility": "local_drag"}},
        {"record": {}},
    ],
    ids=str,
)
def test_other_good_tables_fit(change, schema):
    good = tomllib.loads(CASES[0].read_text())
    assert accepts(schema, {**good, **change}, schema)


def test_every_key_is_explained(schema):
    tables = [
        schema["$defs"]["fiber"],
        schema["properties"]["record"],
        schema["properties"]["fluid"],
        *schema["properties"]["initial"]["oneOf"],
        *schema["properties"]["model"]["properties"]["regularization"]["oneOf"],
    ]
    flows = schema["$defs"]["flow"]["oneOf"]
    assert len(flows) == len(FLOWS) + 2
    for table in flows:
        assert table["description"]
    silent = {"kind"}
    unexplained = [
        (table.get("description"), key)
        for table in tables
        for key, entry in table["properties"].items()
        if "description" not in entry and key not in silent
    ]
    # The initial shapes are explained at the functions that make them.
    assert {key for _, key in unexplained} <= {"angle", "amplitude", "centre", "path"}


def test_defaults_and_meanings_come_from_the_records(schema):
    fiber = schema["$defs"]["fiber"]["properties"]
    assert fiber["length"] == {
        "type": "number",
        "description": "L, in units of length.",
        "default": 1.0,
    }
    assert "default" not in fiber["slenderness"]
    ramp = schema["properties"]["model"]["properties"]["regularization"]["oneOf"][0]
    assert ramp["properties"]["ramp"]["default"] == 0.1
    assert "gamma of (16)" in ramp["properties"]["ramp"]["description"]


def test_command_prints_it(schema):
    from click.testing import CliRunner

    from stokesfibers.cli.main import main

    assert json.loads(CliRunner().invoke(main, ["schema"]).stdout) == schema
