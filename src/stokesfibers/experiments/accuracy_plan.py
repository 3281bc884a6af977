"""What `accuracy` computes: cases, references, tolerances, and the runs that aim at one error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.experiments.engine_runs import EngineRun, paper_run
from stokesfibers.experiments.tiers import FULL, POSITIONS_EVERY, QUICK, BucklingRun, Tier
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.slender.regularization import (
    AbstractRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)

_FIRST, _LAST = -1.024, 1.536
"""Times from the vertical between which shapes are compared: 48.64 ... 51.2 in the paper's runs."""


@dataclass(frozen=True)
class Case:
    """A model whose runs are compared with each other only.

    Attributes
    ----------
    mu_bar
        Effective viscosity (10).
    regularization
        delta(s).
    skew
        Initial deflection out of the plane over the one in it; 0 stays in the plane.
    """

    mu_bar: float
    regularization: AbstractRegularization
    skew: float = 0.0

    @property
    def label(self) -> str:
        """Short name of the case."""
        name = f"mu_bar = {self.mu_bar:.0e}, {self.regularization.kind}".replace("e+0", "e")
        return f"{name}, 3D" if self.skew else name


@dataclass(frozen=True)
class Plan:
    """What is computed.

    Attributes
    ----------
    tier
        Start, length and times of all runs.
    cases
        The models; the first is the one that costs are aimed at.
    reference, control
        Nodes and rtol of the reference, and of the run that its error is told from.
    rtols
        Tolerances of the runs that choose their nodes.
    aims
        Error aimed at, nodes and rtol of runs of the first case that choose nothing.
    nodes
        Nodes of the runs at `reference`'s rtol.
    repeats
        How often a run is timed.
    every
        Interval between the times compared; a multiple of all steps of the paper's scheme.
    """

    tier: Tier
    cases: tuple[Case, ...]
    reference: tuple[int, float]
    control: tuple[int, float]
    rtols: tuple[float, ...]
    aims: tuple[tuple[float, int, float], ...]
    nodes: tuple[int, ...]
    repeats: int
    every: float

    @property
    def times(self) -> Array:
        """The times at which shapes are compared."""
        return self.tier.vertical + np.arange(_FIRST, _LAST + 0.5 * self.every, self.every)

    @property
    def points(self) -> int:
        """The equally spaced points at which shapes are compared."""
        return self.tier.levels[0] + 1

    def run(
        self, case: Case, rtol: float, nodes: int | None = None, observe: float | None = None
    ) -> EngineRun:
        """Return a run of the high-order engine."""
        engine = SpectralEngine(rtol=rtol, nodes=nodes)
        return EngineRun(
            self.tier, case.mu_bar, engine, case.regularization, observe, skew=case.skew
        )

    def known(self, case: Case, which: tuple[int, float]) -> EngineRun:
        """Return the reference or the control of a case, with observables twice as often."""
        nodes, rtol = which
        return self.run(case, rtol, nodes, 0.5 * self.tier.observe)

    def by_paper(self, case: Case) -> list[EngineRun | BucklingRun]:
        """Return the runs of a case by the paper's scheme, coarse to fine."""
        return [
            paper_run(self.tier, case.mu_bar, n, regularization=case.regularization, skew=case.skew)
            for n in self.tier.levels
        ]


_SPHEROIDAL, _PAPER = SpheroidalRegularization(), PaperRegularization()
_SKEW = 20.0
_FULL = Plan(
    tier=FULL,
    cases=(
        Case(4e5, _SPHEROIDAL),
        Case(3e5, _SPHEROIDAL),
        Case(2e5, _SPHEROIDAL),
        Case(4e5, _PAPER),
        Case(3e5, _SPHEROIDAL, _SKEW),
    ),
    reference=(100, 1e-9),
    control=(88, 1e-8),
    rtols=(1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7),
    aims=((1e-3, 36, 7e-4), (1e-5, 56, 1.3e-5), (1e-7, 76, 5e-8)),
    nodes=(16, 20, 24, 28, 32, 36, 40, 48, 56, 64, 72),
    repeats=5,
    every=POSITIONS_EVERY,
)
_QUICK = Plan(
    tier=QUICK,
    cases=(Case(2e5, _SPHEROIDAL), Case(2e5, _PAPER), Case(2e5, _SPHEROIDAL, _SKEW)),
    reference=(60, 1e-7),
    control=(52, 1e-6),
    rtols=(1e-3, 1e-5),
    aims=((1e-3, 24, 5e-4), (1e-4, 32, 5e-5)),
    nodes=(16, 28),
    repeats=2,
    every=2 * POSITIONS_EVERY,
)


def plan(quick: bool) -> Plan:
    """Return what to compute."""
    return _QUICK if quick else _FULL
