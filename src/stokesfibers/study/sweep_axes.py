"""The axes of a sweep: each is a list of points, and a point sets one or more parameters.

The tables [grid], [[zip]], [[cases]] and the key `seeds` of a sweep file become axes; the cases of
the sweep are all combinations of a point of each.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from dataclasses import asdict, dataclass
from typing import Any, Self

from stokesfibers.config.keys import KEYS, refuse_misplaced
from stokesfibers.config.settings import steps_of
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table, as_table, did_you_mean
from stokesfibers.study.sweep_values import RANGES, leaves, seeds_of, short_names, values_of

SEED = "initial.seed"
FACTS = {"status", "reason", "doubt", "run", "time_reached", "wall_time"}
"""What the dataset of a sweep says of each case, beside what is collected."""
_TAKEN = {"time", "record", "fiber", "node", "space", "i", "j", *FACTS}


@dataclass(frozen=True)
class Axis:
    """One dimension of a sweep.

    Attributes
    ----------
    name
        Name of the dimension.
    points
        For each place along it the values to set, by path.
    labels
        Names of the places, where the user gave some; else empty.
    """

    name: str
    points: tuple[Table, ...]
    labels: tuple[str, ...] = ()

    @property
    def paths(self) -> tuple[str, ...]:
        """The paths that any point sets, in order."""
        return tuple(dict.fromkeys(path for point in self.points for path in point))

    def to_table(self) -> Table:
        """Return the axis as JSON-ready values."""
        return asdict(self)

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Self:
        """Return the axis that `to_table` gave."""
        return cls(table["name"], tuple(table["points"]), tuple(table["labels"]))


def axes_of(tables: Mapping[str, Any], variables: Set[str] = frozenset()) -> tuple[Axis, ...]:
    """Return the axes that the tables of a sweep ask for.

    Parameters
    ----------
    tables
        Of the sweep.
    variables
        Names that the dataset needs for what is collected.

    Raises
    ------
    InputError
        If there are none, a path is on two, or one cannot be used.
    """
    drafts = [*_grid(tables.get("grid", {})), *_zips(tables.get("zip", []))]
    if "cases" in tables:
        drafts.append(_cases(tables["cases"]))
    if "seeds" in tables:
        drafts.append(Axis("seed", tuple({SEED: seed} for seed in seeds_of(tables["seeds"]))))
    if not drafts:
        expected = "something to sweep: [grid], [[zip]], [[cases]] or seeds"
        raise InputError("sweep", expected, "nothing", 'For example: [grid] "fluid.mu_bar" = [..]')
    paths = [path for axis in drafts for path in axis.paths]
    for path in paths:
        if paths.count(path) > 1:
            raise InputError(path, "to be swept once", "on two axes")
    return _named(drafts, short_names(paths), {*_TAKEN, *variables})


def check_path(where: str, path: str) -> None:
    """Refuse the path of a change that leads to no key; InputError at `where`."""
    if not steps_of(path):
        expected = "the path of a key, such as fluid.mu_bar"
        raise InputError(where, expected, repr(path))
    try:
        refuse_misplaced(path, path)
    except InputError as error:
        raise InputError(where, "a key of the case", repr(path), error.hint) from None


def _check_swept(where: str, path: str) -> None:
    check_path(where, path)
    _refuse_range(where, path)


def _refuse_range(where: str, path: str) -> None:
    """Refuse a table where a key holds a value: a range that has another name, or two ranges."""
    key, _, name = path.rpartition(".")
    holds_keys = any(known.startswith(f"{key}.") for known in KEYS)
    if key in KEYS and not holds_keys and not name.isdecimal():
        expected = f"one range, {', '.join(RANGES)}, or a list of values"
        place = where.removesuffix(f".{name}")
        hint = "" if name in RANGES else did_you_mean(name, RANGES)
        raise InputError(place, expected, f"'{name}'", hint)


def _grid(value: object) -> Iterator[Axis]:
    for path, given in leaves(as_table(value, "grid")):
        _check_swept(f"grid.{path}", path)
        yield Axis("", tuple({path: v} for v in values_of(f"grid.{path}", given)))


def _zips(value: object) -> Iterator[Axis]:
    for k, given in enumerate(value if isinstance(value, list) else [value]):
        where = f"zip[{k}]"
        table = as_table(given, where)
        name = _text(f"{where}.name", table.pop("name", ""))
        found = dict(leaves(table))
        for path in found:
            _check_swept(f"{where}.{path}", path)
        columns = {path: _column(f"{where}.{path}", v) for path, v in found.items()}
        if len({len(column) for column in columns.values()}) != 1:
            lengths = ", ".join(f"{path}: {len(v)}" for path, v in columns.items())
            raise InputError(where, "lists of one length", lengths or "nothing")
        rows = zip(*columns.values(), strict=True)
        yield Axis(name, tuple(dict(zip(columns, row, strict=True)) for row in rows))


def _column(where: str, value: object) -> tuple[Any, ...]:
    """Return the values of a list that is walked along with others: they may repeat."""
    if isinstance(value, list | tuple):
        return tuple(v for entry in value for v in values_of(where, [entry]))
    return values_of(where, value)


def _cases(value: object) -> Axis:
    if not isinstance(value, list) or not value:
        raise InputError("cases", "tables, [[cases]]", repr(value))
    points, labels = [], []
    for k, given in enumerate(value):
        table = as_table(given, f"cases[{k}]")
        labels.append(_text(f"cases[{k}].name", table.pop("name", str(k))))
        found = dict(leaves(table))
        for path in found:
            check_path(f"cases[{k}].{path}", path)
        points.append({path: values_of(path, [v])[0] for path, v in found.items()})
    for label in labels:
        if labels.count(label) > 1:
            raise InputError("cases", "different names", f"{label!r} twice")
    return Axis("case", tuple(points), tuple(labels))


def _text(where: str, value: object) -> str:
    if not isinstance(value, str):
        raise InputError(where, "a text", value)
    return value


def _named(axes: list[Axis], short: dict[str, str], taken: Set[str]) -> tuple[Axis, ...]:
    """Return the axes with the names of their parameters where they have none."""
    named = []
    for axis in axes:
        name = axis.name or "_".join(short[path] for path in axis.paths)
        named.append(Axis(name, axis.points, axis.labels))
    names = [axis.name for axis in named]
    for axis in named:
        others = {short[path] for path in short if path not in axis.paths}
        if names.count(axis.name) > 1 or axis.name in {*taken, *others}:
            hint = "Set name in [[zip]]." if len(axis.paths) > 1 else ""
            raise InputError("sweep", "dimensions with names of their own", repr(axis.name), hint)
    return tuple(named)
