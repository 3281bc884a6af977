"""``stokesfibers plot``: a figure of a stored run."""

from __future__ import annotations

from pathlib import Path

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import run_argument


@click.command(short_help="Draw a figure of a run.")
@run_argument
@click.argument("kind")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="File to write, .png, .pdf or .svg; by default RUN-KIND.png beside the run.",
)
@guarded
def plot(*, run: Path, kind: str, out: Path | None) -> None:
    """Draw a figure of the run in the folder RUN.

    KIND is shapes (over one another), panels (one for each time), tension, stress, energy,
    3d (a snapshot in the cell), orientation, order (the orientation tensor against time) or
    health (length error, curvature, steps and wall time).
    """
    from stokesfibers.core.errors import InputError
    from stokesfibers.io.reader import open_run
    from stokesfibers.plot import KINDS, save

    if kind not in KINDS:
        raise InputError("KIND", f"one of {', '.join(KINDS)}", repr(kind))
    target = out or run.with_name(f"{run.stem}-{kind}.png")
    click.echo(save(KINDS[kind](open_run(run)), target))
