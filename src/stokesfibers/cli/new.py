"""``stokesfibers new``: a case file to start from."""

from __future__ import annotations

from pathlib import Path

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.words import heading, lines


@click.command(short_help="Write a case file to start from.")
@click.argument("name", required=False)
@click.option(
    "--out", type=click.Path(path_type=Path), help="File to write; by default NAME.toml here."
)
@guarded
def new(*, name: str | None, out: Path | None) -> None:
    """Write a copy of the shipped case NAME, to be edited and run; without NAME list them."""
    from stokesfibers.config.shipped import about, copied, shipped_cases

    if name is None:
        heading("Cases to start from")
        lines((case, about(path)) for case, path in shipped_cases().items())
        click.echo("\nNext: stokesfibers new NAME")
        return
    written = copied(name, out)
    click.echo("\n".join(map(str, written)))
    stem = written[0].stem
    command = f"sweep {written[0]} --out {stem}"
    if not name.startswith("sweeps/"):
        command = f"run {written[0]} --out {stem}.zarr"
    click.echo(f"Next: stokesfibers {command}", err=True)
