"""The tables of a case as the text of a case file."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return tables of text, numbers, booleans, lists and tables as TOML, which reads back alike.

    A list of tables at the top becomes ``[[name]]``; tables deeper than two levels are written
    inline. None has no place in TOML and is left out.
    """
    lines = [f"{_key(k)} = {_value(v)}" for k, v in tables.items() if _plain(v)]
    for name, held in tables.items():
        if isinstance(held, Mapping):
            lines += _table(f"[{_key(name)}]", held, _key(name))
        elif _tables(held):
            for one in held:
                lines += ["", f"[[{_key(name)}]]", *_lines(one)]
    return "\n".join(lines).strip() + "\n"


def _table(head: str, table: Mapping[str, Any], path: str) -> Iterator[str]:
    yield from ("", head)
    yield from _lines({k: v for k, v in table.items() if not isinstance(v, Mapping)})
    for name, inner in table.items():
        if isinstance(inner, Mapping):
            yield from ("", f"[{path}.{_key(name)}]", *_lines(inner))


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(k)} = {_value(v)}" for k, v in table.items() if v is not None]


def _plain(value: object) -> bool:
    return value is not None and not isinstance(value, Mapping) and not _tables(value)


def _tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, Mapping) for v in value)


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _text(name)


def _text(value: str) -> str:
    # the escapes of JSON are escapes of TOML too, but for the one control character it lets by
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Mapping):
        inside = ", ".join(_lines(value))
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(v) for v in value)}]"
    return repr(value)
