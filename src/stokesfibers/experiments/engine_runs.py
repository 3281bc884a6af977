"""Runs of the buckling filament by either engine and any regularisation, and what they cost.

Times are given in units of a bare one-thread LAPACK solve of the size of the paper's system at
N = 200, measured in the same process, so that they can be compared between machines.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter
from typing import ClassVar

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import StokesFibersError
from stokesfibers.experiments.tiers import EPS, POSITIONS_EVERY, BucklingRun, Tier
from stokesfibers.experiments.tolerance_cases import spatial
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.initial import AbstractInitial, NearlyStraight
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.problem.engine import PaperEngine, SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import simulate
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import AbstractRegularization, SpheroidalRegularization
from stokesfibers.stepping.engines import stepper_of

UNIT_SIZE = 603
"""3 (N + 1) for N = 200."""
_SOLVES = 15


@dataclass(frozen=True)
class Skewed(AbstractInitial):
    """The shape (47), bent out of the plane too, which leads to a run in three dimensions.

    Attributes
    ----------
    angle
        theta_0.
    amplitude
        d_y of (47).
    skew
        Deflection out of the plane, odd in s - L/2, over the one in it.
    """

    angle: float
    amplitude: float
    skew: float
    kind: ClassVar[str] = "skewed"

    def curves(self, fibers: tuple[Fiber, ...], periods: Array) -> tuple[Curve, ...]:  # noqa: ARG002
        bend = self.amplitude / 256.0
        return tuple(spatial(self.angle, bend, self.skew * bend)(fiber) for fiber in fibers)


@dataclass(frozen=True)
class EngineRun:
    """A run of the nearly straight filament of `tiers` by any engine.

    Attributes
    ----------
    tier
        Start, length and recording times.
    mu_bar
        Effective viscosity (10).
    engine
        Discretisation and time stepping.
    regularization
        delta(s).
    observe
        Interval between observables; that of the tier if None.
    skew
        Of the initial shape; 0 stays in the plane.
    """

    tier: Tier
    mu_bar: float
    engine: PaperEngine | SpectralEngine
    regularization: AbstractRegularization = field(default_factory=SpheroidalRegularization)
    observe: float | None = None
    skew: float = 0.0

    @property
    def name(self) -> str:
        """Name of the run's store, without its suffix."""
        engine = self.engine
        if isinstance(engine, PaperEngine):
            how = f"N{engine.intervals}"
        else:
            how = f"nodes{engine.nodes or 0}-rtol{engine.rtol or 0.0:.0e}"
        kind = self.regularization.kind
        name = f"{self.tier.name}-{engine.kind}-mubar{self.mu_bar:.0f}-{how}-{kind}"
        return f"{name}-skew{self.skew:g}" if self.skew else name

    @property
    def until(self) -> float:
        """Time to stop."""
        return self.tier.until

    @property
    def schedule(self) -> Schedule:
        """What is recorded when; at points that all grids of the tier share."""
        points = self.tier.levels[0] + 1 if isinstance(self.engine, SpectralEngine) else None
        every = self.tier.observe if self.observe is None else self.observe
        return Schedule(POSITIONS_EVERY, every, 20 * POSITIONS_EVERY, points)

    @property
    def initial(self) -> AbstractInitial:
        """The initial shape (47)."""
        if self.skew:
            return Skewed(self.tier.angle, self.tier.amplitude, self.skew)
        return NearlyStraight(angle=self.tier.angle, amplitude=self.tier.amplitude)

    @property
    def problem(self) -> Problem:
        """The problem to solve."""
        return Problem(
            Fiber(length=1.0, slenderness=EPS, rigidity=1.0),
            mu_bar=self.mu_bar,
            flow=Shear(rate=1.0),
            mobility=NonLocal(self.regularization),
            engine=self.engine,
        )


def paper_run(
    tier: Tier,
    mu_bar: float,
    intervals: int,
    *,
    regularization: AbstractRegularization,
    skew: float = 0.0,
) -> EngineRun | BucklingRun:
    """Return the run by the paper's scheme with a given delta(s); the figures' own if it is one."""
    figures = BucklingRun(tier, mu_bar, intervals)
    if regularization.kind == "paper" and not skew:
        return figures
    engine = figures.problem.engine
    assert isinstance(engine, PaperEngine)
    return EngineRun(tier, mu_bar, engine, regularization, skew=skew)


def shapes(tree: xr.DataTree, times: Array, points: int) -> Array:
    """Return the recorded centrelines at `times` and `points` equally spaced arclengths.

    Parameters
    ----------
    tree
        A run of one fiber.
    times : (time,)
        Each must have been recorded.
    points
        One of the recorded points must lie at each of these.

    Returns
    -------
    Array
        (time, point, 3).
    """
    trajectory = tree["trajectory"]
    stored = trajectory["time"].to_numpy()
    picked = [int(np.argmin(np.abs(stored - t))) for t in times]
    position = trajectory["position"].to_numpy()[picked, 0]
    step, rest = divmod(position.shape[1] - 1, points - 1)
    if rest or np.abs(stored[picked] - times).max() > 1e-6:
        raise StokesFibersError(f"a run has no records at {points} points and the times asked for")
    return position[:, ::step]


def largest_distance(one: Array, other: Array) -> float:
    """Return the largest distance between the same material points at the same times."""
    return float(np.linalg.norm(one - other, axis=-1).max())


@dataclass(frozen=True)
class Cost:
    """What a run without records costs on one thread, after compilation.

    Attributes
    ----------
    whole
        Wall time of all steps with the choice of nodes and all checks [s].
    formulas
        Wall time in the formulas of the steps alone, as in ``numerics/wall_time`` [s].
    steps
        Number of steps.
    rejected
        Number of steps that were tried again.
    nodes
        Nodes at the end, or intervals + 1.
    unit
        Smallest time of a bare solve right before and after, see `unit_times` [s].
    """

    whole: float
    formulas: float
    steps: int
    rejected: int
    nodes: int
    unit: float


def solved(run: EngineRun) -> xr.DataTree:
    """Return what `run` records, kept in memory."""
    problem = run.problem
    curves = run.initial.curves(problem.fibers, problem.domain.lengths)
    result = simulate(problem, curves, until=run.until, record=run.schedule, threads=1)
    if result.status.code == "interrupted":
        raise KeyboardInterrupt
    if not result.status.ok:
        raise StokesFibersError(f"run {run.name} failed: {result.status.explanation}")
    return result.data


def cost(run: EngineRun, repeats: int) -> Cost:
    """Return what `run` costs without records: the median of `repeats` runs, each in its unit.

    A slow spell of the machine slows a run and its unit alike.
    """
    found = sorted((_timed(run) for _ in range(repeats)), key=lambda one: one.formulas / one.unit)
    return found[repeats // 2]


def _timed(run: EngineRun) -> Cost:
    problem = run.problem
    curves = run.initial.curves(problem.fibers, problem.domain.lengths)
    reports, units = [], [unit_times()]
    with threadpool_limits(limits=1):
        stepper = stepper_of(problem, threads=1)
        carry = stepper.start(curves)
        begun = perf_counter()
        while not stepper.reached(carry, run.until):
            carry, report = stepper.step(carry)
            reports.append(report)
        whole = perf_counter() - begun
    formulas = sum(sum(report.wall_time) for report in reports)
    rejected = sum(report.rejected for report in reports)
    units.append(unit_times())
    unit = float(np.min(units))
    return Cost(whole, formulas, len(reports), rejected, reports[-1].nodes, unit)


def unit_times() -> Array:
    """Return times [s] of bare one-thread LAPACK solves of size `UNIT_SIZE`, (solve,)."""
    rng = np.random.default_rng(1)
    matrix, right = rng.normal(size=(UNIT_SIZE, UNIT_SIZE)), rng.normal(size=UNIT_SIZE)
    times = np.empty(_SOLVES)
    with threadpool_limits(limits=1):
        np.linalg.solve(matrix, right)
        for k in range(_SOLVES):
            begun = perf_counter()
            np.linalg.solve(matrix, right)
            times[k] = perf_counter() - begun
    return times
