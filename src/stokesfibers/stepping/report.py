"""What a stepper says about one step."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan


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
        Seconds spent in each of the stepper's stages.
    rejected
        Tries that were thrown away before it.
    iterations
        Iterations of the tension solve; 1 for a direct solve.
    nodes
        Nodes per fiber.
    spatial_error
        Estimated relative error of the shapes through lack of nodes; NaN if the engine has none.
    cutoff
        Distance to which velocities between fibers are summed pair by pair; infinite if all are.
    modes
        Fourier modes that sum the rest.
    """

    time: float
    step_size: float
    order: int
    wall_time: tuple[float, ...]
    rejected: int = 0
    iterations: int = 1
    nodes: int = 0
    spatial_error: float = nan
    cutoff: float = inf
    modes: int = 0
