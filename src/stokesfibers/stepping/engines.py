"""The stepper of each engine."""

from __future__ import annotations

from typing import Any

from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.stepping.base import AbstractStepper
from stokesfibers.stepping.paper import PaperStepper
from stokesfibers.stepping.spectral_run import SpectralRunStepper


def stepper_of(problem: Problem, threads: int | None = None) -> AbstractStepper[Any]:
    """Return the stepper of the problem's engine.

    Parameters
    ----------
    problem
        The case.
    threads
        Threads that fibers are spread over; None for all cores. Results do not depend on it.

    Raises
    ------
    InputError
        If the engine cannot do what the problem asks for.
    """
    if isinstance(problem.engine, PaperEngine):
        return PaperStepper(problem, threads)
    return SpectralRunStepper(problem, threads)
