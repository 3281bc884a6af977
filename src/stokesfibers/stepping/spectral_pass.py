"""What one Newton pass of the high-order engine is given, and what it finds."""

from __future__ import annotations

from dataclasses import dataclass

from stokesfibers.core.arrays import Array
from stokesfibers.slender.spectral_interaction import Summed


@dataclass(frozen=True)
class Surroundings:
    """What acts on the fibers at their nodes, in units of their own length and rigidity.

    Attributes
    ----------
    time
        t.
    flow
        U / L, (fiber, 3, N).
    gradient
        grad U, (fiber, N, 3, 3).
    load
        External force per length times L^3 / E, (fiber, 3, N).
    """

    time: float
    flow: Array
    gradient: Array
    load: Array


@dataclass(frozen=True)
class Increment:
    """Change of a state by one Newton pass.

    Attributes
    ----------
    modes, tensions
        As in `State`.
    ratio
        Largest ratio of the kernel's series, (fiber,).
    own_error
        Estimated error of each fiber's own velocity where it nears itself, (fiber,).
    iterations
        Of the coupled solve; 1 if there is nothing to couple.
    summed
        How velocities between fibers were summed.
    """

    modes: Array
    tensions: Array
    ratio: Array
    own_error: Array
    iterations: int
    summed: Summed
