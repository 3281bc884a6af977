"""``stokesfibers report``: one page that says all about a run."""

from __future__ import annotations

from pathlib import Path

import click

from stokesfibers.cli.bars import patience
from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import RUN, run_argument
from stokesfibers.cli.replacing import replacing
from stokesfibers.cli.typed import named_as_typed


@click.command(short_help="Write a page with numbers, figures and origin of a run.")
@run_argument
@click.option("--out", type=RUN, help="File to write, .html; by default RUN.html beside the run.")
@click.option("--title", help="Title of the page; by default the run's name.")
@click.option(
    "--allow-python", is_flag=True, help="Let the run's flow come from a Python file, for groups."
)
@guarded
def report(*, run: Path, out: Path | None, title: str | None, allow_python: bool) -> None:
    """Write a report of the run in the folder RUN: one HTML page, complete in itself.

    It holds status and trust, figures that fit the case, health, the resolved case, where the run
    came from, how to reproduce it and what to cite. It can be mailed, printed and read offline.
    A report that is there already is replaced.
    """
    from stokesfibers.io.reader import open_run
    from stokesfibers.studio.report import report as write

    data = open_run(run)
    target = out or run.with_name(f"{run.stem}.html")
    name = title or run.resolve().name
    drawing = patience("drawing the figures, each for a light and a dark page")
    with drawing, replacing(target), named_as_typed({"path": "--out"}):
        click.echo(write(data, target, name=name, allow_python=allow_python))
