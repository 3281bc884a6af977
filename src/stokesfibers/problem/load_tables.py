"""The table [load] of a case, both ways. Most loads are records; a user's file is not."""

from __future__ import annotations

from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table, choose, refuse_unknown, to_table
from stokesfibers.flow.base import qualified_name
from stokesfibers.load import LOADS, AbstractLoad, NoLoad, UserLoad, load_user_load
from stokesfibers.problem.flow_tables import Source, check_unchanged

_KEYS = ("kind", "file", "density", "sha256")


def load_from_table(table: Table, source: Source, where: str) -> AbstractLoad:
    """Return the load that a table describes; InputErrors name the path `where`.key."""
    if table.get("kind") != UserLoad.kind:
        return choose({**LOADS, UserLoad.kind: NoLoad}, table, where)
    if "density_function" in table:
        raise InputError(
            where,
            "a load that a case file can say",
            "a function typed in Python",
            "Resume it from Python: stokesfibers.resume(path, problem=problem).",
        )
    refuse_unknown(table, _KEYS, where)
    if "file" not in table:
        raise InputError(f"{where}.file", "the name of a Python file", "nothing")
    for key in _KEYS[1:]:
        if not isinstance(table.get(key, ""), str):
            raise InputError(f"{where}.{key}", "a text", table[key])
    if not source.allow_python:
        raise InputError(
            f"{where}.kind",
            "a load that runs no code",
            "'python'",
            "Add --allow-python if you trust the file.",
        )
    file = source.folder / table["file"]
    if "sha256" in table:
        check_unchanged(file, table["sha256"], f"{where}.file")
    return load_user_load(file, table.get("density", "density"))


def load_to_table(load: AbstractLoad) -> Table:
    """Return the table that rebuilds a load; one typed in Python only names its function.

    A Python file has an absolute path and the sha256 of the bytes that ran, so that a resumed run
    finds it and knows it unchanged.
    """
    if not isinstance(load, UserLoad):
        return to_table(load)
    if load.function_name is None:
        name = qualified_name(load.density_function)
        files = [{"path": s.path, "sha256": s.sha256} for s in load.sources]
        return {"kind": load.kind, "density_function": name, "sources": files}
    (file,) = load.sources
    table = {"kind": load.kind, "file": file.path, "density": load.function_name}
    return {**table, "sha256": file.sha256}
