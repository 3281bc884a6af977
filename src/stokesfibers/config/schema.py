"""The JSON Schema of the case file, made from the records' fields, defaults and docstrings.

It knows names, types and defaults; ranges are checked by the records themselves when a case is
read. It says what an editor needs to complete keys, explain them and mark unknown ones.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from stokesfibers.config.docstrings import meanings, summary
from stokesfibers.constraint.coupled import TENSION_SOLVERS
from stokesfibers.domain import Free, Periodic, Sheared
from stokesfibers.fiber.initial import NearlyStraight
from stokesfibers.fiber.initials import INITIALS
from stokesfibers.fiber.orientation import ORIENTATIONS
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.fiber.suspension import Orientation
from stokesfibers.flow import FLOWS, AbstractFlow, SumOfFlows, Uniform, UserFlow
from stokesfibers.load import LOADS, UserLoad
from stokesfibers.problem.engine import ENGINES, SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.events import StopWhen
from stokesfibers.run.schedule import Schedule
from stokesfibers.slender.mobility import LocalDrag, NonLocal
from stokesfibers.slender.regularization import REGULARIZATIONS
from stokesfibers.summation import IMAGE_SUMS, FastImages
from stokesfibers.summation.close_approach import CLOSE_APPROACHES

Schema = dict[str, Any]

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_TYPES = {float: "number", int: "integer", str: "string", bool: "boolean"}
_TEXT: Schema = {"type": "string"}
_SAME = "If left out, that of the key."
_RUNS = "Python file, relative to the case file; it runs with --allow-python."
_SUMS = (
    "How images are summed: by default ewald with two or three periods, exact with one; with the "
    "paper's engine, or with reach, images with one, and truncated only for two or three."
)


def case_schema() -> Schema:
    """Return the JSON Schema of a case file as JSON-ready values."""
    engine = {place: _engine_keys(place) for place in ("discretization", "stepping", "constraint")}
    fluid = _properties(Problem, ("mu_bar", "viscosity"))
    fiber = {**record_schema(Fiber), "oneOf": _one_of("slenderness", "radius")}
    ends = {
        "until": {"type": "number", "description": "Time to stop. Give this or 'cycles'."},
        "cycles": {
            "type": "number",
            "description": "Time to stop, in cycles of an oscillating flow. Give this or 'until'.",
        },
    }
    return {
        "$schema": _DIALECT,
        "title": "A case of stokesfibers",
        "$defs": {"flow": {"oneOf": _flows()}, "fiber": fiber},
        **_object(
            {
                "engine": {
                    "enum": sorted(ENGINES, key=lambda kind: kind != SpectralEngine.kind),
                    "default": SpectralEngine.kind,
                    "description": " ".join(f"{k}: {summary(c)}" for k, c in ENGINES.items()),
                },
                "fiber": {
                    "oneOf": [
                        {"$ref": "#/$defs/fiber"},
                        {"type": "array", "items": {"$ref": "#/$defs/fiber"}, "minItems": 1},
                    ]
                },
                "fluid": {**_object(fluid), "oneOf": _one_of("mu_bar", "viscosity")},
                "flow": {"$ref": "#/$defs/flow"},
                "domain": _domain(),
                "load": {"oneOf": [*(_kind(cls) for cls in LOADS.values()), _python_load()]},
                "initial": {"oneOf": [_kind(cls) for cls in INITIALS.values()]},
                "model": _model(),
                "constraint": {
                    **_object({**engine["constraint"], **_named("solver", TENSION_SOLVERS)}),
                    "description": "Line tension of the paper's engine.",
                },
                "discretization": _object(engine["discretization"]),
                "stepping": {
                    **_object({**engine["stepping"], **ends}),
                    "oneOf": _one_of("until", "cycles"),
                },
                "record": {**record_schema(Schedule), "required": []},
                "stop": {
                    "oneOf": [
                        record_schema(StopWhen),
                        {"type": "array", "items": record_schema(StopWhen)},
                    ]
                },
            },
            ["fiber", "fluid", "stepping"],
        ),
        "description": f"Without [initial] the shape is '{NearlyStraight.kind}'.",
    }


@cache
def keys_of_kind(path: str, kind: str) -> Mapping[str, Schema] | None:
    """Return the schemas of the keys of the table at `path` if it is of `kind`; None if none is."""
    whole = case_schema()
    found: Schema = whole
    for key in path.split("."):
        inside = (one["properties"].get(key) for one in _choices(found, whole))
        found = next(filter(None, inside), {})
    for one in _choices(found, whole):
        if one["properties"].get("kind", {}).get("const") == kind:
            return one["properties"]
    return None


def _choices(schema: Schema, whole: Schema) -> list[Schema]:
    """Return the tables that a value may be, or the entries of a list."""
    if "$ref" in schema:
        return _choices(whole["$defs"][schema["$ref"].rpartition("/")[2]], whole)
    if isinstance(schema.get("items"), dict):
        return _choices(schema["items"], whole)
    own = [schema] if "properties" in schema else []
    return own + [table for one in schema.get("oneOf", []) for table in _choices(one, whole)]


def _engine_keys(place: str) -> dict[str, Schema]:
    """Return what the engines want in the table `place`."""
    found: dict[str, Schema] = {}
    for cls in ENGINES.values():
        for name, value in _properties(cls).items():
            if cls.places.get(name) != place:
                continue
            said = f"{value['description']} ({cls.kind})"
            before = found.get(name, {}).get("description")
            found[name] = {**value, "description": said if before is None else f"{before} {said}"}
    return found


def _flows() -> list[Schema]:
    source = {
        "kind": {"const": UserFlow.kind},
        "file": {**_TEXT, "description": _RUNS},
        "velocity": {**_TEXT, "description": f"Name of its function U(points, time). {_SAME}"},
        "gradient": {**_TEXT, "description": "Name of its function dU_i/dx_j(points, time)."},
        "sha256": {**_TEXT, "description": "Refuse the file unless it has this checksum."},
    }
    parts = {
        "description": "Tables of flows, each with its kind.",
        "type": "array",
        "items": {"$ref": "#/$defs/flow"},
        "minItems": 1,
    }
    several = {"kind": {"const": SumOfFlows.kind}, "flows": parts}
    return [
        *(_flow(cls) for cls in FLOWS.values()),
        {**_object(several, ["kind", "flows"]), "description": summary(SumOfFlows)},
        {**_object(source, ["kind", "file"]), "description": summary(UserFlow)},
    ]


def _python_load() -> Schema:
    source = {
        "kind": {"const": UserLoad.kind},
        "file": {**_TEXT, "description": _RUNS},
        "density": {**_TEXT, "description": f"Name of its function g(points, time). {_SAME}"},
        "sha256": {**_TEXT, "description": "Refuse the file unless it has this checksum."},
    }
    return {**_object(source, ["kind", "file"]), "description": summary(UserLoad)}


def _flow(cls: type[AbstractFlow]) -> Schema:
    schema = _kind(cls)
    if cls is Uniform:  # in a case the field stream_velocity is called velocity
        velocity = schema["properties"].pop("stream_velocity")
        velocity.pop("default", None)
        velocity["description"] = "The vector U [length/time]."
        schema["properties"]["velocity"] = velocity
        schema["required"].append("velocity")
    return schema


def _model() -> Schema:
    kinds = [_kind(cls) for cls in REGULARIZATIONS.values()]
    mobility = {"enum": [NonLocal.kind, LocalDrag.kind], "default": NonLocal.kind}
    close = [_kind(cls) for cls in CLOSE_APPROACHES.values()]
    return _object(
        {
            "mobility": mobility,
            "regularization": {"oneOf": kinds},
            "close_approach": {"oneOf": close},
        }
    )


def _domain() -> Schema:
    periodic = _kind(Periodic)
    periodic["properties"].update(_named("sum", IMAGE_SUMS))
    of_sum = periodic["properties"]["sum"]
    del of_sum["default"]  # it depends on the engine and the number of periodic directions
    of_sum["description"] = _SUMS
    free, sheared = _kind(Free), _kind(Sheared)
    for table in (free, sheared):
        table["properties"].update(_named("sum", {FastImages.kind: FastImages}))
    sheared["properties"]["sum"]["description"] = "A fast sum of all images, the only one here."
    of_free = free["properties"]["sum"]
    del of_free["default"]  # pairs are then summed one by one
    of_free["description"] = "ewald: a fast sum; if left out, pairs are summed one by one."
    return {"oneOf": [free, periodic, sheared]}


def _named(key: str, kinds: Mapping[str, type]) -> dict[str, Schema]:
    """Return the schemas of a key that names a record and of the record's fields beside it."""
    found: dict[str, Schema] = {key: {"enum": list(kinds), "default": next(iter(kinds))}}
    given = {kind: _properties(cls) for kind, cls in kinds.items()}
    for name in dict.fromkeys(name for properties in given.values() for name in properties):
        those = {kind: one[name] for kind, one in given.items() if name in one}
        found[name] = dict(next(iter(those.values())))
        if len({json.dumps(one.get("default")) for one in those.values()}) > 1:
            del found[name]["default"]
            defaults = (f"{one.get('default')} with {kind}" for kind, one in those.items())
            found[name]["description"] += f" Default {', '.join(defaults)}."
        else:
            said = f" With {key} = {' or '.join(those)}."
            found[name]["description"] += said if len(those) < len(kinds) or key == "sum" else ""
    return found


def _kind(cls: type) -> Schema:
    """Return the schema of a table whose key ``kind`` names the record."""
    schema = record_schema(cls)
    schema["properties"] = {"kind": {"const": cls.kind}, **schema["properties"]}  # type: ignore[attr-defined]
    schema["required"] = ["kind", *schema["required"]]
    return schema


def record_schema(cls: type) -> Schema:
    """Return the schema of a table whose keys are the fields of the record `cls`.

    Meanings are those of the section Attributes of its docstring.
    """
    needed = [f.name for f in _fields(cls) if _default(f) is MISSING]
    return {**_object(_properties(cls), needed), "description": summary(cls)}


def _object(properties: Mapping[str, Schema], required: list[str] | None = None) -> Schema:
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": dict(properties),
        "required": list(required or []),
    }


def _one_of(*names: str) -> list[Schema]:
    return [{"required": [name]} for name in names]


def _properties(cls: type, names: tuple[str, ...] | None = None) -> dict[str, Schema]:
    hints, said = get_type_hints(cls), meanings(cls)
    found = {}
    for f in _fields(cls):
        if names is None or f.name in names:
            found[f.name] = _of_type(hints[f.name])
            if f.name in said:
                found[f.name]["description"] = said[f.name]
            if _default(f) not in (MISSING, None):
                default = _default(f)
                found[f.name]["default"] = list(default) if isinstance(default, tuple) else default
    return found


def _fields(cls: type) -> list[Field[Any]]:
    return [f for f in fields(cls) if f.init]


def _default(f: Field[Any]) -> Any:
    return f.default if f.default_factory is MISSING else None


def _of_type(hint: Any) -> Schema:
    """Return the schema of a field's type; None, for a key left out, is not written in TOML."""
    if hint == Orientation:
        kinds = [_kind(cls) for cls in ORIENTATIONS.values()]
        return {"oneOf": [{"enum": list(ORIENTATIONS)}, *kinds]}
    if get_origin(hint) is Literal:
        return {"enum": list(get_args(hint))}
    if get_origin(hint) in (Union, UnionType):
        (hint,) = (part for part in get_args(hint) if part is not NoneType)
    if get_origin(hint) is tuple:
        parts = get_args(hint)
        item = _of_type(parts[0])
        if parts[-1] is Ellipsis:
            return {"type": "array", "items": item}
        return {"type": "array", "items": item, "minItems": len(parts), "maxItems": len(parts)}
    return {"type": _TYPES[hint]}
