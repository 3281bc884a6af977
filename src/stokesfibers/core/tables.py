"""Records from the plain tables of a case file, and back: one declaration serves both.

The fields of a frozen dataclass are the keys of its table. Values are checked by the record
itself; this module refuses unknown and missing keys and puts the table's path before the field.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, TypeVar

from stokesfibers.core.errors import InputError

Record = TypeVar("Record")
Table = dict[str, Any]


def as_table(value: object, where: str) -> Table:
    """Return `value` as a table; InputError if it is not one."""
    if not isinstance(value, Mapping):
        raise InputError(where, f"a table, [{where}]", value)
    return dict(value)


_LEAST_PART = 4  # letters of a part of a name that tell it


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the hint at the word that was meant; empty if none is near."""
    known = list(known)
    close = difflib.get_close_matches(word, known, n=1)
    if not close and len(word) >= _LEAST_PART:
        close = [name for name in known if word in name]
    return f"Did you mean '{close[0]}'?" if close else ""


def refuse_unknown(table: Mapping[str, Any], known: Iterable[str], where: str) -> None:
    """Raise InputError for the first key of `table` that is not in `known`."""
    known = list(known)
    for key in table:
        if key not in known:
            path = f"{where}.{key}" if where else str(key)
            expected = f"one of {', '.join(sorted(known))}"
            raise InputError(path, expected, f"'{key}'", did_you_mean(str(key), known))


def build(cls: type[Record], table: Mapping[str, Any], where: str) -> Record:
    """Return `cls(**table)`, with every error naming ``where.field``.

    Raises
    ------
    InputError
        For unknown or missing keys, switches that are not true or false, and whatever the record
        refuses.
    """
    declared = {f.name: f for f in fields(cls) if f.init}  # type: ignore[arg-type]
    refuse_unknown(table, declared, where)
    for name, f in declared.items():
        if f.default is MISSING and f.default_factory is MISSING and name not in table:
            raise InputError(f"{where}.{name}", "a value", "nothing")
        if isinstance(f.default, bool) and not isinstance(table.get(name, False), bool):
            raise InputError(f"{where}.{name}", "true or false", table[name])
    try:
        return cls(**table)
    except InputError as error:
        raise error.at(where) from None


def choose(kinds: Mapping[str, type[Record]], table: Mapping[str, Any], where: str) -> Record:
    """Return the record whose kind is ``table["kind"]``, built from the other keys."""
    rest = dict(table)
    kind = rest.pop("kind", None)
    if not isinstance(kind, str) or kind not in kinds:
        got = "nothing" if kind is None else repr(kind)
        hint = did_you_mean(str(kind), kinds)
        raise InputError(f"{where}.kind", f"one of {', '.join(kinds)}", got, hint)
    return build(kinds[kind], rest, where)


def to_table(record: Any) -> Table:
    """Return the kind of a record and its fields other than None; records in it as tables."""
    table: Table = {"kind": record.kind} if hasattr(record, "kind") else {}
    for f in fields(record):
        value = getattr(record, f.name)
        if value is not None:
            table[f.name] = _plain(value)
    return table


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return to_table(value)
    return list(value) if isinstance(value, tuple) else value
