"""What may stand in a case file, for people: each table, its kinds, its keys with their defaults.

All of it is read off the JSON Schema, so that it says what is accepted.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace

from stokesfibers.config.case import case_from_tables
from stokesfibers.config.schema import Schema, case_schema
from stokesfibers.core.tables import Table

_LEAST = {"fiber": {"slenderness": 1e-2}, "fluid": {"mu_bar": 1.0}, "stepping": {"until": 1.0}}


@dataclass(frozen=True)
class KeyLine:
    """One key.

    Attributes
    ----------
    name
        The key; ``key = default`` if it has a default.
    meaning
        What it is, the values it may take, and whether it has to be given.
    """

    name: str
    meaning: str


@dataclass(frozen=True)
class TableForm:
    """One form of a table: that of one kind, or the only one.

    Attributes
    ----------
    path
        The table, ``"initial"`` or ``"initial.orientation"``.
    kind
        Its kind; empty where it has none.
    meaning
        One line for people; may be empty.
    keys
        What it may hold beside the kind.
    default
        Whether a case is of this kind that leaves the table out.
    """

    path: str
    kind: str
    meaning: str
    keys: tuple[KeyLine, ...]
    default: bool = False


def case_forms() -> dict[str, tuple[TableForm, ...]]:
    """Return the forms of each table at the top of a case file, those of tables in it behind."""
    tables, least = case_schema()["properties"], case_from_tables(_LEAST).tables()
    found = {name: tuple(_forms(name, tables[name])) for name in tables if name != "engine"}
    return {
        name: tuple(replace(form, default=_is_default(form, least)) for form in forms)
        for name, forms in found.items()
    }


def _is_default(form: TableForm, least: Table) -> bool:
    held = least.get(form.path)
    return form.kind != "" and isinstance(held, dict) and held.get("kind") == form.kind


def engine_line() -> KeyLine:
    """Return the one key that stands in no table."""
    return _line("engine", case_schema()["properties"]["engine"], needed=False)


def form_of(path: str, schema: Schema) -> TableForm:
    """Return what the schema of one table says."""
    properties = schema["properties"]
    kind = str(properties.get("kind", {}).get("const", ""))
    keys = tuple(
        _line(name, one, needed=name in schema["required"])
        for name, one in properties.items()
        if name != "kind" and (not _tables(one) or "description" in one)
    )
    return TableForm(path, kind, schema.get("description", ""), keys)


def _forms(path: str, schema: Schema) -> Iterator[TableForm]:
    found = _tables(schema)
    within: dict[str, Schema] = {}
    for one in found:
        yield form_of(path, one)
        within |= {name: inner for name, inner in one["properties"].items() if _tables(inner)}
    for name, inner in within.items():
        yield from _forms(f"{path}.{name}", inner)


def _tables(schema: Schema) -> list[Schema]:
    """Return the tables that a value may be, each once; none for a list of the same again."""
    if "$ref" in schema:
        return _tables(case_schema()["$defs"][schema["$ref"].rpartition("/")[2]])
    if "properties" in schema:
        return [schema]
    found: list[Schema] = []
    for one in schema.get("oneOf", []):
        found += [table for table in _tables(one) if table not in found]
    return found


def _line(name: str, schema: Schema, *, needed: bool) -> KeyLine:
    default = f" = {_toml(schema['default'])}" if "default" in schema else ""
    parts = [str(schema.get("description", ""))]
    if len(names := schema.get("enum", ())) > 1:
        parts.append(f"One of {', '.join(map(_toml, names))}.")
    if needed:
        parts.append("To be given.")
    return KeyLine(f"{name}{default}", " ".join(filter(None, parts)))


def _toml(value: object) -> str:
    """Return a value as it is written in TOML, numbers with six digits."""
    return f"{value:.6g}" if isinstance(value, float) and value % 1.0 else json.dumps(value)
