"""Initial shapes of suspensions: random or on a lattice, as the table [initial] says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import choose
from stokesfibers.fiber import curves
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.initial import AbstractInitial
from stokesfibers.fiber.orientation import ORIENTATIONS, AbstractOrientation, Isotropic
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.fiber.placement import Box, place_randomly

Triple = tuple[float, float, float]
Orientation = AbstractOrientation | str | Mapping[str, Any]


def _orientation(value: Orientation) -> AbstractOrientation:
    if isinstance(value, AbstractOrientation):
        return value
    table = {"kind": value} if isinstance(value, str) else value
    if not isinstance(table, Mapping):
        raise InputError("orientation", "a name or a table", value)
    return choose(ORIENTATIONS, table, "orientation")


def _box(size: Triple | None, periods: Array) -> Box:
    """Return the box of `size` at the origin; by default the periodic cell."""
    if size is None:
        if not np.all(periods > 0.0):
            raise InputError(
                "initial.box", "three lengths, since the domain has free directions", "nothing"
            )
        return Box(np.zeros(3), periods.copy(), periods)
    lengths = np.array(size)
    whole = np.isclose(lengths, periods)
    if np.any((periods > 0.0) & (lengths > periods) & ~whole):
        raise InputError("initial.box", f"no more than the periods {list(periods)}", list(size))
    return Box(np.zeros(3), lengths, np.where(periods > 0.0, periods, 0.0))


def _straight(fibers: tuple[Fiber, ...], middles: Array, units: Array) -> tuple[Curve, ...]:
    return tuple(
        curves.segment(f, centre=m, direction=u)
        for f, m, u in zip(fibers, middles, units, strict=True)
    )


def _normals(units: Array, seed: int) -> Array:
    """Return a random unit vector normal to each of `units` (fiber, 3).

    The random numbers are others than those of the places.
    """
    random = np.random.default_rng((seed, 1))
    across = np.cross(units, random.normal(size=units.shape))
    return across / np.linalg.norm(across, axis=1)[:, None]


@dataclass(frozen=True)
class Suspension(AbstractInitial):
    """Straight or slightly bent fibers at random that keep a least gap.

    Attributes
    ----------
    seed
        Of the random numbers.
    box
        Lengths of the box that middles are drawn from, from the origin; default the periodic cell.
    orientation
        isotropic, or a table: aligned (axis), in_plane (normal), von_mises_fisher (axis,
        concentration).
    least_gap
        Between surfaces, images included, in units of length.
    amplitude
        d_y of the paper's slightly bent shape (47), in units of a fiber's length, each in a random
        plane; the largest deflection is d_y / 256. Default straight.
    """

    seed: int = 0
    box: Triple | None = None
    orientation: Orientation = field(default_factory=Isotropic)
    least_gap: float = 0.0
    amplitude: float = 0.0
    kind: ClassVar[str] = "suspension"

    def __post_init__(self) -> None:
        checks.whole("seed", self.seed, 0)
        checks.non_negative("least_gap", self.least_gap)
        checks.finite("amplitude", self.amplitude)
        if self.box is not None:
            object.__setattr__(self, "box", checks.vector3("box", self.box))
            if min(checks.vector3("box", self.box)) <= 0.0:
                raise InputError("box", "three lengths above zero", list(self.box))
        object.__setattr__(self, "orientation", _orientation(self.orientation))

    def curves(self, fibers: tuple[Fiber, ...], periods: Array) -> tuple[Curve, ...]:
        sway = abs(self.amplitude) / 256.0 * max(f.length for f in fibers)
        middles, units = place_randomly(
            fibers,
            _box(self.box, periods),
            orientation=_orientation(self.orientation),
            least_gap=self.least_gap + 2.0 * sway,
            seed=self.seed,
        )
        if not self.amplitude:
            return _straight(fibers, middles, units)
        normals = _normals(units, self.seed)
        return tuple(
            curves.bent(f, centre=m, direction=u, normal=n, amplitude=self.amplitude)
            for f, m, u, n in zip(fibers, middles, units, normals, strict=True)
        )


@dataclass(frozen=True)
class Lattice(AbstractInitial):
    """Parallel or randomly turned fibers with their middles on a lattice.

    Attributes
    ----------
    cells
        Number of lattice points along x, y, z; their product must be the number of fibers.
    box
        Lengths of the box, from the origin; default the periodic cell.
    orientation
        As for `Suspension`.
    seed
        Of the random orientations.
    """

    cells: tuple[int, int, int]
    box: Triple | None = None
    orientation: Orientation = field(default_factory=Isotropic)
    seed: int = 0
    kind: ClassVar[str] = "lattice"

    def __post_init__(self) -> None:
        x, y, z = checks.vector3("cells", self.cells)
        cells = tuple(checks.whole("cells", int(c) if c == int(c) else c, 1) for c in (x, y, z))
        object.__setattr__(self, "cells", cells)
        checks.whole("seed", self.seed, 0)
        if self.box is not None:
            object.__setattr__(self, "box", checks.vector3("box", self.box))
        object.__setattr__(self, "orientation", _orientation(self.orientation))

    def curves(self, fibers: tuple[Fiber, ...], periods: Array) -> tuple[Curve, ...]:
        if int(np.prod(self.cells)) != len(fibers):
            raise InputError(
                "initial.cells", f"three numbers with product {len(fibers)}", list(self.cells)
            )
        size = _box(self.box, periods).size
        axes = [(np.arange(c) + 0.5) * (d / c) for c, d in zip(self.cells, size, strict=True)]
        middles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        random = np.random.default_rng(self.seed)
        units = _orientation(self.orientation).sample(len(fibers), random)
        return _straight(fibers, middles, units)
