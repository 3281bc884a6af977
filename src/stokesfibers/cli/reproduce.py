"""``stokesfibers reproduce``: the figures and numbers of the paper, with a verdict for each."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stokesfibers.cli.bars import share_bar
from stokesfibers.cli.failure import DONE, INTERRUPTED, OUR_FAULT, complain, guarded
from stokesfibers.cli.options import processes_option
from stokesfibers.cli.replacing import files_in, results_folder, say_replaced
from stokesfibers.cli.words import lines, number

if TYPE_CHECKING:
    from stokesfibers.experiments.base import Experiment

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
@processes_option
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
            with share_bar(experiment.name) as progress:
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
    """Return the folder for results, which must be given."""
    from stokesfibers.core.errors import InputError

    if out is None:
        raise InputError("--out", "a folder for the results", "nothing")
    return results_folder(out)


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
