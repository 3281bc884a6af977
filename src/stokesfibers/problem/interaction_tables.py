"""The tables of a case about many fibers: domain, images, close approach, tensions, load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stokesfibers.constraint.coupled import TENSION_SOLVERS, AbstractTensionSolver
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table, as_table, build, choose, to_table
from stokesfibers.domain import DOMAINS, AbstractDomain
from stokesfibers.problem.load_tables import load_from_table, load_to_table
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.user_tables import Source
from stokesfibers.summation import IMAGE_SUMS, AbstractImageSum, EngineImages, FastImages
from stokesfibers.summation.close_approach import (
    CLOSE_APPROACHES,
    AbstractCloseApproach,
    EngineCloseApproach,
)

_SUM_KEYS = ("sum", "reach", "about", "tolerance", "split", "cutoff")
SOLVER_KEYS = ("solver", "tolerance", "most")


def interaction_parts(tables: Mapping[str, Any], source: Source) -> dict[str, Any]:
    """Return the arguments of `Problem` that concern several fibers, and the load."""
    domain, image_sum = _domain(as_table(tables.get("domain", {}), "domain"))
    model = as_table(tables.get("model", {}), "model")
    return {
        "domain": domain,
        "image_sum": image_sum,
        "close_approach": _close_approach(model),
        "tension_solver": _solver(as_table(tables.get("constraint", {}), "constraint")),
        "load": load_from_table(
            as_table(tables.get("load", {"kind": "none"}), "load"), source, "load"
        ),
    }


def interaction_tables(problem: Problem) -> dict[str, Table]:
    """Return what `interaction_parts` reads, by the table it goes into."""
    image_sum = to_table(problem.image_sum)
    image_sum["sum"] = image_sum.pop("kind")
    solver = to_table(problem.tension_solver)
    solver["solver"] = solver.pop("kind")
    domain = to_table(problem.domain)
    return {
        "domain": domain | image_sum if _needs_sum(problem) else domain,
        "model": {"close_approach": to_table(problem.close_approach)},
        "constraint": solver,
        "load": load_to_table(problem.load),
    }


def _needs_sum(problem: Problem) -> bool:
    return isinstance(problem.image_sum, FastImages) or problem.domain.kind != "free"


def _domain(table: Table) -> tuple[AbstractDomain, AbstractImageSum]:
    image_table = {key: table.pop(key) for key in _SUM_KEYS if key in table}
    table.setdefault("kind", "free")
    domain = choose(DOMAINS, table, "domain")
    if domain.kind == "free" and image_table and image_table.get("sum") != FastImages.kind:
        key, value = next(iter(image_table.items()))
        raise InputError(f"domain.{key}", "nothing in free space, or sum = 'ewald'", repr(value))
    if not image_table:
        return domain, EngineImages()
    name = image_table.pop("sum", FastImages.kind if domain.kind == "sheared" else "images")
    if not isinstance(name, str) or name not in IMAGE_SUMS:
        raise InputError("domain.sum", f"one of {', '.join(IMAGE_SUMS)}", repr(name))
    return domain, build(IMAGE_SUMS[name], image_table, "domain")


def _close_approach(model: Table) -> AbstractCloseApproach:
    if "close_approach" not in model:
        return EngineCloseApproach()
    where = "model.close_approach"
    return choose(CLOSE_APPROACHES, as_table(model["close_approach"], where), where)


def _solver(constraint: Table) -> AbstractTensionSolver:
    table = {key: constraint[key] for key in SOLVER_KEYS if key in constraint}
    name = table.pop("solver", "fixed_point")
    if not isinstance(name, str) or name not in TENSION_SOLVERS:
        raise InputError("constraint.solver", f"one of {', '.join(TENSION_SOLVERS)}", repr(name))
    return build(TENSION_SOLVERS[name], table, "constraint")
