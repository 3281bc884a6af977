"""Random sequential addition of straight fibers that keep a least gap, in a box or a cell."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError
from stokesfibers.core.segments import segment_distances
from stokesfibers.fiber.orientation import AbstractOrientation
from stokesfibers.fiber.parameters import Fiber

TRIES = 2000
"""Places tried for one fiber before the box is called too full."""
_ROUNDING = 1.0 + 1e-9


@dataclass(frozen=True)
class Box:
    """Where middles are drawn: a box from `origin` of `size`, periodic with `periods` (0: not)."""

    origin: Array
    size: Array
    periods: Array


class _Cells:
    """Fibers by the cell their middle is in, for a search that does not grow with their number."""

    def __init__(self, box: Box, reach: float) -> None:
        self._origin = box.origin
        self._periodic = box.periods > 0.0
        self._count = np.maximum(1, np.floor(box.size / reach).astype(int))
        self._width = box.size / self._count
        self._inside: dict[tuple[int, ...], list[int]] = {}

    def _cell(self, middle: Array) -> Array:
        index = np.floor((middle - self._origin) / self._width).astype(int)
        return np.clip(index, 0, self._count - 1)

    def add(self, number: int, middle: Array) -> None:
        self._inside.setdefault(tuple(self._cell(middle)), []).append(number)

    def near(self, middle: Array) -> list[int]:
        found: set[int] = set()
        for step in product((-1, 0, 1), repeat=3):
            index = self._cell(middle) + step
            index = np.where(self._periodic, index % self._count, index)
            found.update(self._inside.get(tuple(index), ()))
        return sorted(found)


def place_randomly(
    fibers: tuple[Fiber, ...],
    box: Box,
    *,
    orientation: AbstractOrientation,
    least_gap: float,
    seed: int,
) -> tuple[Points, Points]:
    """Return middles and unit vectors of straight fibers, (fiber, 3) each.

    Two fibers, images included, keep surface to surface at least `least_gap`, taking each as a
    cylinder of its mid-length radius.

    Raises
    ------
    InputError
        If a fiber finds no place in `TRIES` tries.
    """
    random = np.random.default_rng(seed)
    lengths = np.array([f.length for f in fibers])
    radii = np.array([f.eps * f.length for f in fibers])
    reach = float(lengths.max() + 2.0 * radii.max() + least_gap)
    cells = _Cells(box, reach)
    shifts = _shifts(box.periods, reach)
    middles, units = np.empty((len(fibers), 3)), np.empty((len(fibers), 3))
    for k in range(len(fibers)):
        for _ in range(TRIES):
            middle = box.origin + box.size * random.random(3)
            unit = orientation.sample(1, random)[0]
            near = np.array(cells.near(middle), dtype=int)
            if _fits(k, middle, unit, (near, middles, units, lengths, radii, shifts, least_gap)):
                break
        else:
            raise _too_full(fibers, box, k, least_gap)
        middles[k], units[k] = middle, unit
        cells.add(k, middle)
    return middles, units


def _shifts(periods: Array, reach: float) -> Array:
    """Return the lattice vectors by which middles in the cell may come within `reach`."""
    # two middles are less than a period apart
    most = [int(np.ceil(reach / p)) if p > 0.0 else 0 for p in periods]
    return np.array(list(product(*[range(-n, n + 1) for n in most]))) * periods


def _fits(k: int, middle: Array, unit: Array, placed: tuple) -> bool:
    near, middles, units, lengths, radii, shifts, least_gap = placed
    start, along = middle - 0.5 * lengths[k] * unit, lengths[k] * unit
    own = np.any(shifts != 0.0, axis=1)
    images = start + shifts[own]
    if images.size:
        same = segment_distances(start, along, images, np.tile(along, (len(images), 1)))
        if same.min() < 2.0 * radii[k] + least_gap:
            return False
    if not near.size:
        return True
    least = radii[k] + radii[near] + least_gap
    # only images whose middles are near enough: most of them are far
    offset = (middle + shifts)[:, None] - middles[near]
    apart = np.sqrt(np.sum(offset * offset, axis=-1))
    image, fiber = np.nonzero(apart <= (0.5 * (lengths[k] + lengths[near]) + least) * _ROUNDING)
    alongs = lengths[near, None][fiber] * units[near][fiber]
    starts = middles[near][fiber] - 0.5 * alongs
    distance = segment_distances((start + shifts)[image], along, starts, alongs)
    return not np.any(distance < least[fiber])


def _too_full(fibers: tuple[Fiber, ...], box: Box, placed: int, least_gap: float) -> InputError:
    density = sum(f.length**3 for f in fibers) / float(np.prod(box.size))
    return InputError(
        "initial.box",
        f"room for {len(fibers)} fibers with a gap of {least_gap:g}",
        f"room for {placed} (n L^3 would be {density:.3g})",
        "Take a larger box, fewer fibers, a smaller least_gap or a narrower orientation.",
    )
