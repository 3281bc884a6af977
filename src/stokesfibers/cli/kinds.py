"""What a path holds, so that a command given the wrong thing can name the one that takes it."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import click

from stokesfibers.cli.failure import Refused
from stokesfibers.core.errors import InputError

Kind = Literal["case", "sweep", "run", "folder", "dataset", "export"]

_WHAT: dict[str, str] = {
    "case": "a case file",
    "sweep": "a sweep file",
    "run": "a stored run",
    "folder": "the folder of a sweep",
    "dataset": "the dataset of a sweep",
    "export": "an export of a run",
}
_SWEEP_KEYS = {"base", "case", "grid", "zip", "cases", "seeds", "collect"}
_CASE_KEYS = {"fiber", "fluid", "stepping"}
_MOST_BYTES = 1_000_000  # of a file that somebody wrote


def expecting(kind: Kind, *others: Kind) -> Callable[[click.Context, click.Parameter, Path], Path]:
    """Return the callback of an argument that refuses what is known to be of no kind it takes.

    It speaks of the first kind.
    What is of no kind that is known goes through: the command says what is wrong with it.
    """

    def checked(context: click.Context, parameter: click.Parameter, path: Path) -> Path:  # noqa: ARG001
        found = kind_of(path)
        if found in (None, kind, *others):
            return path
        raise Refused(InputError(str(path), _WHAT[kind], _WHAT[found], _advice(found, path, kind)))

    return checked


def kind_of(path: Path) -> Kind | None:
    """Return what is at `path`; None if it is nothing of ours, damaged or not there."""
    try:
        return _kind_of_folder(path) if path.is_dir() else _kind_of_file(path)
    except (OSError, ValueError, AttributeError, TypeError):
        return None


def _kind_of_file(path: Path) -> Kind | None:
    if path.suffix.lower() != ".toml" or path.stat().st_size > _MOST_BYTES:
        return None
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    if tables.keys() & _SWEEP_KEYS:
        return "sweep"
    return "case" if tables.keys() & _CASE_KEYS else None


def _kind_of_folder(path: Path) -> Kind | None:
    if (path / "sweep.json").is_file():
        return "folder"
    if (path / "export.json").is_file():
        return "export"
    if not (path / "zarr.json").is_file():
        return None
    held: dict[str, Any] = json.loads((path / "zarr.json").read_bytes()).get("attributes", {})
    if held.get("format") == "stokesfibers-run":
        return "run"
    return "dataset" if {"cases", "collect", "provenance"} <= held.keys() else None


def _advice(found: Kind, path: Path, wanted: Kind) -> str:
    """Return what to do with `path`, which holds `found`, where `wanted` was meant."""
    folder = path if found == "folder" else path.parent
    status = f"how its cases stand: stokesfibers sweep status {folder}"
    if found == "case":
        return f"{'Run it first' if wanted == 'run' else 'Run it with'}: stokesfibers run {path}"
    if found == "sweep" and wanted == "folder":
        return f"That is what was given with --out, by default {path.stem}."
    if found == "sweep":
        return f"Run it with: stokesfibers sweep {path}"
    if found == "run":
        return f"See it with: stokesfibers show {path}; go on with: stokesfibers resume {path}"
    if found == "export":
        return "Give the run that it was made from."
    if found == "dataset":
        return f'Read it with xarray.open_zarr("{path}"); {status}'
    if wanted == "run":
        runs = path / "runs"
        first = min(runs.glob("*.zarr"), default=runs)
        drawn = f"or draw what it gave: stokesfibers sweep plot {path}"
        return f"Give one of its runs, such as {first}; {drawn}"
    return f"Go on with the sweep file; {status}"
