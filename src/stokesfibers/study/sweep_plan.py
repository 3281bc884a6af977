"""A sweep file, or the same tables from Python, resolved into cases before anything runs."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, Self

from stokesfibers.config.case import Case, case_from_tables, near_name, read_tables
from stokesfibers.config.settings import apply_setting
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table, as_table, refuse_unknown
from stokesfibers.fiber.initial import FromFile
from stokesfibers.study.sweep_axes import Axis, axes_of, check_path
from stokesfibers.study.sweep_collect import Collect
from stokesfibers.study.sweep_values import leaves, plain, short_names, toml_text, word

FORMAT, FORMAT_VERSION = "stokesfibers-sweep", 1
SWEEP_KEYS = {
    "base": "the case file that is varied, seen from the sweep file",
    "[case]": "the case itself, its tables below [case.fiber] and so on, instead of base",
    "[set]": "changes that all cases share, by their paths, as with --set: stepping.until = 12.0",
    "[grid]": "every combination: fluid.mu_bar = [1e4, 1e5], or { geomspace = [1e4, 1e6, 5] }, "
    "linspace, logspace as in NumPy",
    "[[zip]]": "lists that are walked together, one dimension; name is optional",
    "[[cases]]": "variants that are no grid, each with a name and any changes",
    "seeds": "initial.seed from 0 to n - 1, or a list: drawn as mean and error",
    "[collect]": "what is kept: series, final, largest, smallest, mean of observables",
}
"""What may stand in a sweep file, and what it is for."""
_KEYS = tuple(key.strip("[]") for key in SWEEP_KEYS)
_LONGEST_NAME = 80

Source = str | PathLike[str] | Mapping[str, Any]
"""A sweep file, or its tables."""


@dataclass(frozen=True)
class SweepCase:
    """One case of a sweep.

    Attributes
    ----------
    key
        Hash of the resolved case: the same case has it in each sweep, edited or not.
    name
        For people and for the store: the swept values, then the key.
    values
        The swept values by path.
    tables
        The case as tables, before defaults; paths of files are relative to the base's folder.
    until
        Time to stop.
    """

    key: str
    name: str
    values: Table
    tables: Table
    until: float


@dataclass(frozen=True)
class Plan:
    """A sweep, ready to run.

    Attributes
    ----------
    axes
        Its dimensions.
    cases
        All combinations, the last axis fastest.
    collect
        What is kept of each.
    folder
        Where relative paths of the base case start.
    source
        The sweep file, or a word for tables from Python.
    """

    axes: tuple[Axis, ...]
    cases: tuple[SweepCase, ...]
    collect: Collect
    folder: str
    source: str

    def to_table(self) -> Table:
        """Return the plan as JSON-ready values."""
        return {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "source": self.source,
            "folder": self.folder,
            "axes": [axis.to_table() for axis in self.axes],
            "collect": self.collect.to_table(),
            "cases": [asdict(case) for case in self.cases],
        }

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Self:
        """Return the plan that `to_table` gave; KeyError or TypeError if it is none."""
        return cls(
            tuple(map(Axis.from_table, table["axes"])),
            tuple(SweepCase(**case) for case in table["cases"]),
            Collect.from_table(table["collect"]),
            table["folder"],
            table["source"],
        )


def read_plan(source: Source, settings: Iterable[str] = (), *, allow_python: bool = False) -> Plan:
    """Read a sweep and resolve and check all its cases.

    Parameters
    ----------
    source
        TOML file, or the same tables.
    settings
        Changes of the base case, ``"table.key=value"``.
    allow_python
        Whether flows and loads from users' Python files may run.

    Raises
    ------
    InputError
        With the file, the key or the case that is wrong.
    """
    if isinstance(source, Mapping):
        tables, said, place = dict(source), "a sweep from Python", Path()
    else:
        tables, said = read_tables(Path(source), "a sweep file"), str(source)
        place = Path(source).parent
    refuse_unknown(tables, _KEYS, "")
    base, folder = _base(tables, place, said)
    collect = Collect.from_table(as_table(tables.get("collect", {}), "collect"))
    axes = axes_of(tables, collect.variables)
    swept = {path for axis in axes for path in axis.paths}
    for path, value in leaves(as_table(tables.get("set", {}), "set")):
        _apply(base, path, value, where="set", swept=swept)
    for setting in settings:
        _refuse_swept(setting.partition("=")[0].strip(), "--set", swept)
        apply_setting(base, setting)
    short = short_names([path for axis in axes for path in axis.paths])
    cases: dict[str, SweepCase] = {}
    places = []
    for points in itertools.product(*(axis.points for axis in axes)):
        values = {path: value for point in points for path, value in point.items()}
        case = _resolved(base, values, short, (collect, folder, allow_python))
        # What resolves to the same case, by values without effect, shares one run.
        first = cases.setdefault(case.key, case)
        places.append(replace(case, name=first.name))
    return Plan(axes, tuple(places), collect, str(folder), said)


def load_case(case: SweepCase, folder: Path, *, allow_python: bool) -> Case:
    """Return a case of a plan as records."""
    return case_from_tables(deepcopy(case.tables), folder=folder, allow_python=allow_python)


def _base(tables: Table, place: Path, said: str) -> tuple[Table, Path]:
    """Return the tables of the base case and the folder where its paths start."""
    if ("base" in tables) == ("case" in tables):
        came = "both" if "base" in tables else "neither"
        raise InputError("base", "a case file, base = 'FILE', or its tables, [case]", came)
    if "case" in tables:
        return plain(as_table(tables["case"], "case")), place.resolve()
    if not isinstance(tables["base"], str | PathLike):
        raise InputError("base", "the name of a case file", tables["base"])
    file = place / tables["base"]
    if not file.exists():
        got = f"'{tables['base']}' in {said}, which is not there"
        raise InputError("base", "a case file, seen from the sweep file", got, near_name(file))
    return read_tables(file), file.parent.resolve()


def _apply(base: Table, path: str, value: Any, *, where: str, swept: set[str]) -> None:
    _refuse_swept(path, where, swept)
    check_path(f"{where}.{path}", path)
    apply_value(base, path, value, where=where)


def apply_value(tables: Table, path: str, value: Any, *, where: str) -> None:
    """Set the value at a path as ``--set`` does; InputError at `where` if it cannot be set."""
    try:
        apply_setting(tables, f"{path}={toml_text(plain(value))}")
    except InputError as error:
        raise InputError(f"{where}.{path}", error.expected, error.got, error.hint) from None


def _refuse_swept(path: str, where: str, swept: set[str]) -> None:
    if path in swept:
        raise InputError(where, "a key that is not swept", repr(path), "Change it where it is.")


def _resolved(
    base: Table, values: Table, short: dict[str, str], how: tuple[Collect, Path, bool]
) -> SweepCase:
    """Return one case, checked; errors say which it is."""
    collect, folder, allow_python = how
    words = ",".join(f"{short[path]}={word(value)}" for path, value in values.items())
    tables = deepcopy(base)
    try:
        for path, value in values.items():
            apply_value(tables, path, value, where="sweep")
        case = case_from_tables(deepcopy(tables), folder=folder, allow_python=allow_python)
        collect.check(case.problem, case.until, case.record.observables_interval)
        # Placing many at random takes time, and may fail for some seeds alone.
        if len(case.problem.fibers) == 1 or isinstance(case.initial, FromFile):
            case.plan()
    except InputError as error:
        got = f"{error.got}, in the case {words}"
        raise InputError(error.where, error.expected, got, error.hint) from None
    key = key_of(case)
    return SweepCase(key, f"{words[:_LONGEST_NAME]}-{key}", values, tables, case.until)


def key_of(case: Case) -> str:
    """Return a hash of the resolved case: of numbers their values, of files their content.

    Neither how a number is written nor where a file lies is part of it.
    """
    tables = case.tables()
    content = b""
    if isinstance(case.initial, FromFile):
        content = Path(tables["initial"].pop("path")).read_bytes()
    text = json.dumps(_canonical(tables), sort_keys=True)
    return hashlib.sha256(text.encode() + content).hexdigest()[:12]


def _canonical(value: Any) -> Any:
    """Return `value` with one form for equal numbers, and without places of files."""
    if isinstance(value, Mapping):
        known = {"path", "file"} if "sha256" in value and not _looks_around(value) else set()
        return {key: _canonical(entry) for key, entry in value.items() if key not in known}
    if isinstance(value, list | tuple):
        return [_canonical(entry) for entry in value]
    if isinstance(value, float) and value.is_integer():
        return int(value)  # not the other way: whole numbers may be too long for a float
    return value


def _looks_around(table: Mapping[str, Any]) -> bool:
    """Return whether a Python file asks where it lies: what it does may depend on that."""
    return b"__file__" in Path(table.get("file") or table["path"]).read_bytes()
