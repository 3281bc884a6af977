"""``stokesfibers resume``: go on with a stored run."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import (
    mpi_option,
    python_option,
    quiet_option,
    run_argument,
    threads_option,
)
from stokesfibers.cli.ranks import on_ranks

if TYPE_CHECKING:
    from stokesfibers.core.team import AbstractTeam


@click.command(short_help="Go on with a run that was stopped or killed.")
@run_argument
@click.option("--until", type=float, help="New time to stop; by default the run's own.")
@python_option
@threads_option
@mpi_option
@quiet_option
@guarded
def resume(
    *,
    run: Path,
    until: float | None,
    allow_python: bool,
    threads: int | None,
    mpi: bool | None,
    quiet: bool,
) -> int:
    """Go on with the run in the folder RUN; the result is bitwise that of a run without a stop."""
    started = perf_counter()
    from stokesfibers.cli.ending import Spent, say_how_it_ended
    from stokesfibers.core.checks import positive
    from stokesfibers.io.store import RunStore
    from stokesfibers.run.progress import progress
    from stokesfibers.run.simulate import resume as go_on
    from stokesfibers.run.simulate import stored_case

    def work(team: AbstractTeam) -> int:
        store = RunStore.open(run)
        stored = stored_case(store)["stepping"]["until"]
        before = store.lengths["numerics"]
        end = stored if until is None else positive("--until", until)
        bar = nullcontext() if quiet else progress(end, start=min(store.status["time"], end))
        with bar as watch:
            result = go_on(
                run,
                until=until,
                allow_python=allow_python,
                watch=watch,
                threads=threads,
                team=team,
            )
        if not quiet and store.status == result.status.to_dict():
            click.echo("There was nothing left to do; --until sets a later end.")
        spent = Spent(perf_counter() - started, before)
        return say_how_it_ended(result, run, spent, quiet=quiet)

    return on_ranks(work, mpi=mpi, threads=threads)
