"""``stokesfibers schema``: the JSON Schema of the case file, for editors."""

from __future__ import annotations

import json

import click

from stokesfibers.cli.failure import guarded


@click.command(short_help="Print the JSON Schema of the case file, for editors.")
@guarded
def schema() -> None:
    """Print the JSON Schema of the case file.

    An editor that knows TOML schemas completes and checks keys with it: save it as
    case.schema.json and put '#:schema ./case.schema.json' in the first line of a case.
    """
    from stokesfibers.config.schema import case_schema

    click.echo(json.dumps(case_schema(), indent=2))
