"""``stokesfibers run``: run a case and store what happens."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import (
    RUN,
    case_argument,
    python_option,
    quiet_option,
    set_option,
)


@click.command(short_help="Run a case and store it.")
@case_argument
@click.option("--out", required=True, type=RUN, help="Folder of the run to make, e.g. run.zarr.")
@set_option
@click.option("--overwrite", is_flag=True, help="Replace the run that is at --out.")
@python_option
@click.option(
    "--threads", type=click.IntRange(min=1), help="Threads to use; results do not depend on them."
)
@quiet_option
@guarded
def run(
    *,
    case: Path,
    out: Path,
    settings: tuple[str, ...],
    overwrite: bool,
    allow_python: bool,
    threads: int | None,
    quiet: bool,
) -> int:
    """Run the case file CASE and store what happens in the folder --out.

    Ctrl-C stores what there is; 'stokesfibers resume' goes on from there.
    """
    from stokesfibers.cli.ending import say_how_it_ended
    from stokesfibers.cli.words import warn
    from stokesfibers.config.case import load_case
    from stokesfibers.problem.checks import doubts
    from stokesfibers.run.progress import progress
    from stokesfibers.run.simulate import simulate

    loaded = load_case(case, settings, allow_python=allow_python)
    if not quiet:
        for doubt in doubts(loaded.problem, loaded.plan()):
            warn(str(doubt))
    with nullcontext() if quiet else progress(loaded.until) as watch:
        result = simulate(
            loaded.problem,
            loaded.curves(),
            until=loaded.until,
            record=loaded.record,
            out=out,
            overwrite=overwrite,
            case=loaded.tables(),
            watch=watch,
            stop=loaded.stop,
            threads=threads,
        )
    return say_how_it_ended(result, out, quiet=quiet)
