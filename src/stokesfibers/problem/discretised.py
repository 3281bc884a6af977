"""A problem on nodes: its fibers, the load on them, and how they act on each other.

The high-order engine, the health of a run and the fluid's velocity each take nodes and tolerances
of their own, so that they cannot share an error; what they make of them is the same.
"""

from __future__ import annotations

import numpy as np

from stokesfibers.core.arrays import Array, Positions
from stokesfibers.load import LoadedState
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.spectral import SpectralFiber, by_kind
from stokesfibers.slender.spectral_interaction import AbstractSpectralInteraction
from stokesfibers.slender.spectral_suspension import SpectralInteraction
from stokesfibers.summation import FastImages

SHOWN_PER_NODE = 4
"""Chebyshev points on which the high-order engine shows a fiber, per node."""


def spectral_fibers(problem: Problem, nodes: int) -> tuple[SpectralFiber, ...]:
    """Return all fibers in modes on `nodes` nodes; those of one kind are one object."""
    kinds = by_kind(problem.fibers, nodes, problem.mobility)
    return tuple(kinds[kind] for kind in problem.fibers)


def discrete_fibers(problem: Problem, intervals: int) -> tuple[DiscreteFiber, ...]:
    """Return all fibers on the paper's grid; those of one kind are one object."""
    kinds = {
        kind: DiscreteFiber.build(
            kind.length,
            kind.eps,
            rigidity=kind.rigidity,
            intervals=intervals,
            mobility=problem.mobility,
        )
        for kind in problem.kinds
    }
    return tuple(kinds[kind] for kind in problem.fibers)


def load_density(problem: Problem, points: Positions, weights: Array, t: float) -> Positions:
    """Return the external force per length at points (fiber, node, 3) at time t, alike.

    Parameters
    ----------
    problem
        Gives the load, the fibers' radii and the domain.
    points
        Of all fibers.
    weights
        Quadrature weights in arclength, (fiber, node).
    t
        Time.
    """
    radii = np.array([kind.eps * kind.length for kind in problem.fibers])
    return problem.load.density(LoadedState(points, weights, radii, problem.domain_at(t), t))


def spectral_interaction(
    problem: Problem,
    fibers: tuple[SpectralFiber, ...],
    tolerance: float,
    split: FastImages = FastImages(),  # noqa: B008 - frozen
) -> AbstractSpectralInteraction:
    """Return how fibers in modes act on each other in the problem's domain, by its kind of sum.

    Parameters
    ----------
    problem, fibers
        The case, and its fibers on nodes.
    tolerance
        Error of the velocities between fibers, relative to their size.
    split
        How a fast sum is split; its own tolerance is not read.

    Raises
    ------
    InputError
        If the tolerance is out of range, or a library for fast sums is missing.
    """
    if isinstance(problem.image_sum, FastImages):
        from stokesfibers.slender.spectral_ewald import EwaldInteraction  # slow to import

        return EwaldInteraction.build(
            fibers,
            problem.domain_at,
            close_approach=problem.close_approach,
            tolerance=tolerance,
            chosen=split,
        )
    return SpectralInteraction.build(
        fibers,
        problem.domain,
        image_sum=problem.image_sum,
        close_approach=problem.close_approach,
        tolerance=tolerance,
    )
