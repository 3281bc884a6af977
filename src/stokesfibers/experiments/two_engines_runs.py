"""Runs of `two_engines`: the suspension of Fig. 12 by the high-order engine; costs of steps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from time import process_time
from typing import ClassVar

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from stokesfibers.core.arrays import Array, Points, as_float
from stokesfibers.experiments import runs
from stokesfibers.experiments.oscillating import SuspensionRun
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.initial import AbstractInitial, given
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule
from stokesfibers.stepping.engines import stepper_of

SHAPES_EVERY = 1.28
_OBSERVE = 0.128
_SKIPPED, _TIMED = 4, 6  # the first steps after a start have no good guess of the tensions


@dataclass(frozen=True)
class Nudged(AbstractInitial):
    """Other initial shapes, each displaced and bent at random by a small distance.

    Attributes
    ----------
    of
        The shapes.
    by
        Largest displacement of a point.
    seed
        Of the random directions.
    """

    of: AbstractInitial
    by: float
    seed: int = 1
    kind: ClassVar[str] = "nudged"

    def curves(self, fibers: tuple[Fiber, ...], periods: Array) -> tuple[Curve, ...]:
        rng = np.random.default_rng((self.seed, 1))  # not the numbers of a suspension of that seed
        return tuple(self._nudged(curve, rng) for curve in self.of.curves(fibers, periods))

    def _nudged(self, curve: Curve, rng: np.random.Generator) -> Curve:
        """Return `curve` moved by half the distance and bent, across itself, by the other half."""
        first, last = curve.position(np.array([0.0, 1.0]))
        shift = _unit(rng.normal(size=3))
        bend = _unit(as_float(np.cross(last - first, rng.normal(size=3))))
        half = 0.5 * self.by

        def position(alpha: Array) -> Points:
            bump = 256.0 * (alpha * (1.0 - alpha)) ** 4
            return curve.position(alpha) + half * (shift + bump[:, None] * bend)

        def tangent(alpha: Array) -> Points:
            slope = 1024.0 * (alpha * (1.0 - alpha)) ** 3 * (1.0 - 2.0 * alpha)
            return curve.tangent(alpha) + half * slope[:, None] * bend

        return Curve(position, tangent)


def _unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector)


@dataclass(frozen=True)
class HighOrderRun:
    """A suspension by the high-order engine, with its own delta(s) and image sum.

    Attributes
    ----------
    suspension
        The run of the paper's scheme.
    rtol
        Tolerance.
    nudge
        Distance that the initial shapes are displaced by.
    """

    suspension: SuspensionRun
    rtol: float
    nudge: float = 0.0

    @property
    def name(self) -> str:
        """Name of the run's store, without its suffix."""
        nudge = f"-nudge{self.nudge:.0e}" if self.nudge else ""
        return f"{self.suspension.name}-spectral-rtol{self.rtol:.0e}{nudge}"

    @property
    def problem(self) -> Problem:
        """The problem to solve."""
        known = self.suspension.problem
        return Problem(
            known.fiber,
            mu_bar=known.mu_bar,
            flow=known.flow,
            domain=known.domain,
            engine=SpectralEngine(rtol=self.rtol),
        )

    @property
    def initial(self) -> AbstractInitial:
        """The same straight filaments."""
        straight = self.suspension.initial
        return Nudged(straight, self.nudge) if self.nudge else straight

    @property
    def until(self) -> float:
        """Time to stop."""
        return self.suspension.until

    @property
    def schedule(self) -> Schedule:
        """Observables as often as those of the paper's scheme, shapes at its nodes."""
        points = self.suspension.tier.intervals + 1
        return Schedule(SHAPES_EVERY, _OBSERVE, checkpoint_every=4 * SHAPES_EVERY, points=points)


def seconds(tree: xr.DataTree) -> float:
    """Return the wall time of all steps of a run [s], records and checks left out."""
    return float(tree["numerics"]["wall_time"].to_numpy().sum())


def processor_seconds(run: SuspensionRun | HighOrderRun, tree: xr.DataTree, moments: int) -> float:
    """Return the processor time [s] of all steps of a run on one thread, timed anew.

    A few steps from stored shapes at some moments stand for all that the run took around them, so
    that other work on the machine when the run was made does not count.

    Parameters
    ----------
    run, tree
        The run and what it stored.
    moments
        How many stored times, spread over the run.
    """
    trajectory, numerics = tree["trajectory"].to_dataset(), tree["numerics"].to_dataset().load()
    taken = numerics["time"].to_numpy()
    edges = np.linspace(0.0, run.until, moments + 1)
    total = 0.0
    with threadpool_limits(limits=1):
        for start, end in pairwise(edges):
            middle = 0.5 * (start + end)
            points = trajectory["position"].sel(time=middle, method="nearest").to_numpy()
            nodes = int(numerics["nodes"][np.searchsorted(taken, middle)]) if _adapts(run) else None
            each = _step_seconds(_given(run.problem, nodes), points)
            total += each * np.count_nonzero((taken > start) & (taken <= end))
    return total


def _adapts(run: SuspensionRun | HighOrderRun) -> bool:
    return isinstance(run.problem.engine, SpectralEngine)


def _given(problem: Problem, nodes: int | None) -> Problem:
    """Return the problem with a number of nodes that stays."""
    engine = problem.engine
    if nodes is None or not isinstance(engine, SpectralEngine):
        return problem
    return replace(problem, engine=replace(engine, nodes=nodes, adapt_nodes=False))


def _step_seconds(problem: Problem, points: Array) -> float:
    """Return the mean processor time [s] of a few steps from `points` (fiber, point, 3)."""
    stepper = stepper_of(problem, threads=1)
    carry = stepper.start(given(points, problem.fibers))
    for _ in range(_SKIPPED):
        carry, _ = stepper.step(carry)
    begun = process_time()
    for _ in range(_TIMED):
        carry, _ = stepper.step(carry)
    return (process_time() - begun) / _TIMED


def apart(one: xr.DataTree, other: xr.DataTree) -> tuple[Array, Array]:
    """Return the times of recorded shapes and the largest distance between two runs.

    Returns
    -------
    (time,), (time, fiber)
        Distances are between the same material points, largest over arclength.
    """
    times = one["trajectory"]["time"].to_numpy()
    every = [runs.frames(tree, times)["position"].to_numpy() for tree in (one, other)]
    return times, np.linalg.norm(every[0] - every[1], axis=-1).max(axis=-1)
