"""What all cases of a sweep have alike, in the words of a figure's caption."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stokesfibers.cli.words import number, plain

if TYPE_CHECKING:
    from stokesfibers.study.sweep_plan import Plan, SweepCase

_SAID_BY_NONE = {
    "fiber.count": 1,
    "domain.kind": "free",
    "load.kind": "none",
    "initial.centre": [0.0, 0.0, 0.0],
    "initial.tilt": 0.0,
}
"""Values of which a caption does not speak."""
_SLENDERNESS = "fiber.slenderness"
_MEANT = {
    _SLENDERNESS: "radius / length",
    "flow.frequency": "cycles per time",
    "initial.angle": "radians to the x-axis",
    "initial.tilt": "radians out of the xy-plane",
}
"""What a reader of a caption asks of a value."""
_SMALL = 0.01
_NUMERICS = ("allow_small_m", "newton_passes")
_FIXED = ("", "kind", "mobility", "regularization")  # keys whose texts are words, not names
_BARE = ("model", "stepping")  # tables whose keys say by themselves what they are
_TABLES = ("fiber", "fluid", "flow", "domain", "load", "initial", "model", "stepping", "stop")


def _meaning(path: str, value: Any, shared: Mapping[str, Any], rate: str) -> str:
    """Return what a value means where its name does not say it; empty elsewhere.

    `rate` is what the flow's rate of 1 is called, with a space behind it; empty if it is not 1.
    """
    if path == "initial.amplitude" and shared.get("initial.kind") == "nearly_straight":
        angle, tilt = (shared.get(f"initial.{name}") for name in ("angle", "tilt"))
        if angle is None or tilt is None:
            return f"an arc of height up to {abs(value) / 256.0:.2g} L"
        return f"an arc of height {_bend(value, angle, tilt):.2g} L"
    if path == "flow.kind" and value == "oscillatory_shear":
        return "rate amplitude x sin(2 pi frequency t)"
    if path == "fluid.mu_bar":
        return f"8 pi mu {rate}L^4 / E"
    return _MEANT.get(path, "")


def _bend(amplitude: float, angle: float, tilt: float) -> float:
    from stokesfibers.fiber.initial import NearlyStraight

    return NearlyStraight(angle=angle, amplitude=amplitude, tilt=tilt).bend


def spread_doubt(plan: Plan, cases: Iterable[int], spread: float) -> Iterator[str]:
    """Yield a doubt if values differ by a `spread`, over the largest, that `rtol` allows as error.

    `cases` are the numbers of those drawn; if they differ in `rtol`, its errors are what is shown.
    What differs by less than a part in a million is told as the same elsewhere.
    """
    from stokesfibers.plot.sweep_notes import ALIKE

    if not ALIKE < spread < _SMALL:
        return
    tables = [_physics(plan, plan.cases[k]).get("stepping", {}) for k in cases]
    tolerances = {held.get("rtol") for held in tables}
    rtol = tolerances.pop() if len(tolerances) == 1 else None
    if rtol is not None and spread <= rtol:
        differ = f"these values differ by {spread:.1g} of them"
        yield f"{differ}, and rtol = {rtol:g} allows errors as large"


def caption(plan: Plan) -> str:
    """Return what all cases share, defaults too: ``flow shear, rate 1; rtol 0.0001``."""
    from stokesfibers.study.sweep_derived import natural_units

    parts: dict[str, list[str]] = {}
    unit = natural_units([case.tables for case in plan.cases]).get("unit_of_time", "")
    rate = f"{unit.removeprefix('1/')} " if unit else ""
    swept = {path for axis in plan.axes for path in axis.paths}
    shared = dict(_shared([_physics(plan, case) for case in plan.cases]))
    for path, value in shared.items():
        if (
            path.startswith("record.")
            or path.rpartition(".")[2] in _NUMERICS
            or _SAID_BY_NONE.get(path) == value
        ):
            continue
        table, _, key = path.partition(".")
        if table in _BARE:
            table, _, key = key.partition(".")
        word = isinstance(value, str) and key in _FIXED
        told = plain(value).replace("_", " ") if word else plain(value)
        meant = _meaning(path, value, shared, rate)
        told = told if key in ("", "kind") else f"{key} {told}"
        parts.setdefault(table, []).append(told + (f" ({meant})" if meant else ""))
    said = [f"{table} {', '.join(values)}" for table, values in parts.items()]
    cycles = {case.tables.get("stepping", {}).get("cycles") for case in plan.cases}
    if len(cycles) == 1 and "until" not in parts and (count := cycles.pop()) is not None:
        said.append(f"{count} cycles")
    if (every := shared.get("record.observables_every")) is not None:
        said.append(f"recorded every {number(every)}")
    if _SLENDERNESS in swept:
        said.append(f"slenderness is {_MEANT[_SLENDERNESS]}")
    if plan.collect.after:
        said.append(f"values from t = {number(plan.collect.after)} on")
    return "; ".join(said)


def _physics(plan: Plan, case: SweepCase) -> dict[str, Any]:
    """Return the tables of a case that say what moves and how; numerics only by the tolerance."""
    from stokesfibers.core.errors import InputError
    from stokesfibers.study.sweep_plan import load_case

    try:
        held = load_case(case, Path(plan.folder), allow_python=False)
    except InputError:  # it has a Python file, which is not run to draw a figure
        return {name: held for name, held in case.tables.items() if name in _TABLES}
    tables = held.tables()
    model, kinds = tables["model"], tables["fiber"]
    fiber = kinds[0] if len(kinds) == 1 else kinds
    return {
        **{name: tables[name] for name in _TABLES if name in tables},
        "fiber": fiber,
        "record": {"observables_every": held.record.observables_interval},
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
