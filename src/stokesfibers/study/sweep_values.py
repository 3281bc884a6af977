"""The values a swept parameter takes: lists, ranges and seeds, and how they are said in text."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table

RANGES = {"linspace": np.linspace, "geomspace": np.geomspace, "logspace": np.logspace}
"""Ranges by their names in NumPy: first and last value, ends included, and how many; the ends of
``logspace`` are exponents of ten."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_LAST = re.compile(r"[^.]+(?:\.\d+)*$")
_LONGEST_WORD = 24
_DIGITS = 14  # of a range's values: 640000, not 640000.0000000005


def leaves(table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield path and value of everything in nested tables.

    So ``fluid.mu_bar = [...]`` and ``"fluid.mu_bar" = [...]`` are the same. A range is a value, and
    so is a table with a kind and more: it replaces what was there, keys of other kinds included.
    """
    for key, value in table.items():
        here = f"{path}.{key}" if path else str(key)
        if isinstance(value, Mapping) and not _is_range(value) and not _is_choice(value):
            yield from leaves(value, here)
        else:
            yield here, value


def values_of(where: str, value: object) -> tuple[Any, ...]:
    """Return the values of a list or a range.

    Raises
    ------
    InputError
        If there are none, or two are the same.
    """
    found = _range(where, value) if isinstance(value, Mapping) else plain(value)
    if not isinstance(found, list) or not found:
        expected = f"a list of values, or a range such as {{linspace = [0.1, 1.0, 4]}} ({where})"
        raise InputError(where, expected, repr(found))
    _refuse_repeated(where, found)
    return tuple(found)


def seeds_of(value: object) -> tuple[int, ...]:
    """Return the seeds 0 to n - 1 for a number n, or those of a list."""
    value = plain(value)
    if not isinstance(value, list):
        return tuple(range(checks.whole("seeds", value, 1)))
    found = [checks.whole(f"seeds[{k}]", seed, 0) for k, seed in enumerate(value)]
    return values_of("seeds", found)


def plain(value: Any) -> Any:
    """Return arrays and NumPy numbers as plain Python values, tuples as lists."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple | range):
        return [plain(entry) for entry in value]
    return value


def toml_text(value: Any) -> str:
    """Return `value` as TOML that can follow ``key =``; InputError if TOML cannot hold it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, list):
        return f"[{', '.join(map(toml_text, value))}]"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_key(k)} = {toml_text(v)}' for k, v in value.items())}}}"
    raise InputError("value", "a number, a text, true or false, a list or a table", value)


def word(value: Any) -> str:
    """Return a value as a short word for a file name."""
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return re.sub(r"[^A-Za-z0-9.+-]+", "_", text).strip("_")[:_LONGEST_WORD] or "_"


def short_names(paths: list[str]) -> dict[str, str]:
    """Return for each path its last key, or more of it where that would not be unique.

    The place of an entry, as in ``load.force.1``, stays with its key.
    """
    names = {path: _joined(_last(path)) for path in paths}
    return {
        path: name if list(names.values()).count(name) == 1 else _joined(path)
        for path, name in names.items()
    }


def _last(path: str) -> str:
    found = _LAST.search(path)
    return found[0] if found else path


def _joined(path: str) -> str:
    return re.sub(r"\W+", "_", path).strip("_")


def _key(key: object) -> str:
    return str(key) if _BARE.fullmatch(str(key)) else _quoted(str(key))


def _quoted(text: str) -> str:
    # TOML's strings are those of JSON, without pairs of surrogates and with DEL escaped.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _is_range(value: Mapping[str, Any]) -> bool:
    return len(value) == 1 and next(iter(value)) in RANGES


def _is_choice(value: Mapping[str, Any]) -> bool:
    return isinstance(value.get("kind"), str) and len(value) > 1


def _range(where: str, value: Mapping[str, Any]) -> list[float]:
    ((kind, ends),) = value.items()
    ends = plain(ends)
    if not isinstance(ends, list) or len(ends) != 3:
        raise InputError(f"{where}.{kind}", "first value, last value and how many", repr(ends))
    first, last = (checks.finite(f"{where}.{kind}[{k}]", ends[k]) for k in (0, 1))
    count = checks.whole(f"{where}.{kind}[2]", ends[2], 1)
    if kind == "geomspace" and not first * last > 0.0:
        raise InputError(f"{where}.{kind}", "ends of one sign, not zero", repr(ends))
    with np.errstate(over="ignore"):
        whole = RANGES[kind](first, last, count).tolist()
    found = [v if v in (first, last) else float(f"{v:.{_DIGITS}g}") for v in whole]
    if not all(map(math.isfinite, found)):
        hint = "The ends are exponents of ten." if kind == "logspace" else ""
        raise InputError(f"{where}.{kind}", "numbers that are finite", repr(ends), hint)
    return found


def _refuse_repeated(where: str, values: list[Any]) -> None:
    seen: Table = {}
    for k, value in enumerate(values):
        text = toml_text(value)
        if text in seen:
            got = f"{text} at places {seen[text]} and {k}"
            raise InputError(where, "different values", got)
        seen[text] = k
