"""The table of the far part's Green's function, for boxes with free directions.

B is split once more, by Hasimoto's Gaussians with the widest reach the box allows (t0 of
`green_smooth`). The narrow part is over before the images begin: its transform is exact as
it is. The wide part needs few Chebyshev nodes, is multiplied by the window there and transformed
direction by direction. Where the periodic wavenumber q is so large that ``exp(-q gap)`` is nothing,
no window is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, reduce
from math import ceil, prod

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.summation.ewald.green_smooth import smooth_line, smooth_sheet, smooth_unbounded
from stokesfibers.summation.ewald.green_window import PHASE, even_nodes, windowed_transform

_NOTHING = 37.0  # exp(-37) is rounding
_EXTRA_NODES = 8
_FITTED_NODES = 16  # per direction, for what `_lessened` subtracts


@dataclass(frozen=True)
class Cell:
    """A box with at least one free direction; fields as in `green.FarBox`."""

    lengths: tuple[float, ...]
    modes: tuple[int, ...]
    periodic: tuple[bool, ...]
    reach: float
    k_max: float

    @property
    def free(self) -> list[int]:
        """Indices of the free directions."""
        return [d for d in range(3) if not self.periodic[d]]

    @property
    def width(self) -> float:
        """Width of the window's transition."""
        return PHASE / self.k_max

    def flat(self, axis: int) -> float:
        """Return how far the window is 1: extent + reach."""
        return 0.5 * (self.lengths[axis] - self.width)

    @property
    def gap(self) -> float:
        """Least distance from a mollified source to an image of a point, free directions only.

        An image is a box length away, the point up to an extent = flat - reach, and the mollifier
        takes another reach.
        """
        return min(self.lengths[d] - self.flat(d) for d in self.free)

    @property
    def area(self) -> float:
        """Product of the periods; 1 if there are none."""
        return prod(v for v, p in zip(self.lengths, self.periodic, strict=True) if p)

    def wavenumbers(self, axis: int) -> Array:
        """Return the wavenumbers of modes 0 ... modes/2 of a direction."""
        return 2.0 * np.pi / self.lengths[axis] * np.arange(self.modes[axis] // 2 + 1.0)


@dataclass(frozen=True)
class _Wide:
    """The wide part of B: its t0, and nodes and transforms per free direction."""

    t0: float
    nodes: list[Array]
    transforms: list[Array]
    flats: list[float]

    def transform(self, values: Array) -> Array:
        """Return the transform of values at the nodes, times the window, at all free modes.

        Leading axes stay as they are.
        """
        first = values.ndim - len(self.nodes)
        for matrix in self.transforms:
            # the axis goes to the end, so that after all of them their order is back
            values = np.tensordot(values, matrix, axes=(first, 1))
        return values


def _wide(cell: Cell) -> _Wide:
    t0 = cell.gap**2 / (4.0 * _NOTHING)
    nodes, transforms, flats = [], [], []
    for axis in cell.free:
        flat = cell.flat(axis)
        end = flat + cell.width
        count = ceil(_NOTHING * end / cell.gap) + _EXTRA_NODES
        nodes.append(even_nodes(count, end))
        transforms.append(windowed_transform(cell.wavenumbers(axis), flat, cell.width, count))
        flats.append(flat)
    return _Wide(t0, nodes, transforms, flats)


def _lessened(values: Array, wide: _Wide) -> tuple[Array, Array]:
    """Return values plus the a + sum b_d x_d^2 that make them smallest where the window falls; b.

    The polynomial's own velocity is a constant, known and put right by the caller. What the
    window cuts is smaller for it, by five to ten times; for that a part of the nodes is enough.
    """
    squares = [(x / x[0]) ** 2 for x in wide.nodes]
    some = [slice(None, None, ceil(x.size / _FITTED_NODES)) for x in wide.nodes]
    grids = np.meshgrid(*(v[s] for v, s in zip(squares, some, strict=True)), indexing="ij")
    ends = [(f / x[0]) ** 2 for f, x in zip(wide.flats, wide.nodes, strict=True)]
    outside = np.any([g > e for g, e in zip(grids, ends, strict=True)], axis=0)
    columns = np.stack([np.ones(outside.sum()), *(g[outside] for g in grids)], axis=1)
    best = np.linalg.lstsq(columns, -values[tuple(some)][outside], rcond=None)[0]
    polynomial = best[0]
    for weight, square in zip(best[1:], squares, strict=True):
        polynomial = np.asarray(polynomial)[..., None] + weight * square
    return values + polynomial, best[1:] / np.array([x[0] ** 2 for x in wide.nodes])


def _convention(cell: Cell) -> Array:
    """Return what -r^2 log r lacks of the sum over one direction's images in `green.FarBox`.

    From ``sum_p 1/|r + p a| -> (2/d) (log(2d/r) - gamma)`` far from the line, gamma Euler's.
    """
    if sum(cell.periodic) != 1:
        return np.zeros(3)
    period = cell.area
    across = 2.0 * (np.log(2.0 * period) - np.euler_gamma)
    return np.where(cell.periodic, 2.0 * across + 2.0, across + 3.0) / period


def _unbounded(cell: Cell, wide: _Wide) -> tuple[Array, Array]:
    """Return the wide part's transform for q = 0, and the constant, (3,)."""
    values, squares = _lessened(smooth_unbounded(wide.nodes, wide.t0), wide)
    own = np.zeros(3)
    own[cell.free] = squares
    # (I laplacian - grad grad) of sum b_d x_d^2 is diag(2 sum b - 2 b)
    constant = _convention(cell) - 2.0 * (squares.sum() - own) / cell.area
    return wide.transform(values), constant


def _wavy(q: Array, wide: _Wide) -> Array:
    """Return the wide part's transforms for wavenumbers q > 0, (q, ...)."""
    if len(wide.nodes) == 1:
        return wide.transform(smooth_sheet(q, wide.nodes[0], wide.t0))
    return np.array([wide.transform(smooth_line(v, wide.nodes, wide.t0)) for v in q])


@lru_cache(maxsize=2)
def tabulate(cell: Cell) -> tuple[Array, Array]:
    """Return G at modes 0 ... modes/2 of each direction, (.., .., ..), and the constant, (3,).

    Periodic directions come first until the table is done.
    """
    along = [d for d in range(3) if cell.periodic[d]]
    squares = [cell.wavenumbers(axis) ** 2 for axis in (*along, *cell.free)]
    k2 = reduce(np.add.outer, squares)
    table = np.divide(8.0 * np.pi, k2, out=np.zeros_like(k2), where=k2 > 0.0)
    q = np.sqrt(reduce(np.add.outer, squares[: len(along)], np.zeros(()))).ravel()
    low = np.flatnonzero(q * cell.gap < _NOTHING)
    rows = low if low.size < q.size else slice(None)  # views where all are low
    wide = _wide(cell)
    # q = 0 is the first of the low ones
    first, constant = _unbounded(cell, wide)
    transforms = first[None]
    if low.size > 1:
        transforms = np.concatenate([transforms, _wavy(q[low][1:], wide)])
    below = k2.reshape(q.size, *first.shape)[rows]
    transforms *= below
    narrow = reduce(np.multiply.outer, [np.exp(-wide.t0 * v) for v in squares])
    narrow = narrow.reshape(q.size, *first.shape)[rows]
    narrow *= 1.0 + wide.t0 * below
    np.subtract(1.0, narrow, out=narrow)
    by_row = table.reshape(q.size, *first.shape)
    by_row[rows] *= narrow
    by_row[rows] -= transforms
    table = np.ascontiguousarray(np.moveaxis(table, range(3), (*along, *cell.free)))
    table.setflags(write=False)
    constant.setflags(write=False)
    return table, constant
