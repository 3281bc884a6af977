"""A case file: TOML tables in, records out. The interface is described in docs/case-file.md."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table, as_table, build, choose, refuse_unknown, to_table
from stokesfibers.fiber.initial import INITIALS, AbstractInitial, FromFile, NearlyStraight
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.tables import TABLES, problem_from_tables, problem_to_tables
from stokesfibers.run.schedule import Schedule


@dataclass(frozen=True)
class Case:
    """Everything a case file says.

    Attributes
    ----------
    problem
        What is solved.
    initial
        The shapes at time 0.
    until
        Time to stop.
    record
        What is recorded when.
    """

    problem: Problem
    initial: AbstractInitial
    until: float
    record: Schedule

    def tables(self) -> Table:
        """Return the resolved case as tables, with every default spelled out."""
        tables = problem_to_tables(self.problem)
        tables["stepping"]["until"] = self.until
        tables["initial"] = to_table(self.initial)
        tables["record"] = to_table(self.record)
        return tables


def load_case(
    path: str | Path, settings: Iterable[str] = (), *, allow_python: bool = False
) -> Case:
    """Read a case file.

    Parameters
    ----------
    path
        TOML file.
    settings
        Changes of the form ``"table.key=value"``, the value in TOML.
    allow_python
        Whether a flow from a user's Python file may run.

    Raises
    ------
    InputError
        With the file or the path ``table.key`` that is wrong.
    """
    file = Path(path)
    tables = read_tables(file)
    for setting in settings:
        apply_setting(tables, setting)
    return case_from_tables(tables, folder=file.parent, allow_python=allow_python)


def read_tables(file: Path) -> Table:
    """Return the tables of a TOML file; InputError if it cannot be read."""
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(str(file), "a case file", "nothing: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(str(file), "a readable TOML file", str(error)) from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(str(file), "valid TOML", str(error)) from None


def apply_setting(tables: Table, setting: str) -> None:
    """Change `tables` by ``"table.key=value"``; a value that is not TOML is taken as text."""
    path, separator, text = setting.partition("=")
    keys = [k.strip() for k in path.split(".")]
    if not separator or not all(keys):
        raise InputError("--set", "table.key=value", repr(setting))
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    table: Any = tables
    for depth, key in enumerate(keys[:-1]):
        table = table.setdefault(key, {}) if isinstance(table, dict) else None
        if isinstance(table, list) and len(table) == 1:
            table = table[0]
        if not isinstance(table, dict):
            where = ".".join(keys[: depth + 1])
            raise InputError("--set", f"'{where}' to be a table", repr(setting))
    # The two ways to say the same thing exclude each other: the new one replaces the old.
    for one, other in (("mu_bar", "viscosity"), ("slenderness", "radius")):
        if keys[-1] in (one, other):
            table.pop(other if keys[-1] == one else one, None)
    table[keys[-1]] = value


def case_from_tables(
    tables: Mapping[str, Any], *, folder: Path = Path(), allow_python: bool = False
) -> Case:
    """Return the case that `tables` describe; relative paths start from `folder`."""
    refuse_unknown(tables, (*TABLES, "initial", "record"), "")
    problem = problem_from_tables(tables, folder=folder, allow_python=allow_python)
    initial = choose(
        INITIALS,
        as_table(tables.get("initial", {"kind": NearlyStraight.kind}), "initial"),
        "initial",
    )
    if isinstance(initial, FromFile):
        initial = replace(initial, path=str(folder / initial.path))
    stepping = as_table(tables.get("stepping", {}), "stepping")
    if "until" not in stepping:
        raise InputError("stepping.until", "the time to stop", "nothing")
    until = checks.positive("stepping.until", stepping["until"])
    record = as_table(tables.get("record", {}), "record")
    record.setdefault("positions_every", until / 200.0)
    return Case(problem, initial, until, build(Schedule, record, "record"))
