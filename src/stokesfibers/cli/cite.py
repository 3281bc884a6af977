"""``stokesfibers cite``: what to cite for a case."""

from __future__ import annotations

from pathlib import Path

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import case_argument, python_option, set_option
from stokesfibers.cli.words import heading, lines


@click.command(short_help="Say what to cite for a case.")
@case_argument
@set_option
@python_option
@guarded
def cite(*, case: Path, settings: tuple[str, ...], allow_python: bool) -> None:
    """Say where the methods that the case file CASE chooses come from, and what to cite."""
    from stokesfibers.config.case import load_case
    from stokesfibers.studio.report_cite import PAPER, SOFTWARE, methods

    problem = load_case(case, settings, allow_python=allow_python).problem
    click.secho("Methods of this case", bold=True)
    lines(methods(problem))
    heading("Please cite the paper and this software")
    click.echo(f"{PAPER}\n\n{SOFTWARE}")
