"""Keys of one engine in a case for another: what they are, and how to go on without them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from stokesfibers.core.errors import InputError
from stokesfibers.problem.engine import ENGINES, AbstractEngine

_INSTEAD = {"rtol": "dt", "nodes": "intervals", "adapt_nodes": "intervals", "intervals": "nodes"}
"""What says with another engine what a key says with its own, where anything does."""


def refuse_keys_of_another(tables: Mapping[str, Any], chosen: type[AbstractEngine]) -> None:
    """Refuse keys that another engine has and the chosen one has not.

    Raises
    ------
    InputError
        At the first of them; it names all, and what to take instead.
    """
    foreign = [
        (place, name, other.kind)
        for other in ENGINES.values()
        for name, place in other.places.items()
        if name not in chosen.places and name in _table(tables, place)
    ]
    if not foreign:
        return
    paths = [f"{place}.{name}" for place, name, _ in foreign]
    owner = foreign[0][2]
    are = "which is" if len(paths) == 1 else "which are"
    raise InputError(
        paths[0],
        f"keys of engine = '{chosen.kind}'",
        f"{_listed(paths)}, {are} of engine = '{owner}'",
        _advice(tables, foreign),
    )


def _advice(tables: Mapping[str, Any], foreign: list[tuple[str, str, str]]) -> str:
    """Return how to go on without the keys of another engine."""
    instead = [f"{place}.{_INSTEAD[name]}" for place, name, _ in foreign if name in _INSTEAD]
    names = {name for _, name, _ in foreign}
    left = []
    for place in dict.fromkeys(place for place, _, _ in foreign):
        rest = {key: value for key, value in _table(tables, place).items() if key not in names}
        inside = ", ".join(f"{key}={_plain(v)}" for key, v in rest.items())
        left.append(f"--set '{place}={{{inside}}}'")
    take = f"Take {_listed(list(dict.fromkeys(instead)))} instead, or leave" if instead else "Leave"
    it = "it" if len(foreign) == 1 else "them"
    return f"{take} {it} out, in the file or with {' '.join(left)}."


def _plain(value: object) -> str:
    return json.dumps(value, default=str, skipkeys=True)


def _table(tables: Mapping[str, Any], place: str) -> Mapping[str, Any]:
    found = tables.get(place, {})
    return found if isinstance(found, Mapping) else {}


def _listed(words: list[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
