"""The stepper of each engine."""

from __future__ import annotations

from typing import Any

from stokesfibers.problem.problem import Problem
from stokesfibers.stepping.base import AbstractStepper
from stokesfibers.stepping.paper import PaperStepper


def stepper_of(problem: Problem, threads: int | None = None) -> AbstractStepper[Any]:
    """Return the stepper of the problem's engine.

    Parameters
    ----------
    problem
        The case.
    threads
        Threads that fibers are spread over; None for all cores. Results do not depend on it.
    """
    return PaperStepper(problem, threads)
