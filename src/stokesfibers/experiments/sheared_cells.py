"""Suspensions in a sheared triply periodic cell: runs that studies share, and their stresses.

Stresses are per volume, over mu times the largest rate, 1: with n fibers of length L per volume a
dilute suspension has values proportional to n L^3. Fibers start isotropic, straight or slightly
bent, and keep apart by a steric repulsion.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.domain.sheared import Sheared
from stokesfibers.fiber.initial import AbstractInitial
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.fiber.suspension import Suspension
from stokesfibers.flow import AbstractFlow, Shear
from stokesfibers.load.steric import StericRepulsion
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule
from stokesfibers.slender.mobility import slenderness_constant

EPS = 1e-2
RTOL = 1e-3
_RANGE = 0.03  # of the repulsion, in lengths
_GAP = 0.04  # between the fibers at the start, in lengths
NAMES = ("viscosity", "n1", "n2")
"""Specific viscosity, N_1 and N_2 per volume over mu rate."""


@dataclass(frozen=True)
class CellRun:
    """A suspension in a cube that is sheared at a rate of at most 1.

    Attributes
    ----------
    label
        What it is called among its like; part of the name of its store.
    fibers
        The groups; their lengths average to 1.
    mu_bar
        8 pi mu rate over E of a fiber of length 1.
    concentration
        n L^3, n the number of fibers per volume and L = 1.
    seed
        Of places and orientations.
    until
        Time at the end, the strain of a steady shear.
    flow
        A shear U = (rate(t) y, 0, 0).
    amplitude
        d_y of (47): largest deflection at the start, times 256.
    every
        Time between observables.
    """

    label: str
    fibers: tuple[Fiber, ...]
    mu_bar: float
    concentration: float
    seed: int
    until: float
    flow: AbstractFlow = field(default_factory=Shear)
    amplitude: float = 0.0
    every: float = 0.05

    @property
    def name(self) -> str:
        """Name of the run's store, without its suffix."""
        what = f"{self.label}-mubar{self.mu_bar:g}-nl3_{self.concentration:g}"
        return f"{what}-{self.count}-seed{self.seed}-{self.until:g}"

    @property
    def count(self) -> int:
        """Number of fibers."""
        return sum(group.count for group in self.fibers)

    @property
    def side(self) -> float:
        """Length of the cell."""
        return (self.count / self.concentration) ** (1.0 / 3.0)

    @property
    def problem(self) -> Problem:
        """The problem to solve."""
        return Problem(
            self.fibers,
            viscosity=self.mu_bar / (8.0 * pi),
            flow=self.flow,
            domain=Sheared((self.side, self.side, self.side)),
            load=StericRepulsion(strength=self.mu_bar, range=_RANGE),
            engine=SpectralEngine(rtol=RTOL),
        )

    @property
    def initial(self) -> AbstractInitial:
        """Fibers anywhere, isotropic."""
        return Suspension(seed=self.seed, least_gap=_GAP, amplitude=self.amplitude)

    @property
    def schedule(self) -> Schedule:
        """What is recorded when."""
        return Schedule(10.0 * self.every, self.every, 20.0 * self.every)


def uniform(count: int) -> tuple[Fiber, ...]:
    """Return a group of `count` fibers of length 1."""
    return (Fiber(length=1.0, slenderness=EPS, count=count),)


def stresses(tree: xr.DataTree, run: CellRun) -> tuple[Array, Array]:
    """Return times (time,) and specific viscosity, N_1 and N_2 over mu rate, (3, time)."""
    observed = tree["observables"].to_dataset()
    p = observed["particle_stress"].to_numpy() / (run.mu_bar / (8.0 * pi))
    values = p[:, 0, 1], p[:, 0, 0] - p[:, 1, 1], p[:, 1, 1] - p[:, 2, 2]
    return observed["time"].to_numpy(), np.stack(values)


def dilute_stress(tree: xr.DataTree, run: CellRun, times: Array) -> Array:
    """Return the stresses at `times` of straight fibers that do not feel each other, (3, time).

    They start in the directions that the run's fibers have, and turn as material lines do. Each
    gives ``8 pi mu L^3 / (24 (c - 2)) (p . E p) p p``, p its direction, E the rate of strain and
    c = -log(eps^2 e): a straight fiber's force is linear in s.
    """
    x = tree["trajectory"]["position"].isel(time=0).to_numpy()
    apart = x[:, -1] - x[:, 0]
    length = np.linalg.norm(apart, axis=1)
    eps = np.array([group.eps for group in run.fibers for _ in range(group.count)])
    c = -np.array([slenderness_constant(e) for e in eps]) - 2.0
    size = 8.0 * pi * length**3 / (24.0 * c) / run.side**3
    rate = np.array([run.flow.gradient(np.zeros(3), t)[0, 1] for t in times])
    p = np.repeat((apart / length[:, None])[None], len(times), axis=0)
    p[..., 0] += np.array([run.flow.strain(t) for t in times])[:, None] * p[..., 1]
    x, y, z = np.moveaxis(p / np.linalg.norm(p, axis=-1, keepdims=True), -1, 0)
    pull = size * x * y * rate[:, None]
    return np.stack(
        [
            np.sum(pull * x * y, axis=-1),
            np.sum(pull * (x**2 - y**2), axis=-1),
            np.sum(pull * (y**2 - z**2), axis=-1),
        ]
    )
