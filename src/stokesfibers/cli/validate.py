"""``stokesfibers validate``: the validation suite, with a verdict for every number."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from stokesfibers.cli.bars import share_bar
from stokesfibers.cli.failure import DONE, INTERRUPTED, OUR_FAULT, complain, guarded
from stokesfibers.cli.options import processes_option
from stokesfibers.cli.replacing import files_in, results_folder, say_replaced
from stokesfibers.cli.words import duration, lines, warn

if TYPE_CHECKING:
    from stokesfibers.study.validation.record import Entry
    from stokesfibers.study.validation.suite import Report, Result

_COLOURS = {"agrees": "green", "explained": "yellow", "not run": "yellow"}
_SHOWN = ("quantity", "theirs", "ours", "error", "tolerance", "verdict")


@click.command(short_help="Hold the solver against exact answers and published numbers.")
@click.argument("what", required=False, type=click.Choice(["list"]), metavar="[list]")
@click.option("--quick/--full", default=True, help="A minute, or all published figures too: hours.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder for the tables and the runs; by default nothing is kept.",
)
@click.option(
    "--only", multiple=True, metavar="NAME", help="Only this entry; may be given several times."
)
@processes_option
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@guarded
def validate(
    *,
    what: str | None,
    quick: bool,
    out: Path | None,
    only: tuple[str, ...],
    workers: int,
    as_json: bool,
) -> int:
    """Hold the solver against exact answers, published numbers and independent calculations.

    Every number is printed beside the one it is held against, with the error, what is allowed and
    a verdict. 'list' names the entries. With --out the tables are written, or replaced, as
    markdown, CSV and JSON, and runs are kept there and used again; --only replaces the entries it
    names and keeps the others there. Exit code 0 only if nothing differs or fails.
    """
    from stokesfibers.study.validation.registry import ENTRIES
    from stokesfibers.study.validation.suite import chosen

    entries = chosen(ENTRIES, only, quick=quick)
    if what == "list":
        _list(entries if only else ENTRIES, as_json=as_json)
        return DONE
    with _folder(out) as folder:
        try:
            report = _report(entries, folder, quick=quick, workers=workers, quiet=as_json)
        except KeyboardInterrupt:
            complain("Interrupted. With --out, runs that are finished are not computed again.")
            return INTERRUPTED
    _end(report, out, [entry.name for entry in ENTRIES] if only else [], as_json=as_json)
    if report.bad:
        complain(f"{', '.join(report.bad)}: numbers differ or failed. Please report it.")
    return OUR_FAULT if report.bad else DONE


def _report(
    entries: list[Entry], folder: Path, *, quick: bool, workers: int, quiet: bool
) -> Report:
    from stokesfibers.experiments.base import Settings
    from stokesfibers.study.validation.suite import validate as run_suite

    with share_bar() as progress:
        settings = Settings(folder, quick=quick, workers=workers, progress=progress)
        return run_suite(entries, settings, (lambda _: None) if quiet else _say)


def _say(result: Result) -> None:
    """Print the numbers of one entry, and why there are none."""
    from stokesfibers.study.validation.tables import plain

    entry = result.entry
    click.secho(f"{entry.name}  {entry.title} ({entry.source})", bold=True)
    table: list[tuple[str, ...]] = [_SHOWN] if result.findings else []
    for one in result.findings:
        error = "" if one.error is None else f"{one.error:.2g}"
        shown = (one.quantity, plain(one.theirs), plain(one.ours), error, one.tolerance)
        table.append((*shown, f"{one.verdict} ({one.erratum})" if one.erratum else one.verdict))
    lines(table)
    if result.problem:
        click.echo(f"  {result.problem}")
    if result.details:
        click.echo(result.details, err=True)
    colour = _COLOURS.get(result.outcome, "red")
    click.secho(f"  {result.outcome}", fg=colour, bold=True, nl=False)
    click.echo(f", {duration(result.seconds)}\n")


def _end(report: Report, out: Path | None, kept: list[str], *, as_json: bool) -> None:
    """Print the counts or all of it, and write the files; `kept` are entries that may stay."""
    from stokesfibers.study.validation.tables import as_dict, summary, write

    held = as_dict(report)
    click.echo(json.dumps(held, indent=1, allow_nan=False) if as_json else summary(held))
    if out is not None:
        before = files_in(out)
        paths = write(report, out, kept)
        say_replaced(path for path in paths if path in before)
        if not as_json:
            click.echo(f"files: {', '.join(map(str, paths))}")
    if held["counts"]["not run"]:
        missing = [r.problem for r in report.results if r.outcome == "not run"]
        warn(f"not everything was run: {'; '.join(dict.fromkeys(missing))}")


def _list(entries: tuple[Entry, ...] | list[Entry], *, as_json: bool) -> None:
    fields = ("name", "group", "tier", "title", "source")
    found = [{name: getattr(entry, name) for name in fields} for entry in entries]
    if as_json:
        click.echo(json.dumps(found, indent=1))
    else:
        lines([fields, *(tuple(entry.values()) for entry in found)])


@contextmanager
def _folder(out: Path | None) -> Iterator[Path]:
    """Return where runs go: the folder given, or one that is gone afterwards."""
    if out is None:
        with tempfile.TemporaryDirectory(prefix="stokesfibers-validate-") as name:
            yield Path(name)
        return
    results_folder(out).mkdir(exist_ok=True)
    yield out
