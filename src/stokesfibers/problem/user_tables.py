"""Tables of a case that name a user's Python file: what they may hold, and which file it is."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import Table, refuse_unknown


@dataclass(frozen=True)
class Source:
    """What comes from a user's file needs beside its table.

    Attributes
    ----------
    folder
        Folder that relative paths start from.
    allow_python
        Whether the file may run.
    length_scale
        Length over which the velocity of a flow is taken to vary.
    """

    folder: Path
    allow_python: bool
    length_scale: float


@dataclass(frozen=True)
class UserTable:
    """A table that names a file and functions in it.

    Attributes
    ----------
    table
        As in the case.
    where
        Its path there.
    what
        What it makes: a flow, a load.
    """

    table: Table
    where: str
    what: str

    def file(self, source: Source, functions: tuple[str, ...]) -> Path:
        """Return the file that may run, unchanged; `functions` are the keys that name some in it.

        Raises
        ------
        InputError
            If the table holds other keys or no file, Python is not allowed, or the file is not
            the one whose sha256 the table has.
        """
        keys = ("kind", "file", *functions, "sha256")
        refuse_unknown(self.table, keys, self.where)
        if "file" not in self.table:
            raise InputError(f"{self.where}.file", "the name of a Python file", "nothing")
        for key in keys[1:]:
            if not isinstance(self.table.get(key, ""), str):
                raise InputError(f"{self.where}.{key}", "a text", self.table[key])
        if not source.allow_python:
            raise InputError(
                f"{self.where}.kind",
                f"a {self.what} that runs no code",
                "'python'",
                "Add --allow-python if you trust the file.",
            )
        file = source.folder / self.table["file"]
        if "sha256" in self.table:
            _check_unchanged(file, self.table["sha256"], f"{self.where}.file")
        return file

    def typed_in_python(self, functions: str) -> InputError:
        """Return the error for a table whose `functions` were given in Python, not by a file."""
        return InputError(
            self.where,
            f"a {self.what} that a case file can say",
            f"{functions} typed in Python",
            "Resume it from Python: stokesfibers.resume(path, problem=problem).",
        )


def _check_unchanged(file: Path, digest: str, where: str) -> None:
    """Refuse a file whose sha256 is not `digest`."""
    try:
        found = sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(
            where, "a Python file that can be read", f"'{file}': {error.strerror}"
        ) from None
    if found != digest:
        raise InputError(
            where,
            f"'{file}' as it was, sha256 {digest[:12]}...",
            f"a changed file, sha256 {found[:12]}...",
            "Restore the file, or start a new run.",
        )
