"""The dict form of a problem: the tables of a case file, both ways."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table, as_table, build, choose, refuse_unknown, to_table
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.flow_tables import Source, flow_from_table, flow_to_table
from stokesfibers.problem.interaction_tables import (
    CONSTRAINT_KEYS,
    interaction_parts,
    interaction_tables,
)
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.mobility import AbstractMobility, LocalDrag, NonLocal
from stokesfibers.slender.regularization import REGULARIZATIONS

TABLES = (
    "engine",
    "fiber",
    "fluid",
    "flow",
    "domain",
    "model",
    "constraint",
    "discretization",
    "stepping",
    "load",
)
"""Top-level keys that describe the problem; a case file has others beside them."""


def problem_from_tables(
    tables: Mapping[str, Any], *, folder: Path = Path(), allow_python: bool = False
) -> Problem:
    """Return the problem that the tables of a case describe.

    Parameters
    ----------
    tables
        The tables named in `TABLES`; others are left to the caller.
    folder
        Folder that relative paths start from.
    allow_python
        Whether a flow of kind ``"python"`` may run the user's file.

    Raises
    ------
    InputError
        For anything that cannot be used, with the path ``table.key``.
    """
    fluid = as_table(tables.get("fluid", {}), "fluid")
    refuse_unknown(fluid, ("mu_bar", "viscosity"), "fluid")
    fibers = _fibers(tables.get("fiber"))
    source = Source(folder, allow_python, float(fibers[0].length))
    flow = flow_from_table(as_table(tables.get("flow", {"kind": "none"}), "flow"), source, "flow")
    parts: dict[str, Any] = {
        "fiber": fibers,
        "flow": flow,
        "mobility": _mobility(as_table(tables.get("model", {}), "model")),
        **interaction_parts(tables),
    }
    engine = _engine(tables)
    try:
        engine = engine.resolved(flow.rate_scale())
    except InputError as error:
        raise error.at({"beta": "constraint", "dt": "stepping"}[error.where]) from None
    try:
        return Problem(**parts, engine=engine, **fluid)
    except InputError as error:
        raise (error.at("fluid") if error.where in ("mu_bar", "viscosity") else error) from None


def problem_to_tables(problem: Problem) -> Table:
    """Return the tables that rebuild `problem`, JSON-ready, with every choice spelled out.

    A flow that holds functions cannot be rebuilt; its table names them and their files. For a
    flow from a case file `flow_tables.resolved_flow` keeps what can be.
    """
    mobility = problem.mobility
    model: Table = {"mobility": mobility.kind}
    if isinstance(mobility, NonLocal):
        model["regularization"] = to_table(mobility.regularization)
    fluid = {"mu_bar": problem.mu_bar, "viscosity": problem.viscosity}
    several = interaction_tables(problem)
    return {
        "engine": problem.engine.kind,
        "fiber": [to_table(kind) for kind in problem.kinds],
        "fluid": {k: v for k, v in fluid.items() if v is not None},
        "flow": flow_to_table(problem.flow),
        "domain": several["domain"],
        "model": model | several["model"],
        "constraint": {"beta": problem.engine.beta} | several["constraint"],
        "load": several["load"],
        "discretization": {"intervals": problem.engine.intervals},
        "stepping": {"dt": problem.engine.dt},
    }


def _fibers(value: object) -> tuple[Fiber, ...]:
    if value is None:
        raise InputError("fiber", "a table, [fiber]", "nothing", "Say length, slenderness, ...")
    if isinstance(value, list):
        if not value:
            raise InputError("fiber", "at least one [[fiber]] table", "none")
        return tuple(
            build(Fiber, as_table(t, f"fiber[{k}]"), f"fiber[{k}]") for k, t in enumerate(value)
        )
    return (build(Fiber, as_table(value, "fiber"), "fiber"),)


def _mobility(table: Table) -> AbstractMobility:
    refuse_unknown(table, ("mobility", "regularization", "close_approach"), "model")
    kind = table.get("mobility", "nonlocal")
    if kind == LocalDrag.kind:
        if "regularization" in table:
            raise InputError(
                "model.regularization", "nothing with local_drag", "a table", "Leave it out."
            )
        return LocalDrag()
    if kind != NonLocal.kind:
        raise InputError("model.mobility", "nonlocal or local_drag", repr(kind))
    where = "model.regularization"
    chosen = as_table(table.get("regularization", {"kind": "paper"}), where)
    return NonLocal(choose(REGULARIZATIONS, chosen, where))


def _engine(tables: Mapping[str, Any]) -> PaperEngine:
    kind = tables.get("engine", "paper")
    if kind != PaperEngine.kind:
        raise InputError("engine", "'paper'", repr(kind))
    arguments: Table = {}
    places = {
        "intervals": ("discretization", ("intervals",)),
        "dt": ("stepping", ("dt", "until")),
        "beta": ("constraint", CONSTRAINT_KEYS),
    }
    for name, (where, known) in places.items():
        table = as_table(tables.get(where, {}), where)
        refuse_unknown(table, known, where)
        if name in table:
            arguments[name] = table[name]
    try:
        return PaperEngine(**arguments)
    except InputError as error:
        raise error.at(places[error.where][0]) from None
