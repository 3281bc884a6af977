"""Slow sums that the fast one is held against; nothing is shared with it.

Velocities are times 8 pi mu, ``S(r) = (I + rr/r^2)/r``; a point feels its images, not itself.

- Free: all pairs.
- One direction: a long sum over images, p and -p together; what is left falls as a series in
  ``(P + 1/2)^-2``, which Richardson's extrapolation takes out (`extrapolated`).
- Two: lines of such sums. Lines farther than six periods are two-dimensional Stokeslets, to
  ``exp(-12 pi)``; pairs of lines fall as m^-2 and are extrapolated as well.
- Three: Hasimoto's series (1959), all terms, at a split of its own, for any lattice.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.special import erfc

from stokesfibers.core.arrays import Array, Points, as_float

_IMAGES = (24, 34, 48, 68, 96, 136)
_LINES = (6, 9, 13, 19, 27, 39, 56, 80)
_AWAY = 6.0  # in periods: from where on a line of images is a two-dimensional Stokeslet
_REACH = 6.2  # of both series of three directions, in units of their width: exp(-38)


@dataclass(frozen=True, eq=False)
class Pairs:
    """Targets and sources with forces.

    Attributes
    ----------
    targets
        (m, 3).
    sources, forces
        (n, 3) each.
    """

    targets: Points
    sources: Points
    forces: Array

    @property
    def apart(self) -> Array:
        """Targets less sources, (m, n, 3)."""
        return self.targets[:, None] - self.sources[None]

    def summed(self, kernel: Callable[[Array], tuple[Array, Array]], shift: Array) -> Array:
        """Return the sum of ``a f + b r (r.f)``, a and b from `kernel` of r^2 (m, n); (m, 3)."""
        r = self.apart + shift
        across, along = kernel(np.einsum("mni,mni->mn", r, r))
        along = along * np.einsum("mni,ni->mn", r, self.forces)
        return across @ self.forces + np.einsum("mn,mni->mi", along, r)


def _stokeslet(r2: Array) -> tuple[Array, Array]:
    """Return 1/r and 1/r^3, zero at r = 0."""
    inverse = np.divide(1.0, np.sqrt(r2), out=np.zeros_like(r2), where=r2 > 0.0)
    return inverse, inverse**3


def free(pairs: Pairs, shift: Array | None = None) -> Array:
    """Return the sum over all pairs, (m, 3), of targets moved by `shift`."""
    return pairs.summed(_stokeslet, np.zeros(3) if shift is None else shift)


def extrapolated(partials: Sequence[Array], at: Array, powers: Array) -> Array:
    """Return the limit of partial sums whose error is a series of `powers` of 1 / at.

    As many powers as there are sums, less one, are taken out.
    """
    columns = [at ** (-float(p)) for p in (0.0, *powers[: len(at) - 1])]
    weights = np.linalg.solve(np.stack(columns), np.eye(len(at))[0])
    return as_float(np.tensordot(weights, np.stack(partials), axes=1))


def one_direction(pairs: Pairs, period: float, axis: int, *, offset: Array | None = None) -> Array:
    """Return the sum over the images along `axis`, (m, 3).

    Each image p != 0 less ``(I + aa) / |p d|``, which has no effect where forces add up to zero.

    Parameters
    ----------
    pairs, period, axis
        What to sum.
    offset
        Displacement of all sources, (3,).
    """
    moved = np.zeros(3) if offset is None else -offset
    step = period * np.eye(3)[axis]
    total = pairs.forces.sum(axis=0) * (1.0 + np.eye(3)[axis]) / period
    found = pairs.summed(_stokeslet, moved)
    partials = []
    for p in range(1, _IMAGES[-1] + 1):
        for sign in (p, -p):
            found = found + pairs.summed(_stokeslet, moved + sign * step)
        found -= 2.0 / p * total
        if p in _IMAGES:
            partials.append(found)
    return extrapolated(partials, np.array(_IMAGES) + 0.5, np.arange(2.0, 20.0, 2.0))


def _line(pairs: Pairs, offset: Array, period: float, axis: int) -> Array:
    """Return `one_direction` far from the line, less a constant that forces without sum cancel."""
    r = pairs.apart - offset
    r[..., axis] = 0.0
    rho2 = np.einsum("mni,mni->mn", r, r)
    along = 2.0 / rho2 * np.einsum("mni,ni->mn", r, pairs.forces)
    weights = 1.0 + np.eye(3)[axis]
    found = np.einsum("mn,mni->mi", along, r) - (np.log(rho2) @ pairs.forces) * weights
    return found / period


def two_directions(pairs: Pairs, periods: Sequence[float]) -> Array:
    """Return the sum over images along x and y, (m, 3), for forces that add up to zero."""
    (d, e), (axis, other) = sorted(periods), np.argsort(periods)
    step = e * np.eye(3)[other]
    near = int(np.ceil((_AWAY + 1.0) * d / e))
    found = one_direction(pairs, d, int(axis))
    stops = near + np.array(_LINES)
    partials = []
    for m in range(1, stops[-1] + 1):
        for shift in (m * step, -m * step):
            if m <= near:
                found = found + one_direction(pairs, d, int(axis), offset=shift)
            else:
                found = found + _line(pairs, shift, d, int(axis))
        if m in stops:
            partials.append(found)
    return extrapolated(partials, stops + 0.5, np.arange(1.0, 30.0, 2.0))


def three_directions(pairs: Pairs, periods: Sequence[float]) -> Array:
    """Return the sum over the images of a cell with right angles, (m, 3); mean flow zero."""
    return lattice(pairs, np.diag(np.array(periods, dtype=float)))


def lattice(pairs: Pairs, vectors: Array) -> Array:
    """Return Hasimoto's sum over the images along the rows of `vectors` (3, 3); mean flow zero."""
    volume = abs(float(np.linalg.det(vectors)))
    xi = np.sqrt(np.pi) / volume ** (1.0 / 3.0)
    found = np.zeros(pairs.targets.shape)
    for image in product(*_images_within(pairs, vectors, _REACH / xi)):
        shift = np.array(image) @ vectors
        if _least(pairs, shift) < _REACH / xi:
            found += pairs.summed(lambda r2: _damped(r2, xi), shift)
    most = np.ceil(_REACH * xi * np.linalg.norm(vectors, axis=1) / np.pi).astype(int)
    waves = [np.arange(-n, n + 1) for n in most]
    modes = np.stack(np.meshgrid(*waves, indexing="ij"), axis=-1).reshape(-1, 3)
    k = 2.0 * np.pi * modes[np.any(modes != 0, axis=1)] @ np.linalg.inv(vectors).T
    k2 = np.einsum("ki,ki->k", k, k)
    y = 0.25 * k2 / xi**2
    weight = 8.0 * np.pi / k2 * (1.0 + y) * np.exp(-y) / volume
    force = np.exp(-1j * k @ pairs.sources.T) @ pairs.forces
    force -= k * (np.einsum("ki,ki->k", k, force) / k2)[:, None]
    wave = np.exp(1j * pairs.targets @ k.T)
    return found + np.real(wave @ (weight[:, None] * force))


def _damped(r2: Array, xi: float) -> tuple[Array, Array]:
    """Return the near part of Hasimoto's split, as `_stokeslet`; at r = 0 less the far one."""
    across, along = np.zeros_like(r2), np.zeros_like(r2)
    within = r2 < (_REACH / xi) ** 2
    inverse, cube = _stokeslet(r2[within])
    r = np.sqrt(r2[within])
    outer = erfc(xi * r)
    bump = 2.0 * xi / np.sqrt(np.pi) * np.exp(-((xi * r) ** 2))
    across[within] = np.where(r > 0.0, outer * inverse - bump, -2.0 * bump)
    along[within] = outer * cube + bump * inverse**2
    return across, along


def _images_within(pairs: Pairs, vectors: Array, reach: float) -> list[range]:
    """Return the numbers of images along each vector that may bring a source within `reach`."""
    inverse = np.linalg.inv(vectors)
    cells, wide = pairs.apart @ inverse, reach * np.linalg.norm(inverse, axis=0)
    low = np.floor(-cells.max(axis=(0, 1)) - wide).astype(int)
    high = np.ceil(-cells.min(axis=(0, 1)) + wide).astype(int)
    return [range(first, last + 1) for first, last in zip(low, high, strict=True)]


def _least(pairs: Pairs, shift: Array) -> float:
    """Return a lower bound of the distance of any target from any source moved by -shift."""
    low = pairs.targets.min(axis=0) - pairs.sources.max(axis=0) + shift
    high = pairs.targets.max(axis=0) - pairs.sources.min(axis=0) + shift
    return float(np.linalg.norm(np.maximum(0.0, np.maximum(low, -high))))


def sheared_as_copies(
    pairs: Pairs, periods: Sequence[float], turns: tuple[int, int]
) -> tuple[Pairs, tuple[float, float, float]]:
    """Return an unsheared cell that is the lattice of a sheared one, and its periods.

    Where q images up in y are displaced by p whole periods along x, the lattice has a cell of q
    periods along y with right angles and q copies of every source in it.

    Parameters
    ----------
    pairs, periods
        Of the sheared cell.
    turns
        p and q: the image one period up is displaced by p/q of the period along x.
    """
    p, q = turns
    lx, ly, lz = periods
    copies = np.arange(q)[:, None, None] * np.array([p / q * lx, ly, 0.0])
    sources = (pairs.sources[None] + copies).reshape(-1, 3)
    forces = np.tile(pairs.forces, (q, 1))
    return Pairs(pairs.targets, sources, forces), (lx, q * ly, lz)
