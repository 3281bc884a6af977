"""Engines as data: which discretisation and time stepper solves a problem, with its parameters."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import ceil, log10
from typing import ClassVar, Self

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.numerics.finite_differences import LEAST_INTERVALS
from stokesfibers.slender.regularization import (
    AbstractRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)
from stokesfibers.summation import AbstractImageSum, ExactImages, ImageSum
from stokesfibers.summation.close_approach import (
    AbstractCloseApproach,
    PaperCloseApproach,
    SmoothCloseApproach,
)

STEP_PER_SPACING = 1.28
"""dt rate / (h / L) of all the paper's runs."""
BETA_PER_RATE = 20.0
MOST_INTERVALS = 100_000
LARGEST_BETA_STEP = 0.5
"""dt beta of the default step; the explicit penalisation is unstable from 2/3 on."""


class AbstractEngine(abc.ABC):
    """A composition of grid, constraint and time stepper that a case names."""

    kind: ClassVar[str]
    citation: ClassVar[str]
    places: ClassVar[Mapping[str, str]]
    """The table of a case file that each field is in."""
    regularization: ClassVar[type[AbstractRegularization]]
    """The delta(s) it uses unless told otherwise."""
    image_sum: ClassVar[type[AbstractImageSum]]
    """The sum over periodic images it uses unless told otherwise."""
    close_approach: ClassVar[type[AbstractCloseApproach]]
    """What it does where fibers come near each other, unless told otherwise."""

    @abc.abstractmethod
    def resolved(self, rate: float, mu_bar: float) -> Self:
        """Return the engine with what is None set from the flow's `rate` and effective viscosity.

        Parameters
        ----------
        rate
            Rate of the flow, 0 where there is none.
        mu_bar
            Largest 8 pi mu rate L^4 / E of the fibers.

        Raises
        ------
        InputError
            If something cannot be derived.
        """

    @property
    @abc.abstractmethod
    def samples(self) -> int:
        """Equally spaced points that show a fiber's shape."""


@dataclass(frozen=True)
class PaperEngine(AbstractEngine):
    """The paper's scheme: finite differences in space, tension first, semi-implicit BDF2 in time.

    Attributes
    ----------
    intervals
        N.
    dt
        Time step; if None, 1.28 / (N rate), the ratio of the paper's runs, or 1 / (2 beta) if that
        is smaller: the penalisation is unstable above 2 / (3 beta).
    beta
        Penalisation of (14), per unit time; if None, 20 times the flow's rate.
    """

    intervals: int = 100
    dt: float | None = None
    beta: float | None = None
    kind: ClassVar[str] = "paper"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, Section 3"
    places: ClassVar[Mapping[str, str]] = {
        "intervals": "discretization",
        "dt": "stepping",
        "beta": "constraint",
    }
    regularization: ClassVar[type[AbstractRegularization]] = PaperRegularization
    image_sum: ClassVar[type[AbstractImageSum]] = ImageSum
    close_approach: ClassVar[type[AbstractCloseApproach]] = PaperCloseApproach

    def __post_init__(self) -> None:
        checks.whole("intervals", self.intervals, LEAST_INTERVALS, MOST_INTERVALS)
        if self.dt is not None:
            checks.positive("dt", self.dt)
        if self.beta is not None:
            checks.non_negative("beta", self.beta)

    @property
    def samples(self) -> int:
        return self.intervals + 1

    def resolved(self, rate: float, mu_bar: float) -> PaperEngine:  # noqa: ARG002
        for name in ("dt", "beta"):
            if getattr(self, name) is None and rate == 0.0:
                raise InputError(
                    name, "a value, since there is no flow rate to derive it from", "none"
                )
        beta = self.beta if self.beta is not None else BETA_PER_RATE * rate
        dt = self.dt
        if dt is None:
            dt = STEP_PER_SPACING / (self.intervals * rate)
            if beta > 0.0:
                dt = min(dt, LARGEST_BETA_STEP / beta)
        return replace(self, dt=dt, beta=beta)


DEFAULT_RTOL = 1e-4
LEAST_NODES = 8
MOST_NODES = 4096
_FIXED_ORDER = 2
_NODES_PER_DIGIT = 9.0  # at mu_bar = 4e5; from runs that buckle, 2e5 to 4e5, 1e-3 to 1e-7
_BENDS = 0.6  # power of mu_bar with which the bends a fiber takes multiply


@dataclass(frozen=True)
class SpectralEngine(AbstractEngine):
    """High order: Legendre modes in space, all unknowns in one implicit step, variable order.

    Attributes
    ----------
    nodes
        N, Gauss-Legendre nodes per fiber; if None, from the tolerance and the effective viscosity.
    adapt_nodes
        Change N during the run where the shapes ask for it; if None, where `nodes` is not given.
    rtol
        Wanted relative error of the shapes; 1e-4 unless `dt` is given.
    dt
        Fixed time step instead.
    order
        Order of the fixed step, 1 to 5; 2 if None.
    newton_passes
        1 leaves |x_s|^2 - 1 at the square of the step error; 2 brings it to rounding.
    """

    nodes: int | None = None
    adapt_nodes: bool | None = None
    rtol: float | None = None
    dt: float | None = None
    order: int | None = None
    newton_passes: int = 1
    kind: ClassVar[str] = "spectral"
    citation: ClassVar[str] = "stokesfibers, theory page 'The high-order engine'"
    places: ClassVar[Mapping[str, str]] = {
        "nodes": "discretization",
        "adapt_nodes": "discretization",
        "rtol": "stepping",
        "dt": "stepping",
        "order": "stepping",
        "newton_passes": "stepping",
    }
    regularization: ClassVar[type[AbstractRegularization]] = SpheroidalRegularization
    image_sum: ClassVar[type[AbstractImageSum]] = ExactImages
    close_approach: ClassVar[type[AbstractCloseApproach]] = SmoothCloseApproach

    def __post_init__(self) -> None:
        if self.nodes is not None:
            checks.whole("nodes", self.nodes, LEAST_NODES, MOST_NODES)
        if self.adapt_nodes is not None and not isinstance(self.adapt_nodes, bool):
            raise InputError("adapt_nodes", "true or false", self.adapt_nodes)
        if self.rtol is not None and self.dt is not None:
            raise InputError("dt", "either rtol or dt", "both", "rtol chooses the steps itself.")
        if self.rtol is not None and not 1e-12 <= checks.positive("rtol", self.rtol) <= 0.1:
            raise InputError("rtol", "a tolerance from 1e-12 to 0.1", self.rtol)
        if self.dt is not None:
            checks.positive("dt", self.dt)
        if self.order is not None:
            if self.dt is None:
                raise InputError("order", "nothing with rtol, which chooses it", self.order)
            if checks.whole("order", self.order, 1) > 5:
                raise InputError("order", "a whole number from 1 to 5", self.order)
        checks.whole("newton_passes", self.newton_passes, 1)

    @property
    def samples(self) -> int:
        return 4 * (self.nodes or LEAST_NODES) + 1

    def resolved(self, rate: float, mu_bar: float) -> SpectralEngine:  # noqa: ARG002
        rtol = DEFAULT_RTOL if self.rtol is None and self.dt is None else self.rtol
        order = _FIXED_ORDER if self.dt is not None and self.order is None else self.order
        nodes = _nodes(rtol or DEFAULT_RTOL, mu_bar) if self.nodes is None else self.nodes
        adapt = self.nodes is None if self.adapt_nodes is None else self.adapt_nodes
        return replace(self, rtol=rtol, order=order, nodes=nodes, adapt_nodes=adapt)


def _nodes(rtol: float, mu_bar: float) -> int:
    """Return an even number of nodes that resolves buckling to `rtol`, as far as mu_bar tells."""
    digits = max(2.0, -log10(rtol))
    wanted = 5.0 + _NODES_PER_DIGIT * digits * (mu_bar / 4e5) ** _BENDS
    return min(128, max(16, 2 * ceil(0.5 * wanted)))


ENGINES: dict[str, type[PaperEngine] | type[SpectralEngine]] = {
    engine.kind: engine for engine in (PaperEngine, SpectralEngine)
}
