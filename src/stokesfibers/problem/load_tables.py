"""The table [load] of a case, both ways. Most loads are records; a user's file is not."""

from __future__ import annotations

from stokesfibers.core.tables import Table, choose, to_table
from stokesfibers.flow.base import qualified_name
from stokesfibers.load import LOADS, AbstractLoad, NoLoad, UserLoad, load_user_load
from stokesfibers.problem.user_tables import Source, UserTable


def load_from_table(table: Table, source: Source, where: str) -> AbstractLoad:
    """Return the load that a table describes; InputErrors name the path `where`.key."""
    if table.get("kind") != UserLoad.kind:
        return choose({**LOADS, UserLoad.kind: NoLoad}, table, where)
    held = UserTable(table, where, "load")
    if "density_function" in table:
        raise held.typed_in_python("a function")
    file = held.file(source, ("density",))
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
