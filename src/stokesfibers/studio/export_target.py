"""Where an export goes: written beside its place, and put there whole or not at all."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stokesfibers.core.errors import InputError

MANIFEST = "export.json"
"""File in a folder that an export made: what it is, of which run, and its files."""
_FORMAT = "stokesfibers-export"


@dataclass(frozen=True)
class Target:
    """A file or folder to be made.

    Attributes
    ----------
    option
        How the user named it, for messages.
    place
        Where it is to be.
    folder
        Whether it is a folder.
    """

    option: str
    place: Path
    folder: bool

    @property
    def partial(self) -> Path:
        """Where it is written until it is whole."""
        return self.place.with_name(f".{self.place.name}.{os.getpid()}.partial")

    def check(self, run: Path, *, overwrite: bool) -> None:
        """Refuse a place where nothing can, or should, be made.

        Raises
        ------
        InputError
            If the folder above is missing, the place is in the run itself, or something is there
            and `overwrite` is not set, or is no export of ours.
        """
        place, run = self.place.resolve(), run.resolve()
        if place == run or run in place.parents:
            raise InputError(self.option, "a place outside the run", str(self.place))
        if place in run.parents:
            raise InputError(self.option, "a place that does not hold the run", str(self.place))
        if not place.parent.is_dir():
            hint = f"Make {self.place.parent} first."
            raise InputError(self.option, "a place in a folder that exists", str(self.place), hint)
        if not os.path.lexists(self.place) or (self.folder and _is_empty_folder(self.place)):
            return
        if not overwrite:
            got = f"{self.place}, which exists"
            raise InputError(self.option, "a new place", got, "Add --overwrite to replace it.")
        if self.folder:
            _check_ours(self.option, self.place)
        elif not self.place.is_file():
            raise InputError(self.option, "a file to replace", f"{self.place}, no file")

    def clear(self) -> None:
        """Remove what is written so far."""
        with suppress(FileNotFoundError):
            if self.folder:
                shutil.rmtree(self.partial)
            else:
                self.partial.unlink()

    def publish(self) -> None:
        """Put what was written in its place; the old one goes when the new one is there."""
        if not self.folder:
            os.replace(self.partial, self.place)
            return
        old = self.place.with_name(f".{self.place.name}.{os.getpid()}.old")
        if self.place.is_dir():
            os.replace(self.place, old)
        try:
            os.replace(self.partial, self.place)
        except BaseException:
            if old.is_dir():
                os.replace(old, self.place)
            raise
        shutil.rmtree(old, ignore_errors=True)


def write_manifest(folder: Path, kind: str, facts: Mapping[str, Any]) -> None:
    """Write what the files of the export in `folder` are; the last file of it to be written."""
    files = sorted(p.name for p in folder.iterdir())
    manifest = {"format": _FORMAT, "kind": kind, **facts, "files": [*files, MANIFEST]}
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1), encoding="utf-8")


@contextmanager
def written(targets: Sequence[Target]) -> Iterator[None]:
    """Publish all targets when the block ends; remove all of them if it fails."""
    for target in targets:
        target.clear()
        if target.folder:
            target.partial.mkdir()
    try:
        yield
        for target in targets:
            target.publish()
    finally:
        for target in targets:
            target.clear()


def _is_empty_folder(place: Path) -> bool:
    return place.is_dir() and not any(place.iterdir())


def _check_ours(option: str, place: Path) -> None:
    """Refuse to replace a folder that holds anything but an earlier export."""
    expected = "a folder that an export made"
    hint = "Take another name, or remove it yourself."
    try:
        manifest = json.loads((place / MANIFEST).read_text(encoding="utf-8"))
        ours = manifest["format"] == _FORMAT
        files = set(manifest["files"])
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(option, expected, f"{place}, another one", hint) from None
    others = sorted({p.name for p in place.iterdir()} - files) if ours else [MANIFEST]
    if others:
        raise InputError(option, expected, f"{place}, which holds {others[0]} too", hint)
