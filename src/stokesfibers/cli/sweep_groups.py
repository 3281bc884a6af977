"""Dimensionless groups of a sweep's cases, the smallest and the largest of each."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from stokesfibers.cli.words import heading, lines, span

if TYPE_CHECKING:
    from stokesfibers.study.sweep_plan import Plan

_MEANINGS = {
    "B": "weight per length times L^3 / E, elasto-gravitational number",
    "mu_bar": "8 pi mu rate L^4 / E, effective viscosity; rate is the largest",
    "eta": "mu_bar / |c|, c = log(eps^2 e)",
    "strain": "amplitude / (pi frequency), of half a cycle",
    "bend": "height of the arc at the start / L; what it grows to depends on the time it has",
    "buckling": "times the threshold (local drag) of a fiber along the compression",
}


def say_groups(plan: Plan, *, allow_python: bool) -> None:
    """Print the groups that say how far fibers bend, if there is a flow or a weight."""
    found: dict[str, list[float]] = {}
    for name, value in _groups(plan, allow_python=allow_python):
        found.setdefault(name, []).append(value)
    if found:
        heading("Dimensionless groups, of all cases")
        lines((name, span(found[name]), _MEANINGS[name]) for name in _MEANINGS if name in found)


def _groups(plan: Plan, *, allow_python: bool) -> Iterator[tuple[str, float]]:
    from stokesfibers.fiber.initial import NearlyStraight
    from stokesfibers.flow.base import to_dict
    from stokesfibers.flow.period import strain_of_half_a_cycle
    from stokesfibers.problem.groups import groups, weight
    from stokesfibers.study.sweep_plan import load_case

    for case in plan.cases:
        held = load_case(case, Path(plan.folder), allow_python=allow_python)
        if isinstance(held.initial, NearlyStraight) and held.initial.amplitude:
            yield "bend", held.initial.bend
        for fiber in held.problem.kinds:
            pull = weight(held.problem, fiber)
            if pull is not None:
                yield "B", pull
            if held.problem.flow.rate_scale() > 0.0:
                one = groups(held.problem, fiber, held.until)
                yield "mu_bar", one.mu_bar
                yield "eta", one.eta
                strain = strain_of_half_a_cycle(to_dict(held.problem.flow))
                if strain is not None:
                    yield "strain", strain
                yield "buckling", one.compression
