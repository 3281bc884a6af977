"""What all cases of a sweep have alike: what the caption of its figure has to say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stokesfibers.study.sweep_plan import Plan

_MISSING = object()
_LEFT_OUT = ("record", "stop")  # they do not change how fibers move


def caption(plan: Plan) -> str:
    """Return the values that the case files of all cases share, as one line."""
    from stokesfibers.study.sweep_values import toml_text

    first, *others = (dict(_values(case.tables)) for case in plan.cases)
    return ", ".join(
        f"{path} = {toml_text(value)}"
        for path, value in first.items()
        if all(one.get(path, _MISSING) == value for one in others)
    )


def _values(table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield path and value of each key, of tables with a kind too."""
    for key, value in table.items():
        here = f"{path}.{key}" if path else key
        if isinstance(value, Mapping):
            yield from _values(value, here)
        elif here.partition(".")[0] not in _LEFT_OUT:
            yield here, value
