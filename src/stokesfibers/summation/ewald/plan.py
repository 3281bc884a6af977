"""The Ewald sum behind the plan/execute interface: geometry once, then a sum per set of forces."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, as_float
from stokesfibers.core.errors import InputError
from stokesfibers.core.parallel import Workers
from stokesfibers.domain.domains import AbstractDomain
from stokesfibers.summation.ewald import cost
from stokesfibers.summation.ewald.accuracy import LEAST_TOLERANCE, bandwidth_for, check_tolerance
from stokesfibers.summation.ewald.cloud import Cloud, gather
from stokesfibers.summation.ewald.far import FarPart
from stokesfibers.summation.ewald.near import NearPart, make_lists
from stokesfibers.summation.ewald.near_polynomial import fit
from stokesfibers.summation.ewald.own import OwnPart
from stokesfibers.summation.ewald.split import Split

FEW = 1000.0
"""Clouds of fewer sources are summed more accurately than the estimate for random ones asks."""


@dataclass(frozen=True)
class Choice:
    """What the tolerance led to.

    Attributes
    ----------
    split
        Mollifier with its cut-offs rc and k_max.
    modes, lengths
        Of the Fourier box along x, y, z.
    degree, precision
        Of the near polynomials.
    pairs
        Pairs the near part runs over.
    transform_error
        What the NUFFT is asked for.
    """

    split: Split
    modes: tuple[int, int, int]
    lengths: tuple[float, float, float]
    degree: int
    precision: str
    pairs: int
    transform_error: float


@dataclass(frozen=True)
class EwaldSum:
    """How to sum Stokeslets and doublets over all sources and their images.

    Attributes
    ----------
    tolerance
        Relative rms error of the velocity, from 1e-12 to 0.1. All else follows from it.
    split
        ``"prolate"``, or ``"gaussian"`` for Hasimoto's, dearer by half and there to compare.
    rc
        Cut-off of the near part, in units of length; None for the cheapest.
    bandwidth
        ``K rc``; None for the least that meets the tolerance.
    """

    tolerance: float = 1e-6
    split: str = "prolate"
    rc: float | None = None
    bandwidth: float | None = None

    def __post_init__(self) -> None:
        check_tolerance(checks.positive("tolerance", self.tolerance))
        bandwidth_for(self.split, 1e-3)
        for name in ("rc", "bandwidth"):
            if getattr(self, name) is not None:
                checks.positive(name, getattr(self, name))

    def plan(
        self,
        domain: AbstractDomain,
        sources: Array,
        targets: Array | None = None,
        *,
        filaments: object | None = None,
        target_filaments: object | None = None,
        radius: float | Array = 0.0,
        workers: Workers | None = None,
    ) -> Plan:
        """Return a plan that sums over `sources` at `targets`.

        Parameters
        ----------
        domain
            Free, periodic in one to three directions, or sheared.
        sources
            Positions, (n, 3), unwrapped: points of a filament on both sides of a border are as
            they follow each other in space.
        targets
            Positions, (m, 3); None for the sources.
        filaments
            Whole number of the filament of each source, (n,); -1 for a point of its own. Pairs of
            one filament in the same image are left out, the point itself among them.
        target_filaments
            The same for targets that are not sources, (m,); -1 leaves nothing out.
        radius
            a of the doublets ``(a^2/2) D``, one or one per source, (n,); 0 for none.
        workers
            Threads and ranks; a pool of all cores if None. All ranks must then plan and execute
            together, with the same points and forces; each gets the whole result, with the bits
            that one rank would find.

        Raises
        ------
        InputError
            If shapes are wrong, values not finite, or rc cannot be.
        MissingExtraError
            If the NUFFT library is not installed.
        """
        cloud = gather(
            domain, sources, targets, filaments=filaments, target_filaments=target_filaments
        )
        return Plan(self, cloud, _radii(radius, len(cloud.sources)), workers or Workers())

    def chosen(self, cloud: Cloud, radius: float) -> tuple[Split, float]:
        """Return the split for a cloud and about how many pairs are near."""
        unit = self._unit(cloud, 0.0)
        rc = self.rc or cost.cheapest(cloud, unit).rc
        for _ in range(2 if radius > 0.0 else 0):
            # the doublet's spectrum is larger by a^2 k^2 / 4 where the split cuts it
            unit = self._unit(cloud, radius / rc)
            rc = self.rc or cost.cheapest(cloud, unit).rc
        cost.check_cutoff(cloud, rc)
        return cost.scaled(unit, rc), cost.near_pairs(cloud, rc)

    def _unit(self, cloud: Cloud, radius: float) -> Split:
        """Return the split for rc = 1, with `radius` in units of rc."""
        width = self.bandwidth
        if width is None:
            # a few points are no random cloud: what each does to itself is not averaged out
            goal = self.tolerance * min(1.0, np.sqrt(len(cloud.sources) / FEW))
            width = bandwidth_for(self.split, max(LEAST_TOLERANCE, goal))
            if radius > 0.0:
                goal /= 1.0 + (0.5 * radius * width) ** 2
                width = bandwidth_for(self.split, max(LEAST_TOLERANCE, goal))
        return Split(self.split, self.tolerance, 1.0, width)


def _three(values: NDArray, kind: type) -> tuple:
    return tuple(kind(v) for v in values)


def _radii(radius: float | Array, count: int) -> Array:
    values = as_float(np.atleast_1d(radius))
    if values.shape not in ((1,), (count,)) or values.ndim != 1:
        raise InputError("radius", f"one radius or {count}", f"shape {values.shape}")
    if not np.all(np.isfinite(values) & (values >= 0.0)):
        raise InputError("radius", "finite numbers, zero or above", values.tolist()[:5])
    if values.size > 1 and np.all(values == values[0]):
        values = values[:1]
    return values


class Plan:
    """Sums over one set of points, for as many sets of forces as needed. Not for several callers.

    Attributes
    ----------
    choice
        What was chosen; None if there is nothing to sum.
    seconds
        Time of the last sum by stage: load, spread, multiply, collect (near part in the first and
        the last), and of making the plan.
    """

    def __init__(self, ewald: EwaldSum, cloud: Cloud, radius: Array, workers: Workers) -> None:
        started = perf_counter()
        self._workers = workers
        self._shape = cloud.sources.shape
        self._targets = len(cloud.targets)
        self.choice: Choice | None = None
        self.seconds: dict[str, float] = {}
        if not self._targets or not len(cloud.sources):
            return
        split, pairs = ewald.chosen(cloud, float(radius.max()))
        polynomials = fit(split)
        team = workers.team
        shares = cost.near_shares(cloud, split, team.size)
        lists = make_lists(cloud, split.rc, pairs, workers=workers, shares=shares)
        self._source_order, self._order = lists.order, lists.target_order
        self._near = NearPart(cloud, lists, polynomials, radius=radius, team=team)
        self._own = OwnPart(cloud, polynomials, radius=radius, team=team, shares=shares)
        orders = (lists.order, lists.target_order)
        self._far = FarPart(cloud, orders, split, radius=radius, workers=workers)
        box = self._far.box
        self.choice = Choice(
            split,
            _three(box.modes, int),
            _three(box.lengths, float),
            polynomials.degree,
            polynomials.precision,
            lists.pairs,
            self._far.error,
        )
        self.seconds["plan"] = perf_counter() - started

    def execute(self, forces: Array) -> Array:
        """Return 8 pi mu times the velocity at the targets, (m, 3), by forces (n, 3).

        Without free directions the mean flow is zero. See `FarBox` for what a net force does.

        Raises
        ------
        InputError
            If the shape is wrong or a force is not finite.
        """
        forces = self._checked(forces)
        out = np.zeros((self._targets, 3))
        largest = float(np.abs(forces).max(initial=0.0))
        if self.choice is None or largest == 0.0:
            return out
        # a power of two, so that nothing is rounded
        unit = 2.0 ** np.ceil(np.log2(largest))
        scaled = forces / unit
        near, far, own = self._near, self._far, self._own
        early = near.tasks // 2

        def first(k: int) -> None:
            far.spread(k) if k < far.spreads else near.run(k - far.spreads)

        def last(k: int) -> None:
            if k < far.collects:
                far.collect(k)
            elif k - far.collects < near.tasks - early:
                near.run(early + k - far.collects)
            else:
                own.run(k - far.collects - (near.tasks - early), out)

        clock = [perf_counter()]

        def stage(name: str) -> None:
            clock.append(perf_counter())
            self.seconds[name] = clock[-1] - clock[-2]

        in_order = scaled[self._source_order]
        near.load(in_order)
        far.load(in_order)
        own.load(scaled)
        stage("load")
        self._workers.for_each(far.spreads + early, first)
        far.exchange()
        stage("spread")
        self._workers.for_each(far.planes, far.multiply)
        stage("multiply")
        self._workers.for_each(far.collects + near.tasks - early + own.tasks, last)
        stage("collect")
        own.complete(out)
        total = far.result()
        total += near.result()
        out[self._order] += total
        out *= unit
        stage("unsort")
        return out

    def _checked(self, forces: Array) -> Array:
        forces = as_float(forces)
        if forces.shape != self._shape:
            raise InputError("forces", f"shape {self._shape}", f"shape {forces.shape}")
        if not np.isfinite(forces).all():
            bad = int(np.flatnonzero(~np.isfinite(forces).all(axis=1))[0])
            raise InputError(f"forces[{bad}]", "finite numbers", forces[bad].tolist())
        return forces
