"""What a report says of a run: its status, its case, its health and where it came from."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from stokesfibers.core.errors import InputError
from stokesfibers.core.status import Status
from stokesfibers.plot import select
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.groups import groups
from stokesfibers.problem.interaction_tables import SOLVER_KEYS
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.tables import problem_from_tables
from stokesfibers.studio.report_html import table, text, unit

if TYPE_CHECKING:
    import xarray as xr

Table = Mapping[str, Any]

_LARGEST = (
    "length_error",
    "force_error",
    "torque_error",
    "energy_error",
    "elastic_energy",
    "largest_curvature",
    "largest_tension",
    "first_normal_stress_difference",
    "shear_stress",
)
_SMALLEST = ("smallest_distance", "smallest_gap")
_STEPS = ("step_size", "order", "nodes", "iterations", "spatial_error")


def held(data: xr.DataTree, name: str) -> Any:
    """Return what the run's attribute `name` holds, JSON or not; None where there is none."""
    value = data.attrs.get(name)
    if not isinstance(value, str):
        return value
    try:
        return json.loads(value)
    except json.JSONDecodeError:
        return value


def status_of(data: xr.DataTree) -> Status | None:
    """Return the run's status, or None where it cannot be told."""
    value = held(data, "status")
    try:
        return Status.from_dict(value) if isinstance(value, dict) else None
    except TypeError:
        return None


def watched(data: xr.DataTree) -> bool:
    """Return whether the run weighed its own balances; those of older versions did not."""
    return select.has(data, "observables", "energy_error")


def problem_of(case: Table, *, allow_python: bool) -> Problem | str:
    """Return the problem of a run, or in words why it cannot be had."""
    try:
        return problem_from_tables(case, allow_python=allow_python)
    except (InputError, KeyError) as error:
        return str(error)


def number(value: float) -> str:
    """Return a number with six digits and without needless ones."""
    return f"{value:.6g}".replace("-", "−")


def duration(seconds: float) -> str:
    """Return a duration for people."""
    if seconds < 60.0:
        return f"{seconds:.3g} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def shown(value: object) -> str:
    """Return a value of a case as HTML."""
    if isinstance(value, Mapping):
        parts = [f"{text(k)} = {shown(v)}" for k, v in value.items() if k != "kind"]
        kind = [text(value["kind"])] if "kind" in value else []
        return ", ".join(kind + parts)
    if isinstance(value, list | tuple):
        return f"({', '.join(shown(v) for v in value)})"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return text(str(value).lower() if isinstance(value, bool) else value)
    return number(value)


def case_tables(case: Table) -> str:
    """Return the resolved case as tables, one for each of its own, without what has no effect."""
    parts: list[str] = []
    case = _used(case)
    plain = {k: v for k, v in case.items() if not isinstance(v, Mapping | list)}
    if plain:
        parts.append(table((), [(text(k), shown(v)) for k, v in plain.items()], "case"))
    for name, inside in case.items():
        every = inside if isinstance(inside, list) else [inside]
        for place, one in enumerate(every, 1):
            if isinstance(one, Mapping) and one:
                which = f" {place}" if len(every) > 1 else ""
                rows = [(text(k), shown(v)) for k, v in one.items()]
                parts.append(table((), rows, f"{name}{which}"))
    return f'<div class="case">{"".join(parts)}</div>' if parts else ""


def _used(case: Table) -> Table:
    """Return the tables of a case without keys that this case makes no use of."""
    alone = _is_alone(case)

    def used(name: str, key: str) -> bool:
        if name == "constraint":  # the high-order engine finds tensions with the positions
            coupled = key in SOLVER_KEYS
            return case.get("engine") != SpectralEngine.kind and not (coupled and alone)
        return not (alone and (name, key) == ("model", "close_approach"))

    return {
        name: {k: v for k, v in inside.items() if used(name, k)}
        if isinstance(inside, Mapping)
        else inside
        for name, inside in case.items()
    }


def _is_alone(case: Table) -> bool:
    """Return whether there is one fiber, in free space."""
    fibers, domain = case.get("fiber"), case.get("domain")
    kinds = fibers if isinstance(fibers, list) else []
    one = len(kinds) == 1 and isinstance(kinds[0], Mapping) and kinds[0].get("count", 1) == 1
    return one and isinstance(domain, Mapping) and domain.get("kind") == "free"


def group_rows(problem: Problem, until: float) -> Iterator[tuple[str, ...]]:
    """Yield the dimensionless groups of each kind of fiber: name, value, meaning."""
    for place, fiber in enumerate(problem.kinds, 1):
        found = groups(problem, fiber, until)
        many = f" (kind {place})" if len(problem.kinds) > 1 else ""
        yield f"eps{many}", number(found.eps), "radius at mid-length / length"
        yield f"mu_bar{many}", number(found.mu_bar), "8 pi mu rate L<sup>4</sup> / E"
        yield f"eta{many}", number(found.eta), "mu_bar / |log(eps<sup>2</sup> e)|"
        less = "a straight fiber stays so" if found.compression <= 1.0 else "straight fibers buckle"
        what = f"compression over the threshold of buckling (local drag): {less}"
        yield f"buckling{many}", number(found.compression), what


def extreme_rows(data: xr.DataTree) -> Iterator[tuple[str, ...]]:
    """Yield the largest and smallest of what was recorded: meaning, value, unit, time."""
    for name in (*_LARGEST, *_SMALLEST):
        if not select.has(data, "observables", name):
            continue
        time = select.numbers(data, "observables", "time")
        held = select.read(data, "observables", name)
        summed = name == "elastic_energy" and held.sizes["fiber"] > 1
        if summed:
            held = select.total_over_rest(held, "time")  # as its figure shows it
        values = select.values(held).reshape(len(time), -1)
        if not np.isfinite(values).any():
            continue
        least = name in _SMALLEST
        flat = np.where(np.isfinite(values), values, np.inf if least else -np.inf)
        at = int(np.argmin(flat) if least else np.argmax(flat)) // values.shape[1]
        value = float(flat.min() if least else flat.max())
        variable = select.describe(data, "observables", name)
        which = "" if {"largest", "smallest"} & {*variable.meaning.split()} else "largest "
        meaning = text(which + variable.meaning + (", all fibers" if summed else ""))
        yield meaning, number(value), unit(variable.unit), f"t = {number(float(time[at]))}"


def step_rows(data: xr.DataTree) -> Iterator[tuple[str, ...]]:
    """Yield what the steps were like: meaning, smallest to largest, unit; wall time by stage."""
    if not select.has(data, "numerics", "step_size"):
        return
    count = len(select.numbers(data, "numerics", "step_size"))
    yield "steps", str(count), ""
    if select.has(data, "numerics", "rejected"):
        yield "rejected tries", number(select.numbers(data, "numerics", "rejected").sum()), ""
    for name in _STEPS:
        if select.has(data, "numerics", name):
            values = select.numbers(data, "numerics", name)
            known = values[np.isfinite(values)]
            if not known.size:
                continue  # the engine has no such number
            low, high = float(known.min()), float(known.max())
            span = number(low) if low == high else f"{number(low)} to {number(high)}"
            variable = select.describe(data, "numerics", name)
            yield text(variable.meaning), span, unit(variable.unit)
    for stage, seconds in stages(data):
        yield f"wall time of the steps, {text(stage)}", duration(seconds), ""


def stages(data: xr.DataTree) -> list[tuple[str, float]]:
    """Return the wall time of each stage in s, and of all together."""
    if not select.has(data, "numerics", "wall_time"):
        return []
    array = select.read(data, "numerics", "wall_time").transpose("step", ...)
    seconds = select.values(array).reshape(array.sizes["step"], -1).sum(axis=0)
    names = [str(name) for name in array["stage"].to_numpy()] if "stage" in array.coords else []
    named = zip(names, map(float, seconds), strict=False) if len(seconds) > 1 else ()
    return [*named, ("all stages", float(seconds.sum()))]


def origin_rows(data: xr.DataTree) -> Iterator[tuple[str, ...]]:
    """Yield where the run came from, of its start and of each time it was continued."""
    first = held(data, "provenance")
    again = held(data, "resumed")
    every = [first, *(again if isinstance(again, list) else [])]
    for place, one in enumerate(every):
        if not isinstance(one, dict):
            continue
        begun = "run" if place == 0 else "continued"
        versions = one.get("versions", {})
        yield begun, text(one.get("time", ""))
        yield "command", f"<code>{text(one.get('command', ''))}</code>"
        if versions:
            yield "versions", text(", ".join(f"{k} {v}" for k, v in versions.items()))
        if "platform" in one:
            yield "machine", f"{text(one['platform'])}, {text(one.get('cpu_count', '?'))} cores"
