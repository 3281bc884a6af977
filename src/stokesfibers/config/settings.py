"""Changes of a case's tables by ``table.key=value``, as ``--set`` and sweeps make them."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from stokesfibers.config.keys import KEYS, refuse_misplaced
from stokesfibers.config.schema import keys_of_kind
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table

_PART = re.compile(r"(?P<key>[A-Za-z0-9_-]+)(?P<places>(\[[0-9]{1,9}\])*)")
_PLACE = re.compile(r"[0-9]{1,9}")
_RIVALS = {
    "mu_bar": ("viscosity",),
    "viscosity": ("mu_bar",),
    "slenderness": ("radius",),
    "radius": ("slenderness",),
    "rtol": ("dt", "order"),
    "dt": ("rtol",),
    "intervals": ("nodes", "adapt_nodes"),
    "nodes": ("intervals",),
    "adapt_nodes": ("intervals",),
    "until": ("cycles",),
    "cycles": ("until",),
}
"""Keys that say the same thing another way; the new one replaces them."""


def apply_setting(tables: Table, setting: str) -> None:
    """Change `tables` by ``"table.key=value"``; a value that is not TOML is taken as text.

    Paths are those of error messages: ``fiber.length``, or ``fiber[0].length`` in a list. An entry
    of a list is ``load.force[1]`` or ``load.force.1``. What says the same thing another way goes,
    and so do the keys that another kind does not have.

    Raises
    ------
    InputError
        If the text has another form, its key belongs to another table, or its path leads through
        something that is no table.
    """
    path, separator, text = setting.partition("=")
    steps = steps_of(path) if separator else []
    if not steps:
        hint = "" if separator else _example(path.strip())
        raise InputError("--set", "table.key=value", repr(setting), hint)
    refuse_misplaced(path.strip(), setting)
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    *way, last = steps
    holder = _holder(tables, way, setting)
    if isinstance(last, int):
        _set_entry(holder, (way, last), value, setting)
        return
    table = _as_table(holder, way, setting)
    if last == "kind":
        _drop_keys_of_the_old_kind(table, way, value)
    for rival in _RIVALS.get(last, ()):
        table.pop(rival, None)
    table[last] = value


def steps_of(path: str) -> list[str | int]:
    """Return the keys and list places of ``a.b[0].c`` or ``a.b.0.c``; empty if it is no path."""
    steps: list[str | int] = []
    for part in path.split("."):
        match = _PART.fullmatch(part.strip())
        if match is None:
            return []
        key = match["key"]
        steps.append(int(key) if _PLACE.fullmatch(key) else key)
        steps.extend(int(place) for place in _PLACE.findall(match["places"]))
    return steps if isinstance(steps[0], str) else []


def _example(path: str) -> str:
    """Return how to change a key by what came without a value; empty if that is no key."""
    below = [path] if path in KEYS else [key for key in KEYS if key.startswith(f"{path}.")]
    return f"For example {below[0]}=VALUE, without blanks." if below else ""


def _holder(tables: Table, steps: list[str | int], setting: str) -> Any:
    """Return the table or list that `steps` lead to; a table is made if nothing is there."""
    found: Any = tables
    for depth, step in enumerate(steps):
        if isinstance(found, list) and isinstance(step, str) and len(found) == 1:
            found = found[0]
        if isinstance(found, list) and isinstance(step, int) and step < len(found):
            found = found[step]
        elif isinstance(found, dict) and isinstance(step, str):
            found = found.setdefault(step, {})
        else:
            where = steps[:depth] or [step]
            raise InputError("--set", f"'{_path(where)}' to hold tables", repr(setting))
    return found


def _as_table(found: Any, steps: list[str | int], setting: str) -> Table:
    if isinstance(found, list) and len(found) == 1:
        found = found[0]
    if not isinstance(found, dict):
        hint = ""
        if isinstance(found, list):
            hint = f"Say which one: {_path([*steps, 0])}."
        raise InputError("--set", f"'{_path(steps)}' to be a table", repr(setting), hint)
    return found


def _set_entry(found: Any, where: tuple[list[str | int], int], value: object, setting: str) -> None:
    """Set an entry of a list that is there."""
    steps, place = where
    if not isinstance(found, list) or place >= len(found):
        name = _path(steps)
        hint = f"Give the whole list first: {name}=[...]." if found == {} else ""
        raise InputError(
            "--set", f"'{name}' to be a list with a place {place}", repr(setting), hint
        )
    found[place] = value


def _drop_keys_of_the_old_kind(table: Table, steps: list[str | int], kind: object) -> None:
    """Drop what the table's kind has and `kind` has not; keys of neither are left to be refused."""
    path = ".".join(step for step in steps if isinstance(step, str))
    before, after = (keys_of_kind(path, str(named)) for named in (table.get("kind"), kind))
    if before is None or after is None:
        return
    for key in [key for key in table if key in before and key != "kind"]:
        if key not in after or table[key] not in after[key].get("enum", [table[key]]):
            del table[key]


def _path(steps: list[str | int]) -> str:
    parts = [f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps]
    return "".join(parts).removeprefix(".")
