"""``stokesfibers reproduce``: the figures and numbers of the paper, with a verdict for each."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stokesfibers.cli.failure import DONE, INTERRUPTED, OUR_FAULT, complain, guarded
from stokesfibers.cli.replacing import files_in, say_replaced
from stokesfibers.cli.words import lines, number

if TYPE_CHECKING:
    from stokesfibers.experiments.base import Experiment, Progress

_COLOURS = {"agrees": "green", "differs": "red", "known difference": "yellow"}


@click.command(short_help="Reproduce figures and numbers of the paper.")
@click.argument("names", nargs=-1, metavar="[NAME ... | all | list]")
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder for figures and numbers; must be given."
)
@click.option("--quick", is_flag=True, help="Coarser and shorter runs, in seconds.")
@click.option(
    "--seed", type=int, help="Seed of what is drawn at random; where nothing is, it has no effect."
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    default=1,
    show_default=True,
    help="Processes that compute independent runs.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@guarded
def reproduce(
    *,
    names: tuple[str, ...],
    out: Path | None,
    quick: bool,
    seed: int | None,
    workers: int,
    as_json: bool,
) -> int:
    """Reproduce figures of the paper, and studies beyond it; 'list' names them.

    Each leaves pictures, data and the paper's numbers beside ours in the folder --out. Runs that
    are there already are used again, and interrupted ones continued; pictures and numbers are
    replaced.
    """
    from stokesfibers.experiments.registry import EXPERIMENTS

    if not names or names == ("list",):
        titles = {name: experiment.title for name, experiment in EXPERIMENTS.items()}
        click.echo(json.dumps(titles, indent=2) if as_json else _listed(titles))
        return DONE
    chosen = _chosen(names, EXPERIMENTS)
    folder = _folder(out)
    before, found = files_in(folder), []
    for experiment in chosen:
        try:
            with _progress(experiment.name) as progress:
                summary = experiment.reproduce(
                    folder, quick=quick, seed=seed, workers=workers, progress=progress
                )
        except KeyboardInterrupt:
            complain("Interrupted. The same command goes on from here.")
            return INTERRUPTED
        found.append(summary)
        if not as_json:
            _say(summary, folder)
    if as_json:
        click.echo(json.dumps(found, indent=2, allow_nan=False))
    made = {folder / file for summary in found for file in summary["files"]}
    say_replaced(sorted(before & made))
    differing = [summary["name"] for summary in found if summary["verdict"] == "differs"]
    if differing:
        complain(f"{', '.join(differing)}: numbers differ from the paper. Please report it.")
    return OUR_FAULT if differing else DONE


def _chosen(names: tuple[str, ...], experiments: dict[str, Experiment]) -> list[Experiment]:
    from stokesfibers.core.errors import InputError
    from stokesfibers.core.tables import did_you_mean

    if names == ("all",):
        return list(experiments.values())
    for name in names:
        if name not in experiments:
            known = f"one of {', '.join(experiments)}, all or list"
            raise InputError("NAME", known, repr(name), did_you_mean(name, experiments))
    return [experiments[name] for name in names]


def _folder(out: Path | None) -> Path:
    """Return the folder for results; its parent must exist, as for runs."""
    from stokesfibers.core.errors import InputError

    if out is None:
        raise InputError("--out", "a folder for the results", "nothing")
    if not out.resolve().parent.is_dir():
        hint = f"Make the folder {out.parent} first."
        raise InputError("--out", "a place in an existing folder", str(out), hint)
    if out.exists() and not out.is_dir():
        raise InputError("--out", "a folder", f"'{out}', a file")
    return out


@contextmanager
def _progress(name: str) -> Iterator[Progress | None]:
    """Show a bar of the share done, on a terminal only."""
    if not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    form = "{desc} |{bar}| {percentage:3.0f} %, {remaining} left"
    with tqdm(total=1.0, desc=name, leave=False, bar_format=form, dynamic_ncols=True) as bar:

        def show(what: str, share: float) -> None:
            bar.set_description_str(f"{name}: {what}", refresh=False)
            bar.update(max(0.0, min(share, 1.0) - bar.n))

        yield show


def _say(summary: dict[str, Any], folder: Path) -> None:
    """Print the paper's numbers beside ours."""
    click.secho(f"{summary['name']}  {summary['title']}", bold=True)
    rows = [("quantity", "paper", "ours", "verdict")]
    for row in summary["rows"]:
        rows.append((row["quantity"], _plain(row["paper"]), _plain(row["ours"]), row["verdict"]))
    lines(rows)
    click.secho(f"  {summary['verdict']}", fg=_COLOURS[summary["verdict"]], bold=True, nl=False)
    click.echo(f"; files: {', '.join(str(folder / file) for file in summary['files'])}\n")


def _plain(value: object) -> str:
    return number(value) if isinstance(value, float | int) else str(value or "-")


def _listed(titles: dict[str, Any]) -> str:
    width = max(map(len, titles))
    return "\n".join(f"{name.ljust(width)}  {title}" for name, title in titles.items())
