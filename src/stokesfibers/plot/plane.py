"""A plane through a suspension: the grid to evaluate the velocity on, and the fibers near it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.case import offset, periods, radii
from stokesfibers.plot.geometry import wrapped

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]

_MARGIN = 0.25  # beyond the fibers in free directions, in lengths of the longest one
_LEAST = 5
_MOST = 2000


@dataclass(frozen=True)
class Plane:
    """A rectangular grid in a plane normal to an axis.

    Attributes
    ----------
    axes
        The two directions, horizontal first, e.g. ``"xy"``.
    at
        Coordinate of the plane along the third direction [length].
    time
        Time of the record that was chosen.
    x : (nx,)
        Horizontal coordinates [length].
    y : (ny,)
        Vertical coordinates [length].
    fibers : each (node, 4)
        Centrelines whose projection falls on the grid, images included: horizontal coordinate,
        vertical one, signed distance from the plane; and the radius there, 0 if the run does not
        tell it.
    """

    axes: str
    at: float
    time: float
    x: Floats
    y: Floats
    fibers: tuple[Floats, ...]

    @property
    def directions(self) -> list[int]:
        """Numbers of the horizontal, the vertical and the normal direction."""
        return select.plane_directions(self.axes)

    @property
    def points(self) -> Floats:
        """The grid's points in space, (ny, nx, 3)."""
        grid = np.empty((len(self.y), len(self.x), 3))
        across, up, normal = self.directions
        grid[..., across], grid[..., up] = self.x, self.y[:, None]
        grid[..., normal] = self.at
        return grid

    def components(self, velocity: Floats) -> Floats:
        """Return velocities (..., 3) in space as horizontal, vertical and normal ones."""
        return velocity[..., self.directions]


def plane_of(
    data: xr.DataTree,
    *,
    axes: str = "xy",
    at: float | None = None,
    time: float | None = None,
    points: int = 200,
) -> Plane:
    """Return a grid in a plane that shows one cell, and what the fibers fill in free directions.

    Parameters
    ----------
    data
        The stored run.
    axes
        The plane's two directions, horizontal first.
    at
        Where the plane cuts the third direction [length]. Default: the middle of the cell where
        it is periodic, else of the fibers.
    time
        Time; the nearest stored record stands for it. Default: the last.
    points
        Points along the longer side; the steps along both are equal to within one point.

    Raises
    ------
    InputError
        If the directions are not two of x, y, z, the time lies outside the stored range, `at`
        is not finite, there are not 5 to 2000 points, or positions are not finite.
    """
    directions = select.plane_directions(axes)
    count = checks.whole("points", points, _LEAST)
    if count > _MOST:
        raise InputError("points", f"a whole number, {_LEAST} to {_MOST}", count)
    record, shown_at = select.snapshot(data, time)
    lengths, slid = periods(data), offset(data, shown_at)
    longest = float(select.numbers(data, "trajectory", "arclength").max())
    lines = wrapped(select.positions(data, record), lengths, slid)
    box = _box(lines, lengths, longest)
    cut = float(box[directions[2]].mean()) if at is None else checks.finite("at", at)
    x, y = _grid(box[directions[:2]], count)
    images = _images(lengths, slid)
    thick = np.concatenate([lines, radii(data)[..., None]], axis=-1)
    shown = _shown(thick, images, np.stack([box[d] for d in directions[:2]]), directions)
    fibers = tuple(line - np.array([0.0, 0.0, cut, 0.0]) for line in shown)
    return Plane(axes, cut, shown_at, x, y, fibers)


def _box(lines: Floats, lengths: Floats, longest: float) -> Floats:
    """Return the limits (3, 2): the cell where periodic, the fibers and a margin where free."""
    low = lines.min(axis=(0, 1)) - _MARGIN * longest
    high = lines.max(axis=(0, 1)) + _MARGIN * longest
    periodic = lengths > 0.0
    return np.stack([np.where(periodic, 0.0, low), np.where(periodic, lengths, high)], axis=1)


def _grid(limits: Floats, points: int) -> tuple[Floats, Floats]:
    sides = limits[:, 1] - limits[:, 0]
    counts = np.maximum(np.rint(points * sides / sides.max()).astype(int), _LEAST)
    x, y = (np.linspace(low, high, n) for (low, high), n in zip(limits, counts, strict=True))
    return x, y


def _images(lengths: Floats, slid: float) -> Floats:
    """Return the lattice vectors of the nearest images, (image, 3); sheared ones reach farther."""
    most = [1 if d > 0.0 else 0 for d in lengths]
    if slid:
        most[0] = 2
    ranges = [range(-n, n + 1) for n in most]
    numbers = np.array(list(product(*ranges)), dtype=np.float64)
    shifts = numbers * lengths
    shifts[:, 0] += numbers[:, 1] * slid
    return shifts


def _shown(lines: Floats, images: Floats, limits: Floats, directions: list[int]) -> list[Floats]:
    """Return fibers and images whose projection may touch the view, (node, 4) each."""
    shown = []
    for line, shift in product(lines, images):
        moved = np.column_stack([(line[:, :3] + shift)[:, directions], line[:, 3]])
        flat = moved[:, :2]
        if np.all(flat.max(axis=0) >= limits[:, 0]) and np.all(flat.min(axis=0) <= limits[:, 1]):
            shown.append(moved)
    return shown
