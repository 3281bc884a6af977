"""Commands on several ranks: rank 0 does what one process would, the others assist it.

Only rank 0 speaks. The others are silent from the start on, so that what goes wrong with the input
is said once; what goes wrong on another rank alone is said by that one, and ends all of them.
"""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from stokesfibers.cli.failure import OUR_FAULT, reported

if TYPE_CHECKING:
    from stokesfibers.core.team import AbstractTeam

DISTRIBUTED = ("run", "resume")
"""Commands that ranks share; others are done by each."""


def silence_assistants(command: str | None) -> None:
    """Keep all ranks but the first from printing, if `command` is one that ranks share."""
    from stokesfibers.core.mpi import launched

    if command in DISTRIBUTED and launched()[0] > 0:
        sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115 - until the process ends


def on_ranks(work: Callable[..., int], *, mpi: bool | None, threads: int | None) -> int:
    """Do ``work(team)`` on rank 0 with the help of the others; return the exit code.

    Parameters
    ----------
    work
        Takes the team and returns an exit code.
    mpi
        Whether there are other ranks; None if the launcher's environment is to say.
    threads
        Of each rank; None for its part of the cores.
    """
    from stokesfibers.core.mpi import team_of_launcher

    team = team_of_launcher(mpi)
    if team.size == 1:
        return work(team)
    if team.rank > 0:
        return _help_out(team, threads)
    from stokesfibers.stepping.spectral_team import dismiss

    code = OUR_FAULT
    try:
        code = reported(lambda: work(team))
    finally:
        dismiss(team, code)
    return code


def _help_out(team: AbstractTeam, threads: int | None) -> int:
    """Assist rank 0, which alone listens to signals; end all ranks if that fails."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    from stokesfibers.run.simulate import reproducible
    from stokesfibers.stepping.spectral_team import assist

    try:
        with reproducible():
            return assist(team, threads)
    except BaseException as error:
        sys.stderr = sys.__stderr__
        text = "".join(traceback.format_exception(error))
        what = traceback.format_exception_only(error)[-1].strip()
        click.echo(f"error: rank {team.rank}: {what}. The run ends here.\n{text}", err=True)
        team.abort(OUR_FAULT)
        raise
