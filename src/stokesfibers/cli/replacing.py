"""One rule for what is there already: what is derived from runs is replaced, and said to be.

Figures, reports, movies, tables and the datasets of sweeps can be made again at any time. Runs,
exports and recordings are never replaced without ``--overwrite``, case files never.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from stokesfibers.core.errors import InputError


@contextmanager
def replacing(*places: Path, quiet: bool = False) -> Iterator[None]:
    """Say, when the block has written `places`, which of them were there before.

    It goes to standard error: what a program reads from standard output stays the same.
    """
    before = [place for place in places if place.exists()]
    yield
    if not quiet:
        say_replaced(before)


def say_replaced(places: Iterable[Path]) -> None:
    """Say that files were replaced; nothing if there are none."""
    names = ", ".join(map(str, places))
    if names:
        click.echo(f"replaced: {names}", err=True)


def files_in(folder: Path) -> set[Path]:
    """Return the files of a folder, those of its folders left out; none if it is not there."""
    return {place for place in folder.iterdir() if place.is_file()} if folder.is_dir() else set()


def results_folder(out: Path) -> Path:
    """Return the folder of ``--out`` for results; its parent must exist, as for runs."""
    if not out.resolve().parent.is_dir():
        hint = f"Make the folder {out.parent} first."
        raise InputError("--out", "a place in an existing folder", str(out), hint)
    if out.exists() and not out.is_dir():
        raise InputError("--out", "a folder", f"'{out}', a file")
    return out
