"""The stepper of each engine."""

from __future__ import annotations

from typing import Any

from stokesfibers.core.errors import InputError
from stokesfibers.core.team import ALONE, AbstractTeam
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.stepping.base import AbstractStepper
from stokesfibers.stepping.paper import PaperStepper
from stokesfibers.stepping.spectral_run import SpectralRunStepper


def stepper_of(
    problem: Problem, threads: int | None = None, team: AbstractTeam = ALONE
) -> AbstractStepper[Any]:
    """Return the stepper of the problem's engine.

    Parameters
    ----------
    problem
        The case.
    threads
        Threads that fibers are spread over; None for all cores. Results do not depend on it.
    team
        Ranks that share the work.

    Raises
    ------
    InputError
        If the engine cannot do what the problem asks for, or not on several ranks.
    """
    if isinstance(problem.engine, PaperEngine):
        if team.size > 1:
            raise InputError(
                "engine",
                "'spectral' on several ranks",
                f"{problem.engine.kind!r} on {team.size}",
                "The paper's engine runs on the threads of one rank.",
            )
        return PaperStepper(problem, threads)
    return SpectralRunStepper(problem, threads, team)
