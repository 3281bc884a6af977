"""``stokesfibers run``: run a case and store what happens."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from time import perf_counter
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
@click.option(
    "--out",
    type=RUN,
    metavar="RUN",
    help="Folder of the run to make, by default CASE with .zarr for .toml.",
)
@set_option
@click.option("--overwrite", is_flag=True, help="Replace the run that is there.")
@python_option
@threads_option
@mpi_option
@quiet_option
@guarded
def run(
    *,
    case: Path,
    out: Path | None,
    settings: tuple[str, ...],
    overwrite: bool,
    allow_python: bool,
    threads: int | None,
    mpi: bool | None,
    quiet: bool,
) -> int:
    """Run the case file CASE and store what happens in a folder.

    Without --out the folder is called as the case, here: buckling.toml gives buckling.zarr. A run
    that is there already is kept, unless --overwrite is given.

    Ctrl-C stores what there is; 'stokesfibers resume RUN' goes on from there.

    'mpirun -n P stokesfibers run CASE' shares the work among P processes.
    """
    started = perf_counter()
    from stokesfibers.cli.bars import patience
    from stokesfibers.cli.ending import Spent, say_how_it_ended
    from stokesfibers.cli.words import warn
    from stokesfibers.config.case import load_case
    from stokesfibers.problem.checks import doubts
    from stokesfibers.run.progress import progress
    from stokesfibers.run.simulate import simulate

    place = Path(f"{case.stem}.zarr") if out is None else out

    def work(team: AbstractTeam) -> int:
        loaded = load_case(case, settings, allow_python=allow_python)
        if not quiet:
            with patience("placing the fibers, which takes long where there is little room"):
                plan = loaded.plan()
            for doubt in doubts(loaded.problem, plan):
                warn(str(doubt))
            if out is None and (overwrite or not place.exists()):
                click.echo(f"Storing in {place}.")
        with nullcontext() if quiet else progress(loaded.until) as watch:
            result = simulate(
                loaded.problem,
                loaded.curves(),
                until=loaded.until,
                record=loaded.record,
                out=place,
                overwrite=overwrite,
                case=loaded.tables(),
                watch=watch,
                stop=loaded.stop,
                threads=threads,
                team=team,
            )
        return say_how_it_ended(result, place, Spent(perf_counter() - started), quiet=quiet)

    return on_ranks(work, mpi=mpi, threads=threads)
