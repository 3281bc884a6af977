"""What a stepper says about one step."""

from __future__ import annotations

from dataclasses import dataclass

STAGES = ("positions", "tension")
"""Parts of a step whose wall time is recorded."""


@dataclass(frozen=True)
class StepReport:
    """Numerics of one step.

    Attributes
    ----------
    time
        Simulated time at its end.
    step_size
        Its length.
    order
        Order of the time discretisation.
    wall_time
        Seconds spent in each of `STAGES`.
    rejected
        Tries that were thrown away before it.
    iterations
        Iterations of the tension solve; 1 for a direct solve.
    """

    time: float
    step_size: float
    order: int
    wall_time: tuple[float, ...]
    rejected: int = 0
    iterations: int = 1
