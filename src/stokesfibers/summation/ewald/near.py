"""The near part: cells, lists of what is near each group of targets, and the sum over them.

Targets of one cell form groups. Each has a list of all sources within rc of its box, images
included, made once; every sum gathers them into a private buffer and runs over it once per target.
Memory is linear in the number of points: about 90 list entries for each.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.core.team import AbstractTeam
from stokesfibers.kernels import ewald as kernels
from stokesfibers.summation.ewald.cloud import IMAGES, Cloud, Integers
from stokesfibers.summation.ewald.near_polynomial import BLOCK, NearPolynomials

SIDES = (1.0 / 3.0, 0.5, 0.75, 1.0)
"""Sides of cells over rc; the cheapest is taken."""
PAIR_COST, GATHER_COST = 1.7, 7.0
"""Of a pair in the loop and of a source put into the buffer; their ratio matters."""
MOST_PER_GROUP = 64
CELLS_PER_POINT = 4
CHUNKS = 48
"""Tasks the near part is cut into; results do not depend on it."""


@dataclass(frozen=True, eq=False)
class NearLists:
    """What is near each group of targets.

    Attributes
    ----------
    order, target_order
        Of sources and targets by cell.
    bounds, boxes
        Of the groups: (group + 1,) in the sorted targets, (group, 6).
    lists
        (heads, index, runs, codes, most) of `kernels.ewald.near_single`, for this rank's groups.
    edges
        Bounds of chunks of like work of this rank's groups.
    rows
        Bounds of each rank's targets, sorted, (rank + 1,).
    pairs
        Number of pairs the loop runs over, on all ranks.
    """

    order: Integers
    target_order: Integers
    bounds: Integers
    boxes: Array
    lists: tuple
    edges: Integers
    rows: Integers
    pairs: int

    @property
    def chunks(self) -> int:
        return len(self.edges) - 1

    @property
    def entries(self) -> int:
        """Number of entries of this rank's lists."""
        return len(self.lists[1])


def _grid(cloud: Cloud, rc: float, near_pairs: float) -> tuple[Array, Array, Integers]:
    """Return origin, sides and counts of the cells."""
    low, high = cloud.bounds
    periodic = cloud.lattice.periodic
    origin = np.where(periodic, 0.0, low)
    extent = np.where(periodic, cloud.lattice.periods, high - low)
    extent = np.maximum(extent, 1e-3 * rc)
    points = max(len(cloud.sources), len(cloud.targets))
    density = near_pairs / points / (4.0 / 3.0 * np.pi)
    side = rc * min(SIDES, key=lambda v: _work(v, density))
    counts = np.maximum(1, np.floor(extent / side)).astype(np.int64)
    while counts.prod() > CELLS_PER_POINT * points + 64:
        counts = np.maximum(1, counts * 4 // 5)
    return origin, extent / counts, counts


def _work(side: float, density: float) -> float:
    """Return the cost per target for cells of `side` rc, with `density` points in rc^3."""
    # the box of the cell and all within rc of it
    volume = side**3 + 6.0 * side**2 + 3.0 * np.pi * side + 4.0 / 3.0 * np.pi
    return volume * (PAIR_COST * density + GATHER_COST / side**3)


def cut(weights: Array, shares: Array) -> Integers:
    """Return bounds that cut weights into runs whose sums are as `shares`, (share + 1,)."""
    total = np.concatenate([[0.0], np.cumsum(weights)])
    reached = np.concatenate([[0.0], np.cumsum(shares)])
    edges = np.searchsorted(total, total[-1] * reached / reached[-1])
    edges[0], edges[-1] = 0, len(weights)
    return edges


def chunks(weights: Array, edges: Integers, rank: int, count: int) -> Integers:
    """Return bounds of at most `count` runs of like sum of a rank's weights."""
    own = slice(edges[rank], edges[rank + 1])
    return edges[rank] + np.unique(cut(weights[own], np.ones(count)))


def _sorted(points: Array, grid: tuple) -> tuple[Integers, Integers, Array]:
    """Return the order of points (3, n) by cell, where each cell starts, and the sorted points."""
    order, start = kernels.sort_into_cells(points, *grid)
    return order, start, np.ascontiguousarray(points[:, order])


def make_lists(
    cloud: Cloud, rc: float, near_pairs: float, *, workers: Workers, shares: Array
) -> NearLists:
    """Return the near lists of a cloud.

    Parameters
    ----------
    cloud, rc
        Sources and targets; the cut-off.
    near_pairs
        About how many pairs are near.
    workers
        Threads and ranks.
    shares
        Of the work, by rank.
    """
    grid = _grid(cloud, rc, near_pairs)
    order, start, points = _sorted(cloud.inside, grid)
    same = cloud.target_inside is cloud.inside
    target_order, target_start, targets = (
        (order, start, points) if same else _sorted(cloud.target_inside, grid)
    )
    bounds, boxes = kernels.target_groups(targets, target_start, MOST_PER_GROUP)
    heads = np.zeros((len(bounds), 2), dtype=np.int64)
    points_in = np.diff(bounds).astype(float)
    none = (np.empty(0, np.int32), np.empty(0, np.int64), np.empty(0, np.uint8))
    team = workers.team
    sources, lattice = (points, start, grid), (cloud.lattice.periods, cloud.lattice.offset)

    def fill(edges: Integers, filled: bool, arrays: tuple) -> None:
        def one(k: int) -> None:
            span = edges[k], edges[k + 1]
            kernels.near_lists(*span, boxes, *sources, *lattice, rc, filled, heads, *arrays)

        workers.for_each(len(edges) - 1, one)

    counted = cut(points_in, np.ones(team.size))
    fill(chunks(points_in, counted, team.rank, CHUNKS), False, none)
    sizes = heads[:-1].copy()
    team.complete(sizes, counted)
    work = sizes[:, 0] * (points_in + 2.0) + 1.0
    ranks = cut(work, shares)
    edges = chunks(work, ranks, team.rank, CHUNKS)
    first, stop = ranks[team.rank], ranks[team.rank + 1]
    heads[:] = 0
    heads[first + 1 : stop + 1] = np.cumsum(sizes[first:stop], axis=0)
    total, runs = heads[stop]
    arrays = (np.empty(total, np.int32), np.empty(runs, np.int64), np.empty(runs, np.uint8))
    fill(edges, True, arrays)
    most = int(sizes[first:stop, 0].max(initial=0))
    pairs = int(sizes[:, 0] @ np.diff(bounds))
    lists = (heads, *arrays, most)
    return NearLists(order, target_order, bounds, boxes, lists, edges, bounds[ranks], pairs)


class NearPart:
    """The near part of one cloud: `load` forces, then run all tasks, then `result`.

    The tasks are those of this rank; `result` brings in what the others did.
    """

    def __init__(
        self,
        cloud: Cloud,
        lists: NearLists,
        polynomials: NearPolynomials,
        *,
        radius: Array,
        team: AbstractTeam,
    ) -> None:
        self.lists, self._team = lists, team
        single = polynomials.precision == "single"
        self._kind = np.float32 if single else np.float64
        self._kernel = kernels.near_single if single else kernels.near_double
        order = lists.order
        images = np.array(list(product(*(range(-int(m), int(m) + 1) for m in IMAGES))))
        table = np.empty((len(images), 4))
        table[:, :3] = cloud.lattice.shift(images)
        table[:, 3] = polynomials.scale
        self._targets = np.ascontiguousarray(cloud.target_inside[:, lists.target_order])
        self._target_keys = cloud.target_keys[lists.target_order]
        mixed = radius.size > 1 and bool(np.any(radius != radius[0]))
        self._polynomials = as_tuples(polynomials, radius, self._kind)
        self._numbers = tuple(self._kind(v) for v in range(4))
        d = 0.5 * (radius * polynomials.scale) ** 2
        d = d[order] if mixed else np.full(order.size, d[0] if d.size else 0.0)
        self._d = d.astype(self._kind)
        self._points = np.ascontiguousarray(cloud.inside[:, order])
        self._keys = cloud.keys[order]
        self._table, self._jump = table, (images @ cloud.jumps).astype(np.int32)
        self._force: NDArray = np.zeros((3, order.size), self._kind)
        self._out = np.zeros((lists.target_order.size, 3))

    @property
    def tasks(self) -> int:
        return self.lists.chunks

    def load(self, force: Array) -> None:
        """Take sorted forces (n, 3), of order one, for the next sum."""
        self._force[:] = force.T
        self._out[:] = 0.0

    def run(self, task: int) -> None:
        """Do one of the tasks; they are independent of each other."""
        self._kernel(
            self.lists.edges[task],
            self.lists.edges[task + 1],
            self.lists.bounds,
            self.lists.boxes,
            self.lists.lists,
            self._targets,
            self._target_keys,
            (self._points, self._keys, self._force, self._d, self._table, self._jump),
            self._polynomials,
            self._numbers,
            self._out,
        )

    def result(self) -> Array:
        """Return the near part in sorted order, (m, 3), of all ranks."""
        self._team.complete(self._out, self.lists.rows)
        return self._out


def as_tuples(polynomials: NearPolynomials, radius: Array, kind: type) -> tuple:
    """Return P_a, P_b, Q_a, Q_b as the kernels take them.

    Equal radii are folded into P, and Q is zero. Otherwise Q is what d = a^2 / 2 multiplies.
    """
    mixed = radius.size > 1 and bool(np.any(radius != radius[0]))
    if mixed:
        rows = [*polynomials.stokeslet, *(2.0 * polynomials.doublet)]
    else:
        rows = [*polynomials.folded(float(radius[0]) if radius.size else 0.0), *np.zeros((2, 1))]
    return tuple(
        tuple(tuple(kind(v) for v in row[k : k + BLOCK]) for k in range(0, len(row), BLOCK))
        for row in rows
    )
