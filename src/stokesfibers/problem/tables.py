"""The dict form of a problem: the tables of a case file, both ways."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import (
    Table,
    as_table,
    build,
    choose,
    did_you_mean,
    refuse_unknown,
    to_table,
)
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.problem.engine import ENGINES, PaperEngine, SpectralEngine
from stokesfibers.problem.engine_keys import refuse_keys_of_another
from stokesfibers.problem.flow_tables import flow_from_table, flow_to_table
from stokesfibers.problem.interaction_tables import (
    SOLVER_KEYS,
    interaction_parts,
    interaction_tables,
)
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.user_tables import Source
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
_OTHER_KEYS = {"discretization": (), "stepping": ("until", "cycles"), "constraint": SOLVER_KEYS}


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
        Whether a flow or a load of kind ``"python"`` may run the user's file.

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
        **interaction_parts(tables, source),
    }
    try:
        return Problem(**parts, engine=_engine(tables), **fluid)
    except InputError as error:
        places = {"mu_bar": "fluid", "viscosity": "fluid", **_engine_type(tables).places}
        raise (error.at(places[error.where]) if error.where in places else error) from None


def problem_to_tables(problem: Problem) -> Table:
    """Return the tables that rebuild `problem`, JSON-ready, with every choice spelled out.

    A flow that holds functions cannot be rebuilt; its table names them and their files. For a
    flow from a case file `flow_tables.resolved_flow` keeps what can be.
    """
    mobility = problem.mobility
    model: Table = {"mobility": mobility.kind}
    if isinstance(mobility, NonLocal) and mobility.regularization is not None:
        model["regularization"] = to_table(mobility.regularization)
    fluid = {"mu_bar": problem.mu_bar, "viscosity": problem.viscosity}
    several = interaction_tables(problem)
    engine: dict[str, Table] = {"discretization": {}, "stepping": {}, "constraint": {}}
    for name, place in problem.engine.places.items():
        value = getattr(problem.engine, name)
        if value is not None:
            engine[place][name] = value
    return {
        "engine": problem.engine.kind,
        "fiber": [to_table(kind) for kind in problem.kinds],
        "fluid": {k: v for k, v in fluid.items() if v is not None},
        "flow": flow_to_table(problem.flow),
        "domain": several["domain"],
        "model": model | several["model"],
        "constraint": engine["constraint"] | several["constraint"],
        "load": several["load"],
        "discretization": engine["discretization"],
        "stepping": engine["stepping"],
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
    if "regularization" not in table:
        return NonLocal()
    where = "model.regularization"
    chosen = as_table(table["regularization"], where)
    return NonLocal(choose(REGULARIZATIONS, chosen, where))


def _engine_type(tables: Mapping[str, Any]) -> type[PaperEngine] | type[SpectralEngine]:
    kind = tables.get("engine", SpectralEngine.kind)
    if not isinstance(kind, str) or kind not in ENGINES:
        hint = did_you_mean(str(kind), ENGINES)
        raise InputError("engine", f"one of {', '.join(ENGINES)}", repr(kind), hint)
    return ENGINES[kind]


def _engine(tables: Mapping[str, Any]) -> PaperEngine | SpectralEngine:
    chosen = _engine_type(tables)
    arguments: Table = {}
    refuse_keys_of_another(tables, chosen)
    for place, others in _OTHER_KEYS.items():
        table = as_table(tables.get(place, {}), place)
        own = [name for name, where in chosen.places.items() if where == place]
        refuse_unknown(table, (*own, *others), place)
        arguments.update({name: table[name] for name in own if name in table})
    try:
        return chosen(**arguments)
    except InputError as error:
        raise error.at(chosen.places[error.where]) from None
