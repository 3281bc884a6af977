"""``stokesfibers check``: everything that can be said about a case without running it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from stokesfibers.cli.bars import patience
from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import case_argument, python_option, set_option
from stokesfibers.cli.words import duration, heading, lines, number, pairs, plural, size

if TYPE_CHECKING:
    from stokesfibers.config.case import Case
    from stokesfibers.fiber.parameters import Fiber
    from stokesfibers.problem.doubt import Doubt
    from stokesfibers.run.estimate import Cost

_WEEK = 7.0 * 24.0 * 3600.0
Row = tuple[str, ...]


@click.command(short_help="Validate a case, print its dimensionless groups, doubts and cost.")
@case_argument
@set_option
@python_option
@guarded
def check(*, case: Path, settings: tuple[str, ...], allow_python: bool) -> None:
    """Validate the case file CASE, print what it comes to, and run nothing.

    Shown are the dimensionless groups, doubtful choices, and what the run would cost, from a few
    steps taken in memory.
    """
    from stokesfibers.config.case import load_case
    from stokesfibers.problem.checks import doubts

    loaded = load_case(case, settings, allow_python=allow_python)
    click.secho("Case", bold=True)
    lines(_case_rows(loaded))
    if loaded.problem.viscosity is not None:
        heading("Physical input, in the case's own units")
        lines(_physical_rows(loaded))
    heading("Dimensionless groups")
    lines(_group_rows(loaded))
    with patience("placing the fibers, which takes long where there is little room"):
        found = doubts(loaded.problem, loaded.plan())
    heading("Doubtful choices")
    _say_doubts(found)
    click.secho(f"\n{case} is valid.", fg="green", bold=True)
    heading("Cost")
    with patience("taking some steps"):
        rows = list(_cost_rows(loaded))
    lines(rows)


def _case_rows(case: Case) -> Iterator[Row]:
    from stokesfibers.fiber.initial import NearlyStraight

    tables = case.tables()
    for fiber in tables["fiber"]:
        count = int(fiber.get("count", 1))
        yield "fiber" if count == 1 else f"{count} fibers", pairs(fiber)
    yield "fluid", pairs(tables["fluid"])
    yield "flow", pairs(tables["flow"])
    yield "domain", pairs(tables["domain"])
    if tables["load"]["kind"] != "none":
        yield "load", pairs(tables["load"])
    model = tables["model"]
    yield "model", f"{model['mobility']}; regularization {pairs(model.get('regularization', {}))}"
    yield "initial", pairs(tables["initial"])
    if amplitude := tables["initial"].get("amplitude"):
        shape = case.initial
        bend = shape.bend if isinstance(shape, NearlyStraight) else abs(amplitude) / 256.0
        yield "", f"bent by {bend:.2g} of the length"
    steps = {k: v for k, v in tables["stepping"].items() if k != "until"}
    tension = tables["constraint"] if case.problem.engine.kind == "paper" else {}
    engine = {**tables["discretization"], **steps, **tension}
    yield "engine", f"{tables['engine']}, {pairs(engine)}"
    yield "until", number(case.until)


def _physical_rows(case: Case) -> Iterator[Row]:
    problem = case.problem
    assert problem.viscosity is not None
    for fiber in problem.kinds:
        yield "L", number(fiber.length), "length of the fiber"
        yield "a", number(fiber.eps * fiber.length), "radius at mid-length"
        yield "E", number(fiber.rigidity), "bending rigidity"
    yield "mu", number(problem.viscosity), "viscosity of the fluid"
    yield "rate", number(problem.flow.rate_scale()), "rate of the flow, its largest"


def _group_rows(case: Case) -> Iterator[Row]:
    from stokesfibers.problem.groups import crowding

    kinds = case.problem.kinds
    for k, fiber in enumerate(kinds):
        if len(kinds) > 1:
            yield f"fiber[{k}]", "", f"{fiber.count} x length {number(fiber.length)}"
        yield from _fiber_rows(case, fiber)
    if len(kinds) > 1 and crowding(case.problem) is not None:
        yield "all", "", plural(len(case.problem.fibers), "fiber")
    crowd = crowding(case.problem)
    if crowd is not None:
        yield "n L^3", number(crowd.concentration), "number of fibers per volume, times L^3"
        yield "n L^2 d", number(crowd.contacts), "d = diameter at mid-length; rods touch from 1 on"
        yield "phi", number(crowd.volume_fraction), "volume fraction"


def _fiber_rows(case: Case, fiber: Fiber) -> Iterator[Row]:
    from stokesfibers.flow.base import to_dict as flow_to_dict
    from stokesfibers.flow.period import period_of, strain_of_half_a_cycle
    from stokesfibers.problem.groups import groups, weight

    found, pull = groups(case.problem, fiber, case.until), weight(case.problem, fiber)
    yield "eps", number(found.eps), "radius at mid-length / length"
    yield "c", number(found.c), "log(eps^2 e), of the local operator"
    if pull is not None:
        yield "B", number(pull), "weight per length times L^3 / E, elasto-gravitational number"
        if len(case.problem.fibers) == 1 and case.problem.flow.rate_scale() == 0.0:
            yield "", "", "one fiber straightens and falls straight, whatever B: see the docs"
    if case.problem.flow.rate_scale() == 0.0:
        return
    rate = "8 pi mu rate L^4 / E, effective viscosity"
    flow = flow_to_dict(case.problem.flow)
    if period_of(flow) is not None:
        rate += "; rate is the amplitude"
    yield "mu_bar", number(found.mu_bar), rate
    yield "eta", number(found.eta), "mu_bar / |c|"
    if (strain := strain_of_half_a_cycle(flow)) is not None:
        yield "strain", number(strain), "amplitude / (pi frequency), of half a cycle"
    share = f"{found.compression:.3g}"
    if found.compression > 1.0:
        yield "buckling", share, "times its threshold for a fiber along the compression"
        yield "", f"{found.wavelength:.2g} L", "wavelength that grows fastest (local drag)"
    else:
        yield "buckling", share, "of its threshold (local drag): a straight fiber stays so"


def _say_doubts(found: tuple[Doubt, ...]) -> None:
    if not found:
        click.echo("  none")
    for doubt in found:
        click.secho(f"  {doubt.where}: ", fg="yellow", nl=False)
        click.echo(doubt.what)
        click.echo(f"    {doubt.compared}. {doubt.remedy}")


def _too_much(case: Case, cost: Cost) -> Iterator[Row]:
    """Yield what a user should hear before a run that never ends, or fills the disk."""
    free = shutil.disk_usage(Path.cwd()).free
    if cost.settled and cost.seconds > _WEEK:
        remedy = "take a larger stepping.rtol or dt, or a smaller until"
        if case.problem.load.kind == "steric":
            remedy = "lower load.strength or raise load.range; what is stiff takes short steps"
        yield "doubt", f"more than a week of computing: {remedy}"
    if cost.store_bytes > free:
        yield "doubt", f"the store is larger than the {size(free)} that are free here"
        yield "", "record less often, or choose another disk by --out"


def _cost_rows(case: Case) -> Iterator[Row]:
    import numpy as np

    from stokesfibers.constraint.coupled import TensionError
    from stokesfibers.core.errors import MissingExtraError
    from stokesfibers.problem.checks import large_memory, memory_bytes
    from stokesfibers.run.estimate import estimate
    from stokesfibers.stepping.base import StepError

    if not any(True for _ in large_memory(case.problem)):
        try:
            cost = estimate(case.problem, case.curves(), until=case.until, record=case.record)
        except (np.linalg.LinAlgError, StepError, TensionError):
            yield "time", "unknown: the first step has no solution"
        except MissingExtraError as error:
            yield "time", f"unknown, and it cannot run here yet: {error}"
        else:
            each = duration(cost.step_seconds)
            if cost.settled:
                most = "at most" if case.problem.load.kind == "steric" else "about"
                yield "time", f"{most} {duration(cost.seconds)} on one core, after the start"
                yield "", f"{plural(cost.steps, 'step')} of {each}, measured here, and the records"
            else:
                yield "time", f"steps of {each}, measured here"
                yield "", "how many cannot be told: they still grow from the start's short ones"
            yield "store", f"about {size(cost.store_bytes)}"
            yield "", f"{cost.positions} records of positions, {cost.observables} of observables"
            yield from _too_much(case, cost)
    yield "memory", f"about {size(memory_bytes(case.problem))} beside Python's own 240 MB"
