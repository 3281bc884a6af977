"""Doubtful choices of one engine or another: its step, its grid, its constraint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import ceil

from stokesfibers.constraint.coupled import FixedPoint
from stokesfibers.problem.doubt import Doubt, Plan
from stokesfibers.problem.engine import STEP_PER_SPACING, PaperEngine, SpectralEngine
from stokesfibers.problem.groups import groups
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.spectrum import smallest_eigenvalue

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
_ROUNDING = 1e-9


def engine_doubts(problem: Problem, plan: Plan) -> Iterator[Doubt]:
    """Return the doubts about the problem's engine, worst first."""
    yield from lost_positivity(problem)
    yield from unstable_penalty(problem)
    yield from large_step(problem)
    yield from few_intervals(problem, plan)
    yield from few_nodes(problem)
    yield from fine_grid(problem)
    yield from undivided_end(problem, plan)
    yield from tension_solver_without_effect(problem)


def lost_positivity(problem: Problem) -> Iterator[Doubt]:
    """Doubt a grid so fine that the finite-part operator loses its sign (errata on B.2)."""
    engine, mobility = problem.engine, problem.mobility
    if not isinstance(mobility, NonLocal) or not isinstance(engine, PaperEngine):
        return
    for fiber in problem.kinds:
        weights = mobility.weights(engine.intervals, fiber.eps)
        smallest = smallest_eigenvalue(weights, fiber.eps)
        if smallest >= SMALL_EIGENVALUE:
            continue
        state = "has lost its positive sign" if smallest <= 0.0 else "is close to losing its sign"
        yield Doubt(
            "model.regularization",
            f"the regularised operator {state} on this grid",
            f"smallest eigenvalue {smallest:.2g} at {engine.intervals} intervals, "
            f"credible above {SMALL_EIGENVALUE:g}",
            "Take kind = 'spheroidal', which keeps it at every resolution, or fewer intervals.",
        )


def tension_solver_without_effect(problem: Problem) -> Iterator[Doubt]:
    """Doubt a solver of coupled tensions beside the spectral engine, which has its own."""
    if isinstance(problem.engine, SpectralEngine) and problem.tension_solver != FixedPoint():
        yield Doubt(
            "constraint.solver",
            "no effect: the spectral engine solves for tensions and velocities together",
            f"{problem.tension_solver.kind}, with engine = 'spectral'",
            "Leave [constraint] out, or take engine = 'paper'.",
        )


def unstable_penalty(problem: Problem) -> Iterator[Doubt]:
    """Doubt a penalisation that the step cannot follow."""
    if not isinstance(problem.engine, PaperEngine):
        return
    dt = _dt(problem.engine)
    beta = problem.engine.beta or 0.0
    if beta * dt >= PENALTY_LIMIT:
        yield Doubt(
            "stepping.dt",
            "a step too large for the penalisation of lengths, which will be unstable",
            f"constraint.beta x dt = {beta * dt:.3g}, stable below 2/3",
            f"Take dt = {0.5 / beta:.3g} or less.",
        )


def large_step(problem: Problem) -> Iterator[Doubt]:
    """Doubt a step above the ratio of the paper's runs, dt rate = 1.28 h / L."""
    rate, engine = problem.flow.rate_scale(), problem.engine
    if rate == 0.0 or not isinstance(engine, PaperEngine):
        return
    dt, paper = _dt(engine), STEP_PER_SPACING / (engine.intervals * rate)
    if dt > paper * (1.0 + _ROUNDING):
        yield Doubt(
            "stepping.dt",
            "a step larger than in the paper's runs, which may be unstable",
            f"dt = {dt:g}, 1.28 / (intervals x rate) = {paper:g}",
            f"Take dt = {paper:g} or less.",
        )


def few_intervals(problem: Problem, plan: Plan) -> Iterator[Doubt]:
    """Doubt a grid that does not resolve the wave that buckling makes."""
    engine = problem.engine
    if not isinstance(engine, PaperEngine):
        return
    for fiber in problem.kinds:
        found = groups(problem, fiber, plan.until)
        per_wave = engine.intervals * found.wavelength
        if found.compression > 1.0 and per_wave < INTERVALS_PER_WAVE:
            needed = ceil(INTERVALS_PER_WAVE / found.wavelength)
            yield Doubt(
                "discretization.intervals",
                "few intervals for the wavelength at which this fiber buckles",
                f"{per_wave:.1f} intervals on a wave of {found.wavelength:.2g} L, "
                f"advised {INTERVALS_PER_WAVE}",
                f"Take {needed} intervals or more.",
            )


def few_nodes(problem: Problem) -> Iterator[Doubt]:
    """Doubt fewer nodes than fibers need that buckle at this effective viscosity."""
    engine = problem.engine
    if not isinstance(engine, SpectralEngine) or engine.adapt_nodes or engine.nodes is None:
        return
    rate = problem.flow.rate_scale()
    advised = replace(problem, engine=replace(engine, nodes=None)).engine
    assert isinstance(advised, SpectralEngine)
    assert advised.nodes is not None
    if rate > 0.0 and engine.nodes < advised.nodes:
        yield Doubt(
            "discretization.nodes",
            "fewer nodes than buckling fibers need at this effective viscosity and tolerance",
            f"{engine.nodes} nodes, advised {advised.nodes}",
            "Leave nodes out, or set adapt_nodes = true.",
        )


def fine_grid(problem: Problem) -> Iterator[Doubt]:
    """Doubt intervals shorter than the fiber is thick, below what the theory describes."""
    engine = problem.engine
    if not isinstance(engine, PaperEngine):
        return
    for fiber in problem.kinds:
        spacing = 1.0 / engine.intervals
        if spacing < fiber.eps * (1.0 - _ROUNDING):
            yield Doubt(
                "discretization.intervals",
                "intervals shorter than the fiber's radius, which the theory does not resolve",
                f"h / L = {spacing:g}, eps = {fiber.eps:g}",
                f"Take {int(1.0 / fiber.eps)} intervals or fewer.",
            )


def undivided_end(problem: Problem, plan: Plan) -> Iterator[Doubt]:
    """Doubt an end that is no multiple of the step: the run goes on to the next step."""
    if not isinstance(problem.engine, PaperEngine):
        return
    dt = _dt(problem.engine)
    steps = plan.until / dt
    if abs(steps - round(steps)) > _ROUNDING * max(1.0, steps):
        yield Doubt(
            "stepping.until",
            "an end that is no multiple of the step",
            f"until = {plan.until:g}, dt = {dt:g}",
            f"The run will end at t = {ceil(steps) * dt:g}.",
        )


def _dt(engine: PaperEngine) -> float:
    assert engine.dt is not None
    return engine.dt
