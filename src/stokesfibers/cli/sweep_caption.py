"""What all cases of a sweep have alike: what the caption of its figure has to say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stokesfibers.study.sweep_plan import Plan, SweepCase

_TABLES = ("fiber", "fluid", "flow", "domain", "load", "initial", "model", "stepping", "stop")


def caption(plan: Plan) -> str:
    """Return the values that all cases share, defaults too, as one line; empty if none is."""
    from stokesfibers.study.sweep_values import toml_text

    shared = dict(_shared([_physics(plan, case) for case in plan.cases]))
    if plan.collect.after:
        shared["collect.after"] = plan.collect.after
    return ", ".join(f"{path} = {toml_text(value)}" for path, value in shared.items())


def _physics(plan: Plan, case: SweepCase) -> dict[str, Any]:
    """Return the tables of a case that say what moves and how; numerics only by the tolerance."""
    from stokesfibers.core.errors import InputError
    from stokesfibers.study.sweep_plan import load_case

    try:
        tables = load_case(case, Path(plan.folder), allow_python=False).tables()
    except InputError:  # it has a Python file, which is not run to draw a figure
        return {name: held for name, held in case.tables.items() if name in _TABLES}
    model, kinds = tables["model"], tables["fiber"]
    fiber = kinds[0] if len(kinds) == 1 else kinds
    return {
        **{name: tables[name] for name in _TABLES if name in tables},
        "fiber": fiber,
        "model": {key: model[key] for key in ("mobility", "regularization") if key in model},
    }


def _shared(held: Sequence[Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield path and value of what is the same in all of `held`."""
    first = held[0]
    if all(isinstance(one, dict) for one in held):
        for key in first:
            if all(key in one for one in held):
                yield from _shared([one[key] for one in held], f"{path}.{key}".strip("."))
    elif all(one == first for one in held) and not _has_tables(first):
        yield path, first
    elif all(isinstance(one, list) and len(one) == len(first) for one in held):
        for k in range(len(first)):
            yield from _shared([one[k] for one in held], f"{path}[{k}]")


def _has_tables(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(one, dict) for one in value)
