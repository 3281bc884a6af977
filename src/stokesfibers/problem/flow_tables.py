"""The table [flow] of a case, both ways.

Most flows are records whose fields are the keys. Not so: sums, flows from a user's Python file,
and the uniform flow, whose key ``velocity`` is the record's field ``stream_velocity``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table, as_table, choose, refuse_unknown
from stokesfibers.flow import (
    FLOWS,
    AbstractFlow,
    NoFlow,
    SumOfFlows,
    TimeDependentShear,
    Uniform,
    UserFlow,
    load_user_flow,
    to_dict,
)
from stokesfibers.problem.user_tables import Source, UserTable


def flow_from_table(table: Table, source: Source, where: str) -> AbstractFlow:
    """Return the flow that a table describes; InputErrors name the path `where`.key."""
    kind = table.get("kind")
    if kind == SumOfFlows.kind:
        refuse_unknown(table, ("kind", "flows"), where)
        parts = table.get("flows")
        if not isinstance(parts, list) or not parts:
            raise InputError(f"{where}.flows", "a list of flow tables", parts)
        paths = [f"{where}.flows[{k}]" for k in range(len(parts))]
        flows = (
            flow_from_table(as_table(t, p), source, p) for t, p in zip(parts, paths, strict=True)
        )
        return SumOfFlows(tuple(flows))
    if kind == TimeDependentShear.kind or "velocity_function" in table:
        raise UserTable(table, where, "flow").typed_in_python("functions")
    if kind == UserFlow.kind:
        return _python_flow(table, source, where)
    if kind == Uniform.kind:
        return _uniform_flow(table, where)
    return choose({**FLOWS, "sum": SumOfFlows, "python": NoFlow}, table, where)


def flow_to_table(flow: AbstractFlow) -> Table:
    """Return the table that rebuilds a flow; one that holds functions only names them."""
    if isinstance(flow, SumOfFlows):
        return {"kind": flow.kind, "flows": [flow_to_table(part) for part in flow.flows]}
    if isinstance(flow, Uniform):
        return {"kind": flow.kind, "velocity": list(flow.stream_velocity)}
    return to_dict(flow)


def resolved_flow(flow: AbstractFlow, table: Mapping[str, Any], folder: Path) -> Table:
    """Return the table that a store keeps for `flow`, which was made from `table`.

    Defaults are spelled out. A Python file has an absolute path and the sha256 of the bytes that
    ran, so that a resumed run finds it and knows it unchanged.
    """
    if isinstance(flow, SumOfFlows):
        pairs = zip(flow.flows, table["flows"], strict=True)
        return {"kind": flow.kind, "flows": [resolved_flow(f, t, folder) for f, t in pairs]}
    if isinstance(flow, UserFlow):
        file = str((folder / table["file"]).resolve())
        return {**table, "file": file, "sha256": flow.sources[0].sha256}
    return flow_to_table(flow)


def _uniform_flow(table: Table, where: str) -> Uniform:
    refuse_unknown(table, ("kind", "velocity"), where)
    if "velocity" not in table:
        raise InputError(f"{where}.velocity", "a value", "nothing")
    return Uniform(checks.vector3(f"{where}.velocity", table["velocity"]))


def _python_flow(table: Table, source: Source, where: str) -> UserFlow:
    functions = ("velocity", "gradient")
    file = UserTable(table, where, "flow").file(source, functions)
    names = {key: table[key] for key in functions if key in table}
    flow = load_user_flow(file, **names, length_scale=source.length_scale)
    if "gradient" in table and flow.gradient_function is None:
        raise InputError(f"{where}.gradient", f"a function in {file}", repr(table["gradient"]))
    return flow
