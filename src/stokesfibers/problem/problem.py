"""The frozen record of a case: fibers, fluid, flow, model and engine."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from math import pi

from stokesfibers.constraint.coupled import AbstractTensionSolver, FixedPoint
from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.domain import AbstractDomain, Free
from stokesfibers.domain.sheared import Sheared
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import AbstractFlow, NoFlow
from stokesfibers.load import AbstractLoad, NoLoad
from stokesfibers.problem.engine import PaperEngine, SpectralEngine
from stokesfibers.slender.mobility import AbstractMobility, NonLocal
from stokesfibers.summation import AbstractImageSum, EngineImages, ExactImages, FastImages
from stokesfibers.summation.close_approach import AbstractCloseApproach, EngineCloseApproach

_NET_FORCE = (
    (
        "forces that add up to zero in one periodic direction, or domain.kind = 'free'",
        "a net force, which drives an unbounded velocity",
        "A row of forces drags the fluid along like an endless cylinder: faster the longer it is.",
    ),
    (
        "the Ewald sum, domain.sum = 'ewald', for a net force in two or three directions",
        "a sum over images that converges only where forces add up to zero",
        "Take engine = 'spectral' and sum = 'ewald', which states what balances the force.",
    ),
)
"""Why a net force is refused in periodic space: with one periodic direction; with more, where it
is not the Ewald sum that is asked for."""


@dataclass(frozen=True)
class Problem:
    """Everything that determines a run except the initial shapes and what to record.

    Attributes
    ----------
    fiber
        One kind of fiber, or several.
    mu_bar
        Effective viscosity (10) of the first kind of fiber at the reference rate 1:
        8 pi mu = mu_bar E / L^4. Give this or `viscosity`.
    viscosity
        mu, in units of force time / length^2.
    flow
        Background flow.
    mobility
        Model of the fluid's drag.
    engine
        Discretisation and time stepping.
    domain
        Free or periodic space.
    image_sum
        How periodic images are summed.
    close_approach
        What happens where fibers come near each other.
    load
        External force on the fibers.
    tension_solver
        How the coupled tensions of several fibers are solved.
    """

    fiber: Fiber | tuple[Fiber, ...]
    _: KW_ONLY
    mu_bar: float | None = None
    viscosity: float | None = None
    flow: AbstractFlow = field(default_factory=NoFlow)
    mobility: AbstractMobility = field(default_factory=NonLocal)
    engine: PaperEngine | SpectralEngine = field(default_factory=SpectralEngine)
    domain: AbstractDomain = field(default_factory=Free)
    image_sum: AbstractImageSum = field(default_factory=EngineImages)
    close_approach: AbstractCloseApproach = field(default_factory=EngineCloseApproach)
    load: AbstractLoad = field(default_factory=NoLoad)
    tension_solver: AbstractTensionSolver = field(default_factory=FixedPoint)

    def __post_init__(self) -> None:
        if (self.mu_bar is None) == (self.viscosity is None):
            came = "neither" if self.mu_bar is None else "both"
            raise InputError("mu_bar", "either mu_bar or viscosity", came)
        name = "viscosity" if self.mu_bar is None else "mu_bar"
        checks.positive(name, getattr(self, name))
        kinds = self.fiber if isinstance(self.fiber, tuple) else (self.fiber,)
        if not kinds or not all(isinstance(kind, Fiber) for kind in kinds):
            raise InputError("fiber", "a Fiber or a tuple of Fibers", self.fiber)
        directions = int((self.domain.lengths > 0.0).sum())
        fast = isinstance(self.image_sum, FastImages)
        if isinstance(self.image_sum, EngineImages) or not (directions or fast):
            chosen_sum = self.engine.image_sum()
            if directions > chosen_sum.most_directions and isinstance(self.engine, SpectralEngine):
                chosen_sum = FastImages()
            object.__setattr__(self, "image_sum", chosen_sum)
        if isinstance(self.close_approach, EngineCloseApproach):
            object.__setattr__(self, "close_approach", self.engine.close_approach())
        if isinstance(self.engine, PaperEngine) and (
            fast or isinstance(self.image_sum, ExactImages)
        ):
            raise InputError(
                "domain.sum",
                "'images' or 'truncated' with the paper's engine",
                repr(self.image_sum.kind),
                "Take engine = 'spectral'.",
            )
        if isinstance(self.domain, Sheared):
            _check_sheared(self)
        several = directions > 1
        balanced = several and isinstance(self.image_sum, FastImages)
        if self.load.has_net_force and directions and not balanced:
            raise InputError("load", *_NET_FORCE[several])
        if directions > self.image_sum.most_directions:
            raise InputError(
                "domain.sum",
                "'truncated', asked for by name, for more than one periodic direction",
                repr(self.image_sum.kind),
                "The sum over images then converges slowly, or only for its cubic cut-off.",
            )
        _check_periods(self.domain, max(kind.length for kind in kinds))
        object.__setattr__(self, "fiber", kinds)
        chosen = self.mobility.resolved(self.engine.regularization())
        object.__setattr__(self, "mobility", chosen)
        rate = self.flow.rate_scale()
        mu_bar = max(self.drag * rate * kind.length**4 / kind.rigidity for kind in kinds)
        object.__setattr__(self, "engine", self.engine.resolved(rate, mu_bar))

    @property
    def kinds(self) -> tuple[Fiber, ...]:
        """The kinds of fibers, each once."""
        assert isinstance(self.fiber, tuple)
        return self.fiber

    @property
    def fibers(self) -> tuple[Fiber, ...]:
        """The kind of each fiber, in order of their numbers."""
        return tuple(kind for kind in self.kinds for _ in range(kind.count))

    def domain_at(self, t: float) -> AbstractDomain:
        """Return the domain at time t; a sheared cell follows the flow."""
        if isinstance(self.domain, Sheared):
            return self.domain.at(self.domain.strain + self.flow.strain(t))
        return self.domain

    @property
    def drag(self) -> float:
        """8 pi mu, in units of force time / length^2."""
        if self.viscosity is not None:
            return 8.0 * pi * self.viscosity
        first = self.fibers[0]
        assert self.mu_bar is not None
        return self.mu_bar * first.rigidity / first.length**4


def _check_periods(domain: AbstractDomain, longest: float) -> None:
    """Refuse a period shorter than a fiber, which would meet its own image."""
    short = [
        f"{period:g} along {axis}"
        for period, axis in zip(domain.lengths, "xyz", strict=True)
        if 0.0 < period < longest
    ]
    if short:
        expected = f"periods of at least the longest fiber, {longest:g}"
        raise InputError("domain.periods", expected, " and ".join(short))


def _check_sheared(problem: Problem) -> None:
    """Refuse what cannot go on in a sheared cell."""
    if isinstance(problem.engine, PaperEngine):
        raise InputError(
            "domain.kind",
            "'free' or 'periodic' with the paper's engine",
            "'sheared'",
            "Its sum over images knows no sliding ones. Take engine = 'spectral'.",
        )
    if not isinstance(problem.image_sum, FastImages):
        raise InputError(
            "domain.sum",
            "'ewald' in a sheared cell",
            repr(problem.image_sum.kind),
            "Leave domain.sum out; the other sums know no sliding images.",
        )
    problem.flow.strain(0.0)  # refuses flows that it cannot follow
