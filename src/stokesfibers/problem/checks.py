"""Doubtful choices: what a case may ask for, but should be asked back about.

Nothing here refuses; what cannot be solved at all is refused where it is read.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from math import pi, radians

import numpy as np

from stokesfibers.core.arrays import Positions
from stokesfibers.load import NoLoad
from stokesfibers.problem.doubt import Doubt, Plan
from stokesfibers.problem.engine import PaperEngine, SpectralEngine
from stokesfibers.problem.engine_checks import engine_doubts
from stokesfibers.problem.groups import crowding
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import NoRegularization

LARGEST_CREDIBLE_SLENDERNESS = 0.05
"""Slender body theory has an error of order eps^2 log(1/eps); here it reaches a percent."""
LARGEST_CREDIBLE_CONTACTS = 1.0
"""n L^2 d from which on a suspension of rods is called concentrated."""
LEAST_ACROSS = 0.25
"""Share of a bend along y that is across the fiber, below which less is bent than was asked for."""
_BYTES_PER_PAIR = 400  # all arrays of the size node x node, the largest being 3 node x 3 node
_ROUNDING = 1e-9


def doubts(problem: Problem, plan: Plan) -> tuple[Doubt, ...]:
    """Return everything doubtful about running `problem` as planned, worst first."""
    found = (
        *bent_without_regularization(problem, plan),
        *engine_doubts(problem, plan),
        *angle_in_degrees(plan),
        *bend_along_the_fiber(plan),
        *rigidity_without_effect(problem),
        *thick_fibers(problem),
        *crowded_cell(problem),
        *large_memory(problem),
        *rare_or_dense_records(problem, plan),
    )
    return tuple(dict.fromkeys(found))


def angle_in_degrees(plan: Plan) -> Iterator[Doubt]:
    """Doubt an initial angle of more than a turn: it was likely meant in degrees."""
    for name, angle in (("angle", plan.angle), ("tilt", plan.tilt)):
        if abs(angle) > 2.0 * pi:
            yield Doubt(
                f"initial.{name}",
                "more than a whole turn; angles are in radians",
                f"{angle:g}, a turn is {2.0 * pi:.4g}",
                f"If degrees were meant, {angle:g} of them are {radians(angle):.6g}.",
            )


def bend_along_the_fiber(plan: Plan) -> Iterator[Doubt]:
    """Doubt a fiber that is to bend in the direction in which it lies."""
    if plan.across < LEAST_ACROSS:
        yield Doubt(
            "initial.amplitude",
            "a bend along y of a fiber that lies nearly along y",
            f"{plan.across:.2g} of the bend is across the fiber",
            "Lay the fiber nearer to x and turn the flow, or take a larger amplitude.",
        )


def rigidity_without_effect(problem: Problem) -> Iterator[Doubt]:
    """Doubt a rigidity beside mu_bar, which holds it: all forces only scale with it."""
    rigidities = {kind.rigidity for kind in problem.kinds}
    plain = isinstance(problem.load, NoLoad) and problem.viscosity is None
    if plain and len(rigidities) == 1 and rigidities != {1.0}:
        yield Doubt(
            "fiber.rigidity",
            "no effect on the motion: mu_bar = 8 pi mu rate L^4 / E holds it",
            f"{rigidities.pop():g} for all fibers, with fluid.mu_bar",
            "Change fluid.mu_bar, or give fluid.viscosity instead.",
        )


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


def crowded_cell(problem: Problem) -> Iterator[Doubt]:
    """Doubt a suspension in which contacts govern: lubrication and friction are not modelled."""
    crowd = crowding(problem)
    if crowd is not None and crowd.contacts > LARGEST_CREDIBLE_CONTACTS:
        yield Doubt(
            "domain.periods",
            "a cell so full that contacts govern, which are not modelled",
            f"n L^2 d = {crowd.contacts:.3g}, below 1 rods can keep apart",
            "Take a larger cell, fewer or thinner fibers.",
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
    grid = "intervals" if isinstance(problem.engine, PaperEngine) else "nodes"
    if have is not None and need > 0.8 * have:
        yield Doubt(
            f"discretization.{grid}",
            "more memory needed than this machine can give",
            f"about {need / 2**30:.1f} GiB, it has {have / 2**30:.1f}",
            f"Take fewer {grid} or fewer fibers.",
        )


def memory_bytes(problem: Problem) -> int:
    """Return roughly how many bytes the arrays of a run take, without Python and libraries."""
    count, nodes = len(problem.fibers), problem.engine.samples
    if isinstance(problem.engine, SpectralEngine):  # nothing is held for pairs of fibers
        return count * _BYTES_PER_PAIR * (problem.engine.nodes or nodes) ** 2
    own = len(problem.kinds) * _BYTES_PER_PAIR * nodes**2
    if count == 1 and not problem.domain.lengths.any():
        return own
    # systems and centreline matrices of each fiber, and the influence of all tensions on all
    return own + 8 * (4 * count * nodes**2 + (count * (nodes - 2)) ** 2)


def rare_or_dense_records(problem: Problem, plan: Plan) -> Iterator[Doubt]:
    """Doubt recording intervals shorter than a step, or longer than the run."""
    dt = problem.engine.dt if isinstance(problem.engine, PaperEngine) else None
    for name in ("positions_every", "observables_every"):
        interval = getattr(plan, name)
        if dt is not None and interval < dt * (1.0 - _ROUNDING):
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
