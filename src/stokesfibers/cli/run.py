"""``stokesfibers run``: run a case and store what happens."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import (
    RUN,
    case_argument,
    mpi_option,
    python_option,
    quiet_option,
    set_option,
    threads_option,
)
from stokesfibers.cli.ranks import on_ranks

if TYPE_CHECKING:
    from stokesfibers.core.team import AbstractTeam


@click.command(short_help="Run a case and store it.")
@case_argument
@click.option("--out", required=True, type=RUN, help="Folder of the run to make, e.g. run.zarr.")
@set_option
@click.option("--overwrite", is_flag=True, help="Replace the run that is at --out.")
@python_option
@threads_option
@mpi_option
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
    mpi: bool | None,
    quiet: bool,
) -> int:
    """Run the case file CASE and store what happens in the folder --out.

    Ctrl-C stores what there is; 'stokesfibers resume' goes on from there.

    'mpirun -n P stokesfibers run CASE --out RUN' shares the work among P processes.
    """
    from stokesfibers.cli.ending import say_how_it_ended
    from stokesfibers.cli.words import warn
    from stokesfibers.config.case import load_case
    from stokesfibers.problem.checks import doubts
    from stokesfibers.run.progress import progress
    from stokesfibers.run.simulate import simulate

    def work(team: AbstractTeam) -> int:
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
                team=team,
            )
        return say_how_it_ended(result, out, quiet=quiet)

    return on_ranks(work, mpi=mpi, threads=threads)
