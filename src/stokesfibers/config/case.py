"""A case file: TOML tables in, records out. The interface is described in docs/case-file.md."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from stokesfibers.config.settings import apply_setting
from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import (
    Table,
    as_table,
    build,
    choose,
    did_you_mean,
    refuse_unknown,
    to_table,
)
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.initial import AbstractInitial, FromFile, NearlyStraight, Straight
from stokesfibers.fiber.initials import INITIALS
from stokesfibers.flow.base import to_dict
from stokesfibers.flow.period import period_of
from stokesfibers.problem.doubt import Plan
from stokesfibers.problem.flow_tables import resolved_flow
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.tables import TABLES, problem_from_tables, problem_to_tables
from stokesfibers.run.events import StopWhen
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import nodal_positions

_LINE = re.compile(r"at line (\d+)")
_LONGEST_LINE = 80
_KEY = r"^[^=#'\"]*=\s*"
_SLIPS = (
    (
        re.compile(_KEY + r"[-+]?(\d+),(\d+)\s*(#.*)?$"),
        lambda found: f"Decimals have a point: {found[1]}.{found[2]}.",
    ),
    (re.compile(_KEY + r"(#.*)?$"), lambda _: "A value is missing behind =."),
    (
        re.compile(_KEY + r"(true|false)\b", re.IGNORECASE),
        lambda found: f"Write {found[1].lower()}.",
    ),
    (
        re.compile(_KEY + r"[-+]?[\d.]+([eE][-+]?\d+)?\s*[a-zA-Z%]"),
        lambda _: "Numbers have no unit behind them.",
    ),
    (re.compile(_KEY + r"[a-zA-Z]"), lambda _: "Text is in quotes."),
)
"""What lines that are no TOML often have, and what to say of it."""
_TWICE = re.compile(r"overwrite|[Dd]uplicate|twice")


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
    flow
        The resolved table [flow]; Python files have absolute paths and checksums.
    stop
        Conditions that end the run before.
    """

    problem: Problem
    initial: AbstractInitial
    until: float
    record: Schedule
    flow: Table
    stop: tuple[StopWhen, ...] = ()

    def tables(self) -> Table:
        """Return the resolved case as tables, with every default spelled out."""
        tables = problem_to_tables(self.problem)
        tables["flow"] = self.flow
        tables["stepping"]["until"] = self.until
        tables["initial"] = to_table(self.initial)
        tables["record"] = to_table(self.record)
        if self.stop:
            tables["stop"] = [to_table(event) for event in self.stop]
        return tables

    def plan(self) -> Plan:
        """Return what the checks of doubtful choices need beside the problem.

        Raises
        ------
        InputError
            If the initial shapes cannot be had.
        """
        shape = self.initial
        return Plan(
            until=self.until,
            positions_every=self.record.positions_every,
            observables_every=self.record.observables_interval,
            positions=nodal_positions(self.curves(), self.problem),
            angle=shape.angle if isinstance(shape, Straight | NearlyStraight) else 0.0,
            tilt=shape.tilt if isinstance(shape, Straight | NearlyStraight) else 0.0,
            across=shape.across if isinstance(shape, NearlyStraight) else 1.0,
        )

    def curves(self) -> tuple[Curve, ...]:
        """Return the initial shapes; InputError if they cannot be had."""
        return self.initial.curves(self.problem.fibers, self.problem.domain.lengths)


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


def read_tables(file: Path, what: str = "a case file") -> Table:
    """Return the tables of a TOML file; InputError if it cannot be read.

    Parameters
    ----------
    file
        The file.
    what
        What it should be, for errors.
    """
    if file.is_dir():
        inside = min(file.glob("*.toml"), default=None)
        hint = f"There is {inside} in it." if inside else ""
        raise InputError(str(file), what, "a folder", hint)
    if file.exists() and not file.is_file():  # a device has no end
        raise InputError(str(file), "a readable TOML file", "something that is no file")
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(str(file), what, "nothing: no such file", near_name(file)) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(str(file), "a readable TOML file", str(error)) from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        hint = _line_at_fault(text, str(error))
        raise InputError(str(file), "valid TOML", str(error), hint) from None


def near_name(file: Path) -> str:
    """Return the hint at the TOML file that was meant by `file`; empty if none is near."""
    return did_you_mean(file.name, sorted(near.name for near in file.parent.glob("*.toml")))


def _line_at_fault(text: str, told: str) -> str:
    """Return the line that an error of TOML tells of, with what it may lack; empty if none."""
    place = _LINE.search(told)
    lines = text.splitlines()
    if place is None or int(place[1]) > len(lines):
        return ""
    line = lines[int(place[1]) - 1].strip()
    if not line:
        return ""
    advice = next((say(found) for form, say in _SLIPS if (found := form.search(line))), "")
    if _TWICE.search(told):
        advice = "It is there twice."
    return f"The line is: {line[:_LONGEST_LINE]}  {advice}".strip()


def case_from_tables(
    tables: Mapping[str, Any], *, folder: Path = Path(), allow_python: bool = False
) -> Case:
    """Return the case that `tables` describe; relative paths start from `folder`."""
    refuse_unknown(tables, (*TABLES, "initial", "record", "stop"), "")
    problem = problem_from_tables(tables, folder=folder, allow_python=allow_python)
    _refuse_units_left_open(tables)
    initial = choose(
        INITIALS,
        as_table(tables.get("initial", {"kind": NearlyStraight.kind}), "initial"),
        "initial",
    )
    if isinstance(initial, FromFile):
        initial = replace(initial, path=str((folder / initial.path).resolve()))
    stepping = as_table(tables.get("stepping", {}), "stepping")
    until = _until(stepping, problem)
    record = as_table(tables.get("record", {}), "record")
    record.setdefault("positions_every", until / 200.0)
    flow = resolved_flow(problem.flow, tables.get("flow", {}), folder)
    chosen = build(Schedule, record, "record")
    return Case(problem, initial, until, chosen, flow, _stop(tables.get("stop", [])))


def _until(stepping: Mapping[str, Any], problem: Problem) -> float:
    """Return the time to stop, which may be given in cycles of the flow."""
    if "cycles" not in stepping:
        if "until" not in stepping:
            raise InputError("stepping.until", "the time to stop", "nothing")
        return checks.positive("stepping.until", stepping["until"])
    if "until" in stepping:
        raise InputError("stepping", "either until or cycles", "both")
    period = period_of(to_dict(problem.flow))
    if period is None:
        hint = "Give stepping.until instead."
        raise InputError("stepping.cycles", "a flow that oscillates", problem.flow.kind, hint)
    return period * checks.positive("stepping.cycles", stepping["cycles"])


def _refuse_units_left_open(tables: Mapping[str, Any]) -> None:
    """Raise InputError if a viscosity is given, in some units, but no length or rigidity in them.

    With mu_bar both are 1 by themselves, as the problem is then without dimensions.
    """
    if "viscosity" not in tables.get("fluid", {}):
        return
    fibers = tables.get("fiber", {})
    several = isinstance(fibers, list)
    for k, fiber in enumerate(fibers if several else [fibers]):
        for key, what in (("length", "L"), ("rigidity", "E, the bending rigidity")):
            if key not in fiber:
                raise InputError(
                    f"fiber[{k}].{key}" if several else f"fiber.{key}",
                    f"{what}, in the units of fluid.viscosity",
                    "nothing",
                    "Only with fluid.mu_bar it is 1 by itself.",
                )


def _stop(value: object) -> tuple[StopWhen, ...]:
    """Return the conditions of [[stop]] tables, or of a single [stop]."""
    if not isinstance(value, list):
        return (build(StopWhen, as_table(value, "stop"), "stop"),)
    return tuple(
        build(StopWhen, as_table(table, f"stop[{k}]"), f"stop[{k}]")
        for k, table in enumerate(value)
    )
