"""What the linear system of a step of the high-order engine is made of, and what comes of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from stokesfibers.core.arrays import Array
from stokesfibers.domain import AbstractDomain
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_interaction import AbstractSpectralInteraction, Summed

REDUCTION = 1e-3
"""Of the residual of the coupled system in a step."""


@dataclass(frozen=True)
class FibersInFluid:
    """What moves: it stays the same from step to step.

    Attributes
    ----------
    fibers
        The discretised fibers.
    drag
        8 pi mu.
    interaction
        How they act on each other; None for each alone.
    """

    fibers: tuple[SpectralFiber, ...]
    drag: float
    interaction: AbstractSpectralInteraction | None

    def domain_at(self, t: float) -> AbstractDomain | None:
        """Return the domain at a time; None where fibers do not act on each other."""
        return self.interaction and self.interaction.domain_at(t)

    def still(self, domain: AbstractDomain | None) -> FibersInFluid:
        """Return the same in `domain` at all times, without functions: other ranks can have it."""
        if self.interaction is None or domain is None:
            return self
        return replace(self, interaction=self.interaction.still(domain))


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
class Pass:
    """Which equations a Newton pass solves, and how well; see `kernels.increment_system`.

    Attributes
    ----------
    alpha
        Coefficient of the newest state in the difference formula, 1 / time.
    implicit
        1 for a step; 0, with alpha = 1 and everything at rest, for velocity and tension.
    reduction
        Of the residual of the coupled system.
    """

    alpha: float
    implicit: float = 1.0
    reduction: float = REDUCTION


@dataclass(frozen=True)
class Increment:
    """Change of a state by one Newton pass.

    Attributes
    ----------
    modes, tensions
        As in `State`.
    ratio
        Largest ratio of the kernel's series, (fiber,).
    iterations
        Of the coupled solve; 1 if there is nothing to couple.
    summed
        How velocities between fibers were summed.
    """

    modes: Array
    tensions: Array
    ratio: Array
    iterations: int
    summed: Summed
