"""Iterations of the sweeps (39) and of GMRES for the coupled tensions, by distance.

Filaments lie in planes d apart, all bent alike in shear and turned by an angle to and fro from one
to the next about their crossing points, which are one above the other: d is the smallest distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan, pi

import numpy as np
import xarray as xr
from numpy.polynomial import Polynomial

from stokesfibers.constraint.coupled import CoupledSystem, FixedPoint, Krylov, TensionError
from stokesfibers.constraint.suspension import own_systems
from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free
from stokesfibers.experiments.base import Progress
from stokesfibers.experiments.close_pair_curves import Filament
from stokesfibers.experiments.close_pair_velocity import blend_distance
from stokesfibers.flow import Shear
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.suspension import Interaction, Scene
from stokesfibers.summation.close_approach import PaperCloseApproach
from stokesfibers.summation.images import ImageSum

EPS = 1e-2
MU_BAR = 4e5
BETA = 20.0
SOLVERS = {"sweeps": FixedPoint(), "gmres": Krylov()}
"""As in a run: tolerance 1e-6, at most 100 sweeps or 200 steps."""
STARTS = ("zero", "isolated")
"""From no tension, as a run starts; from the tensions that each filament would have alone."""
_MIDDLE = 0.5
_BEND = 12.0
_RISE = Polynomial([0.0, 0.0, 0.0, 1.0 / 3.0, -1.0 / 2.0, 1.0 / 5.0])


@dataclass(frozen=True)
class Case:
    """How many filaments, and the angle between neighbours."""

    name: str
    count: int
    angle: float


CASES = (
    Case("2 crossing", 2, 1.0),
    Case("5 crossing", 5, 1.0),
    Case("2 nearly parallel", 2, 0.1),
    Case("5 nearly parallel", 5, 0.1),
)


def iterations(
    intervals: int, ratios: Sequence[float], progress: Progress | None = None
) -> xr.Dataset:
    """Return the iterations of both solvers and the errors of their tensions.

    Parameters
    ----------
    intervals
        N.
    ratios
        Distances over d_0 = max(h, 2 eps).
    progress
        Told after each case.

    Returns
    -------
    xr.Dataset
        ``iterations``, nan where a solver gave up, and ``tension_error``, the largest difference
        from the direct solution over its largest tension; both (case, start, solver, ratio).
    """
    d0 = blend_distance(EPS, intervals)
    fiber = discretised(intervals)
    found = np.full((2, len(CASES), len(STARTS), len(SOLVERS), len(ratios)), nan)
    for i, case in enumerate(CASES):
        if progress is not None:
            progress(f"tensions, {case.name}", i / len(CASES))
        for j, ratio in enumerate(ratios):
            system = assembled(case, fiber, ratio * d0)
            for k, start in enumerate((np.zeros_like(system.right), isolated(system))):
                found[:, i, k, :, j] = solved(system, start)
    dims = ("case", "start", "solver", "ratio")
    return xr.Dataset(
        {"iterations": (dims, found[0]), "tension_error": (dims, found[1])},
        coords={
            "case": [case.name for case in CASES],
            "start": list(STARTS),
            "solver": list(SOLVERS),
            "ratio": list(ratios),
        },
    )


def filaments(case: Case, distance: float) -> list[Filament]:
    """Return the filaments of a case, about the compressive axis of the shear."""

    def one(number: int) -> Filament:
        middle = 0.75 * pi + 0.5 * case.angle * (-1) ** number
        return Filament.build(
            lambda s: middle + _BEND * (_RISE(s) - _RISE(_MIDDLE)),
            np.zeros_like,
            _MIDDLE,
            number * distance,
        )

    return [one(number) for number in range(case.count)]


def discretised(intervals: int) -> DiscreteFiber:
    """Return the fiber of all cases on N intervals."""
    return DiscreteFiber.build(1.0, EPS, rigidity=1.0, intervals=intervals, mobility=NonLocal())


def assembled(case: Case, fiber: DiscreteFiber, distance: float) -> CoupledSystem:
    """Return the coupled tension equations (27) of a case in steady shear, as a run has them."""
    fibers = (fiber,) * case.count
    shapes = tuple(fiber.shape(f.sample(fiber.nodes).x) for f in filaments(case, distance))
    flow, workers = Shear(rate=1.0), Workers(1)
    stretching = np.stack(
        [np.einsum("in,nij,jn->n", s.xs, flow.gradient(s.x.T, 0.0), s.xs) for s in shapes]
    )
    own, right = own_systems(fibers, shapes, stretching, drag=MU_BAR, beta=BETA, workers=workers)
    interaction = Interaction.build(
        fibers, Free(), image_sum=ImageSum(), close_approach=PaperCloseApproach()
    )
    scene = Scene(interaction, shapes, workers)
    bending = scene.stretching(scene.integrated_force(None), scene.bending_value)
    return CoupledSystem(own, scene.influence(), right - bending[:, 1:-1])


def isolated(system: CoupledSystem) -> Array:
    """Return the tensions without any coupling, (fiber, m)."""
    tension = np.empty_like(system.right)
    tension[:] = np.linalg.solve(system.own, system.right[..., None])[..., 0]
    return tension


def direct(system: CoupledSystem) -> Array:
    """Return the tensions by one dense solve of everything, (fiber, m)."""
    count, m = system.right.shape
    whole = system.influence.copy()
    for k, own in enumerate(system.own):
        whole[k, :, k] += own
    size = count * m
    tension = np.empty(size)
    tension[:] = np.linalg.solve(whole.reshape(size, size), system.right.ravel())
    return tension.reshape(count, m)


def solved(system: CoupledSystem, start: Array) -> Array:
    """Return iterations and relative error of the solvers, (2, solver), nan where one gave up."""
    exact = direct(system)
    found = np.full((2, len(SOLVERS)), nan)
    for j, solver in enumerate(SOLVERS.values()):
        try:
            tension, count = solver.solve(system, start)
        except TensionError:
            continue
        found[:, j] = count, np.abs(tension - exact).max() / np.abs(exact).max()
    return found
