"""The runs of Section 4.1 as records: the paper's own, and a quick set of the same kind."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike

from stokesfibers.core.arrays import Array
from stokesfibers.fiber.initial import NearlyStraight
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule

EPS = 1e-3
POSITIONS_EVERY = 0.128
FRAME = 0.512
"""A multiple of every time step in use; times to compare are counted in it from the vertical."""


@dataclass(frozen=True)
class Tier:
    """What all runs of a set share.

    Attributes
    ----------
    name
        ``"full"`` or ``"quick"``.
    vertical
        Time at which the straight filament is vertical; it fixes the initial angle.
    until
        End of the runs.
    amplitude
        d_y of (47).
    step_ratio
        dt / h.
    levels
        Numbers of intervals, each twice the one before, for mu_bar up to `coarsest_up_to`.
    coarsest_up_to
        Largest mu_bar that the coarsest level survives.
    drawn
        Intervals of the runs whose shapes and tensions are drawn.
    beta
        Penalisation of (14).
    mu_bars
        Values at which resolutions are compared.
    """

    name: str
    vertical: float
    until: float
    amplitude: float
    step_ratio: float
    levels: tuple[int, ...]
    coarsest_up_to: float
    drawn: int
    beta: float
    mu_bars: tuple[float, ...]

    @property
    def angle(self) -> float:
        """theta_0 of the initial shape."""
        return pi - float(np.arctan2(1.0, self.vertical))

    @property
    def observe(self) -> float:
        """Interval between observables: the step of the coarsest level."""
        return self.step_ratio / self.levels[0]

    @property
    def last_frame(self) -> int:
        """The end of the runs, in frames after the vertical."""
        return round((self.until - self.vertical) / FRAME)

    def at(self, frames: ArrayLike) -> Array:
        """Return the times that lie `frames` frames of 0.512 after the vertical."""
        return self.vertical + FRAME * np.asarray(frames, dtype=float)

    def levels_for(self, mu_bar: float) -> tuple[int, ...]:
        """Return the levels that can be run at `mu_bar`."""
        return self.levels if mu_bar <= self.coarsest_up_to else self.levels[1:]


FULL = Tier(
    name="full",
    vertical=49.664,
    until=61.44,
    amplitude=-1e-4,
    step_ratio=1.28,
    levels=(50, 100, 200),
    coarsest_up_to=4e5,
    drawn=200,
    beta=20.0,
    mu_bars=(2e5, 3e5, 4e5),
)
"""The paper's runs: dt = 1.28 / N."""
QUICK = Tier(
    name="quick",
    vertical=9.728,
    until=19.456,
    amplitude=-1e-3,
    step_ratio=1.024,
    levels=(20, 40, 80),
    coarsest_up_to=2e5,
    drawn=40,
    beta=10.0,
    mu_bars=(2e5, 4e5),
)
"""A later start with a larger perturbation, on coarse grids: buckles alike, in seconds.

Its steps are larger than 2 / (3 beta), where the scheme turns unstable, at the paper's beta = 20.
"""


def tier(quick: bool) -> Tier:
    """Return the set of runs to use."""
    return QUICK if quick else FULL


@dataclass(frozen=True)
class BucklingRun:
    """One run of a nearly straight filament in unit shear.

    Attributes
    ----------
    tier
        What it shares with the others.
    mu_bar
        Effective viscosity (10).
    intervals
        N.
    beta
        Penalisation of (14), if not the tier's.
    mirrored
        Start from -x instead of x.
    """

    tier: Tier
    mu_bar: float
    intervals: int
    beta: float | None = None
    mirrored: bool = False

    @property
    def name(self) -> str:
        """Name of the run's store, without its suffix."""
        name = f"{self.tier.name}-mubar{self.mu_bar:.0f}-N{self.intervals}"
        name = f"{name}-beta{self.penalisation:g}"
        return f"{name}-mirrored" if self.mirrored else name

    @property
    def penalisation(self) -> float:
        """beta of (14)."""
        return self.tier.beta if self.beta is None else self.beta

    @property
    def until(self) -> float:
        """Time to stop."""
        return self.tier.until

    @property
    def schedule(self) -> Schedule:
        """What is recorded when."""
        return Schedule(POSITIONS_EVERY, self.tier.observe, checkpoint_every=20 * POSITIONS_EVERY)

    @property
    def initial(self) -> NearlyStraight:
        """The initial shape (47)."""
        if self.mirrored:
            return NearlyStraight(angle=self.tier.angle + pi, amplitude=-self.tier.amplitude)
        return NearlyStraight(angle=self.tier.angle, amplitude=self.tier.amplitude)

    @property
    def problem(self) -> Problem:
        """The problem to solve."""
        return Problem(
            Fiber(length=1.0, slenderness=EPS, rigidity=1.0),
            mu_bar=self.mu_bar,
            flow=Shear(rate=1.0),
            engine=PaperEngine(
                intervals=self.intervals,
                dt=self.tier.step_ratio / self.intervals,
                beta=self.penalisation,
            ),
        )
