"""``stokesfibers new``: a case file to start from."""

from __future__ import annotations

from pathlib import Path

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.words import heading, lines


@click.command(short_help="Write a case file to start from.")
@click.argument("name", required=False)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="File to write, by default NAME.toml here; one that exists is never replaced.",
)
@guarded
def new(*, name: str | None, out: Path | None) -> None:
    """Write a copy of the shipped case NAME, to be edited and run; without NAME list them all.

    A sweep, such as sweeps/buckling, comes with the case that it varies; one of that name that is
    there already, edited or not, is kept.
    """
    from stokesfibers.config.shipped import about, copied, shipped_cases

    if name is None:
        heading("Cases to start from")
        lines((case, about(path)) for case, path in shipped_cases().items())
        click.echo("\nNext: stokesfibers new NAME")
        return
    made = copied(name, out)
    click.echo("\n".join(map(str, made.written)))
    if made.kept is not None:
        click.echo(f"Kept {made.kept}, which differs from the shipped one.", err=True)
        click.echo("The sweep varies yours.", err=True)
    if name.startswith("sweeps/"):
        click.echo(f"Edit {made.written[0]}, which says all that a first figure needs.", err=True)
    command = "sweep" if name.startswith("sweeps/") else "run"
    click.echo(f"Next: stokesfibers {command} {made.written[0]}", err=True)
    click.echo("What it may say: stokesfibers keys", err=True)
