"""Doubtful choices: what a case may ask for, but should be asked back about.

Nothing here refuses; what cannot be solved at all is refused where it is read.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

import numpy as np

from stokesfibers.core.arrays import Positions
from stokesfibers.problem.engine import STEP_PER_SPACING
from stokesfibers.problem.groups import groups
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import NoRegularization
from stokesfibers.slender.spectrum import smallest_eigenvalue

LARGEST_CREDIBLE_SLENDERNESS = 0.05
"""Slender body theory has an error of order eps^2 log(1/eps); here it reaches a percent."""
PENALTY_LIMIT = 2.0 / 3.0
"""beta dt at which the penalisation becomes unstable.

Lengths relax as d(x_s . x_s)/dt = -2 beta (x_s . x_s - 1), which (28) extrapolates: its largest
root leaves the unit circle, at -1, where 2 beta dt = 4/3.
"""
INTERVALS_PER_WAVE = 16
"""Fewest intervals on the wave that grows fastest.

At mu_bar = 4e5, N = 50 has 14 and misses the integral of N_1 by 2 %; N = 100 misses it by 0.4 %.
"""
SMALL_EIGENVALUE = 0.2
"""Half of log(m^2 / e) for m = 2, what a regularisation as thick as the fiber keeps."""
_BYTES_PER_PAIR = 400  # all arrays of the size node x node, the largest being 3 node x 3 node
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Doubt:
    """A doubtful choice.

    Attributes
    ----------
    where
        Path in the case file.
    what
        What is doubtful.
    compared
        The numbers that say so.
    remedy
        What to try.
    """

    where: str
    what: str
    compared: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what} ({self.compared}). {self.remedy}"


@dataclass(frozen=True)
class Plan:
    """What is to be done with a problem, as far as doubts need it.

    Attributes
    ----------
    until
        Time to stop.
    positions_every, observables_every
        Recording intervals.
    positions
        Initial positions at the nodes, (fiber, node, space).
    """

    until: float
    positions_every: float
    observables_every: float
    positions: Positions


def doubts(problem: Problem, plan: Plan) -> tuple[Doubt, ...]:
    """Return everything doubtful about running `problem` as planned, worst first."""
    found = (
        *lost_positivity(problem),
        *bent_without_regularization(problem, plan),
        *unstable_penalty(problem),
        *large_step(problem),
        *few_intervals(problem, plan),
        *fine_grid(problem),
        *thick_fibers(problem),
        *large_memory(problem),
        *undivided_end(problem, plan),
        *rare_or_dense_records(problem, plan),
    )
    return tuple(dict.fromkeys(found))


def thick_fibers(problem: Problem) -> Iterator[Doubt]:
    """Doubt slender body theory for thick fibers."""
    for fiber in problem.kinds:
        if fiber.eps > LARGEST_CREDIBLE_SLENDERNESS:
            yield Doubt(
                "fiber.slenderness",
                "a thick fiber for slender body theory",
                f"eps = {fiber.eps:g}, credible below {LARGEST_CREDIBLE_SLENDERNESS:g}",
                "Expect errors of a percent and more from the theory itself.",
            )


def large_step(problem: Problem) -> Iterator[Doubt]:
    """Doubt a step above the ratio of the paper's runs, dt rate = 1.28 h / L."""
    rate, dt = problem.flow.rate_scale(), _dt(problem)
    if rate == 0.0:
        return
    paper = STEP_PER_SPACING / (problem.engine.intervals * rate)
    if dt > paper * (1.0 + _ROUNDING):
        yield Doubt(
            "stepping.dt",
            "a step larger than in the paper's runs, which may be unstable",
            f"dt = {dt:g}, 1.28 / (intervals x rate) = {paper:g}",
            f"Take dt = {paper:g} or less.",
        )


def unstable_penalty(problem: Problem) -> Iterator[Doubt]:
    """Doubt a penalisation that the step cannot follow."""
    beta, dt = problem.engine.beta, _dt(problem)
    assert beta is not None
    if beta * dt >= PENALTY_LIMIT:
        yield Doubt(
            "stepping.dt",
            "a step too large for the penalisation of lengths, which will be unstable",
            f"constraint.beta x dt = {beta * dt:.3g}, stable below 2/3",
            f"Take dt = {0.5 / beta:.3g} or less.",
        )


def few_intervals(problem: Problem, plan: Plan) -> Iterator[Doubt]:
    """Doubt a grid that does not resolve the wave that buckling makes."""
    for fiber in problem.kinds:
        found = groups(problem, fiber, plan.until)
        per_wave = problem.engine.intervals * found.wavelength
        if found.compression > 1.0 and per_wave < INTERVALS_PER_WAVE:
            needed = ceil(INTERVALS_PER_WAVE / found.wavelength)
            yield Doubt(
                "discretization.intervals",
                "few intervals for the wavelength at which this fiber buckles",
                f"{per_wave:.1f} intervals on a wave of {found.wavelength:.2g} L, "
                f"advised {INTERVALS_PER_WAVE}",
                f"Take {needed} intervals or more.",
            )


def fine_grid(problem: Problem) -> Iterator[Doubt]:
    """Doubt intervals shorter than the fiber is thick, below what the theory describes."""
    for fiber in problem.kinds:
        spacing = 1.0 / problem.engine.intervals
        if spacing < fiber.eps * (1.0 - _ROUNDING):
            yield Doubt(
                "discretization.intervals",
                "intervals shorter than the fiber's radius, which the theory does not resolve",
                f"h / L = {spacing:g}, eps = {fiber.eps:g}",
                f"Take {int(1.0 / fiber.eps)} intervals or fewer.",
            )


def lost_positivity(problem: Problem) -> Iterator[Doubt]:
    """Doubt a grid so fine that the finite-part operator loses its sign (errata on B.2)."""
    if not isinstance(problem.mobility, NonLocal):
        return
    for fiber in problem.kinds:
        weights = problem.mobility.weights(problem.engine.intervals, fiber.eps)
        smallest = smallest_eigenvalue(weights, fiber.eps)
        if smallest >= SMALL_EIGENVALUE:
            continue
        state = "has lost its positive sign" if smallest <= 0.0 else "is close to losing its sign"
        yield Doubt(
            "model.regularization",
            f"the regularised operator {state} on this grid",
            f"smallest eigenvalue {smallest:.2g} at {problem.engine.intervals} intervals, "
            f"credible above {SMALL_EIGENVALUE:g}",
            "Take kind = 'spheroidal', which keeps it at every resolution, or fewer intervals.",
        )


def bent_without_regularization(problem: Problem, plan: Plan) -> Iterator[Doubt]:
    """Doubt the unregularised operator for a shape that is not straight (B.1)."""
    mobility = problem.mobility
    if not isinstance(mobility, NonLocal):
        return
    bend = _largest_bend(plan.positions)
    if isinstance(mobility.regularization, NoRegularization) and bend > 1e-12:
        yield Doubt(
            "model.regularization",
            "no regularisation for a fiber that is not straight; the equations are ill posed",
            f"it leaves its chord by {bend:.2g} of its length",
            "Take kind = 'paper' or 'spheroidal', or initial.kind = 'straight'.",
        )


def large_memory(problem: Problem) -> Iterator[Doubt]:
    """Doubt a grid whose matrices do not fit this machine."""
    need, have = memory_bytes(problem), _physical_memory()
    if have is not None and need > 0.8 * have:
        yield Doubt(
            "discretization.intervals",
            "more memory needed than this machine can give",
            f"about {need / 2**30:.1f} GiB, it has {have / 2**30:.1f}",
            "Take fewer intervals or fewer fibers.",
        )


def memory_bytes(problem: Problem) -> int:
    """Return roughly how many bytes the arrays of a run take, without Python and libraries."""
    count, nodes = len(problem.fibers), problem.engine.intervals + 1
    own = len(problem.kinds) * _BYTES_PER_PAIR * nodes**2
    if count == 1 and not problem.domain.lengths.any():
        return own
    # systems and centreline matrices of each fiber, and the influence of all tensions on all
    return own + 8 * (4 * count * nodes**2 + (count * (nodes - 2)) ** 2)


def undivided_end(problem: Problem, plan: Plan) -> Iterator[Doubt]:
    """Doubt an end that is no multiple of the step: the run goes on to the next step."""
    steps = plan.until / _dt(problem)
    if abs(steps - round(steps)) > _ROUNDING * max(1.0, steps):
        yield Doubt(
            "stepping.until",
            "an end that is no multiple of the step",
            f"until = {plan.until:g}, dt = {_dt(problem):g}",
            f"The run will end at t = {ceil(steps) * _dt(problem):g}.",
        )


def rare_or_dense_records(problem: Problem, plan: Plan) -> Iterator[Doubt]:
    """Doubt recording intervals shorter than a step, or longer than the run."""
    dt = _dt(problem)
    for name in ("positions_every", "observables_every"):
        interval = getattr(plan, name)
        if interval < dt * (1.0 - _ROUNDING):
            yield Doubt(
                f"record.{name}",
                "a recording interval shorter than a step",
                f"{interval:g}, dt = {dt:g}",
                "Each step is recorded once, no more.",
            )
        if interval > plan.until * (1.0 + _ROUNDING):
            yield Doubt(
                f"record.{name}",
                "a recording interval longer than the run",
                f"{interval:g}, until = {plan.until:g}",
                "Nothing but the start will be recorded.",
            )


def _dt(problem: Problem) -> float:
    assert problem.engine.dt is not None
    return problem.engine.dt


def _largest_bend(positions: Positions) -> float:
    """Return how far fibers leave their chords, over the chord's length."""
    chord = positions[:, -1:] - positions[:, :1]
    length = np.linalg.norm(chord, axis=-1, keepdims=True)
    unit = chord / np.where(length > 0.0, length, 1.0)
    along = positions - positions[:, :1]
    across = along - np.sum(along * unit, axis=-1, keepdims=True) * unit
    return float(
        (np.linalg.norm(across, axis=-1, keepdims=True) / np.maximum(length, 1e-300)).max()
    )


def _physical_memory() -> int | None:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return None
