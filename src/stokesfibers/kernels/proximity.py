"""Compiled search for near segments of different fibers, and of those that pass through each other.

Fibers are polygons, positions have shape (fiber, node, 3). Blocks of a few successive segments lie
in balls (fiber, block, 4): centre and radius; whole fibers in balls (fiber, 4). Balls that are far
apart are passed over. Of periodic images the nearest counts, told by the middles of segments; a
fiber meets itself only through a period. Slow twins are in ``tests/reference``.

A lattice is (5,): the periods, zero in a free direction; the offset along x of the image one
period up in y; and how many rows up and down the nearest image may lie in (`lattice`).
"""

from __future__ import annotations

import numpy as np
from numba import njit

_OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}
# Parts are inlined and not cached by themselves; see `kernels`.
_PART = {**_OPTIONS, "cache": False, "forceinline": True}
BLOCK = 8
"""Segments of a block."""


def lattice(lengths, offset, rows):
    """Return a lattice as the kernels take it, (5,)."""
    return np.array([*lengths, offset, float(rows)])


@njit(**_PART)
def _periods(along, period):
    """Return how many periods bring a difference closest to zero; 0 in a free direction."""
    return -np.round(along / period) if period > 0.0 else 0.0


@njit(**_PART)
def _shifted_x(x, up, lattice):
    """Return a difference along x brought closest to zero, the image being `up` rows up."""
    moved = x + up * lattice[3]
    return moved + _periods(moved, lattice[0]) * lattice[0]


@njit(**_PART)
def _nearest_row(x, y, lattice):
    """Return by how many rows the nearest image is up, for a difference (x, y)."""
    own = _periods(y, lattice[1])
    best, least = own, np.inf
    rows = int(lattice[4])
    for step in range(-rows, rows + 1):
        up = own + step
        along, above = _shifted_x(x, up, lattice), y + up * lattice[1]
        square = along * along + above * above
        if square < least:
            best, least = up, square
    return best


@njit(**_PART)
def _apart(one, other, lattice):
    """Return a lower bound of the distance of two balls, images included."""
    x, y, z = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    up = _nearest_row(x, y, lattice) if lattice[4] > 0.0 else _periods(y, lattice[1])
    x = _shifted_x(x, up, lattice)
    y += up * lattice[1]
    z += _periods(z, lattice[2]) * lattice[2]
    return np.sqrt(x * x + y * y + z * z) - one[3] - other[3]


@njit(**_PART)
def _nearest(x, y, z, lattice, shift):
    """Set the lattice vector `shift` that brings (x, y, z) closest to zero."""
    up = _nearest_row(x, y, lattice) if lattice[4] > 0.0 else _periods(y, lattice[1])
    moved = x + up * lattice[3]
    shift[0] = up * lattice[3] + _periods(moved, lattice[0]) * lattice[0]
    shift[1] = up * lattice[1]
    shift[2] = _periods(z, lattice[2]) * lattice[2]


@njit(**_OPTIONS)
def balls(before, after, block):
    """Return balls (fiber, block, 4) around blocks of segments on their straight ways."""
    fibers, nodes, _ = before.shape
    blocks = (nodes - 2) // block + 1
    out = np.empty((fibers, blocks, 4))
    for k in range(fibers):
        for b in range(blocks):
            low, high = b * block, min((b + 1) * block, nodes - 1) + 1
            for d in range(3):
                least, most = np.inf, -np.inf
                for i in range(low, high):
                    least = min(least, before[k, i, d], after[k, i, d])
                    most = max(most, before[k, i, d], after[k, i, d])
                out[k, b, d] = 0.5 * (least + most)
            largest = 0.0
            for i in range(low, high):
                one, other = 0.0, 0.0
                for d in range(3):
                    r = before[k, i, d] - out[k, b, d]
                    one += r * r
                    r = after[k, i, d] - out[k, b, d]
                    other += r * r
                largest = max(largest, one, other)
            out[k, b, 3] = np.sqrt(largest) * (1.0 + 1e-12)
    return out


@njit(**_PART)
def _clipped(value):
    return min(1.0, max(0.0, value))


@njit(**_PART)
def _segment_distance(p, u, q, v):
    """Return the distance between the segments p + [0, 1] u and q + [0, 1] v."""
    a, b, c, e, f = 0.0, 0.0, 0.0, 0.0, 0.0
    for d in range(3):
        w = p[d] - q[d]
        a += u[d] * u[d]
        b += u[d] * v[d]
        c += u[d] * w
        e += v[d] * v[d]
        f += v[d] * w
    determinant = a * e - b * b
    s = _clipped((b * f - c * e) / determinant) if determinant > 1e-14 * a * e else 0.0
    t = (b * s + f) / e
    if t < 0.0 or t > 1.0:
        t = _clipped(t)
        s = _clipped((b * t - c) / a)
    square = 0.0
    for d in range(3):
        r = p[d] + s * u[d] - q[d] - t * v[d]
        square += r * r
    return np.sqrt(square)


@njit(**_PART)
def _placed(x, k, i, p, u):
    """Set the start p and the run u of segment i of fiber k."""
    for d in range(3):
        p[d] = x[k, i, d]
        u[d] = x[k, i + 1, d] - x[k, i, d]


@njit(**_OPTIONS)
def closest(pairs, x, thick, whole, blocks, block, lattice, best, where):
    """Lower `best` to what is least among pairs of fibers (pair, 2).

    `best` holds a distance between centrelines and a gap: a distance less the `thick` (fiber,
    segment) of both. `where` (2, 4) tells the fibers and segments they are at.
    """
    p, u, q, v, shift = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    thickest = np.empty(x.shape[0])
    for k in range(x.shape[0]):
        thickest[k] = thick[k].max()
    segments = x.shape[1] - 1
    for pair in range(pairs.shape[0]):
        k, m = pairs[pair, 0], pairs[pair, 1]
        slack = thickest[k] + thickest[m]
        for one in range(blocks.shape[1]):
            least = _apart(blocks[k, one], whole[m], lattice)
            if least >= best[0] and least - slack >= best[1]:
                continue
            for other in range(one if k == m else 0, blocks.shape[1]):
                least = _apart(blocks[k, one], blocks[m, other], lattice)
                if least >= best[0] and least - slack >= best[1]:
                    continue
                for i in range(one * block, min((one + 1) * block, segments)):
                    _placed(x, k, i, p, u)
                    for j in range(other * block, min((other + 1) * block, segments)):
                        _placed(x, m, j, q, v)
                        _nearest(
                            p[0] + 0.5 * u[0] - q[0] - 0.5 * v[0],
                            p[1] + 0.5 * u[1] - q[1] - 0.5 * v[1],
                            p[2] + 0.5 * u[2] - q[2] - 0.5 * v[2],
                            lattice,
                            shift,
                        )
                        if k == m and not _moves(shift):
                            continue
                        for d in range(3):
                            q[d] -= shift[d]
                        distance = _segment_distance(p, u, q, v)
                        gap = distance - thick[k, i] - thick[m, j]
                        if distance < best[0]:
                            best[0] = distance
                            where[0, 0], where[0, 1], where[0, 2], where[0, 3] = k, i, m, j
                        if gap < best[1]:
                            best[1] = gap
                            where[1, 0], where[1, 1], where[1, 2], where[1, 3] = k, i, m, j


@njit(**_PART)
def _moves(shift):
    return shift[0] != 0.0 or shift[1] != 0.0 or shift[2] != 0.0


@njit(**_PART)
def _volume(x, k, i, m, j, shift):
    """Return six times the volume spanned by two segments, the first shifted."""
    ux, uy, uz = (
        x[k, i + 1, 0] - x[k, i, 0],
        x[k, i + 1, 1] - x[k, i, 1],
        x[k, i + 1, 2] - x[k, i, 2],
    )
    vx, vy, vz = (
        x[m, j + 1, 0] - x[m, j, 0],
        x[m, j + 1, 1] - x[m, j, 1],
        x[m, j + 1, 2] - x[m, j, 2],
    )
    return (
        (uy * vz - uz * vy) * (x[k, i, 0] + shift[0] - x[m, j, 0])
        + (uz * vx - ux * vz) * (x[k, i, 1] + shift[1] - x[m, j, 1])
        + (ux * vy - uy * vx) * (x[k, i, 2] + shift[2] - x[m, j, 2])
    )


@njit(**_PART)
def _ways(before, after, middles):
    """Set middles (fiber, segment, 4): middles before, and how far points get from them."""
    for k in range(before.shape[0]):
        for i in range(before.shape[1] - 1):
            length, first, last = 0.0, 0.0, 0.0
            for d in range(3):
                middles[k, i, d] = 0.5 * (before[k, i, d] + before[k, i + 1, d])
                r = before[k, i + 1, d] - before[k, i, d]
                length += r * r
                r = after[k, i, d] - before[k, i, d]
                first += r * r
                r = after[k, i + 1, d] - before[k, i + 1, d]
                last += r * r
            middles[k, i, 3] = 0.5 * np.sqrt(length) + np.sqrt(max(first, last))


@njit(**_OPTIONS)
def turned_over(pairs, before, after, whole, blocks, block, lattice, found, shifts):
    """Find segments that may meet on their way and whose volume changes sign, among fiber pairs.

    Returns how many; `found` (n, 4) and `shifts` (n, 3) get fibers and segments, and what brings
    the first to the nearest image before, of the first n.
    """
    middles = np.empty((before.shape[0], before.shape[1] - 1, 4))
    _ways(before, after, middles)
    shift, count, segments = np.empty(3), 0, before.shape[1] - 1
    for pair in range(pairs.shape[0]):
        k, m = pairs[pair, 0], pairs[pair, 1]
        for one in range(blocks.shape[1]):
            if _apart(blocks[k, one], whole[m], lattice) > 0.0:
                continue
            for other in range(one if k == m else 0, blocks.shape[1]):
                if _apart(blocks[k, one], blocks[m, other], lattice) > 0.0:
                    continue
                for i in range(one * block, min((one + 1) * block, segments)):
                    for j in range(other * block, min((other + 1) * block, segments)):
                        if _apart(middles[k, i], middles[m, j], lattice) > 0.0:
                            continue
                        _nearest(
                            middles[k, i, 0] - middles[m, j, 0],
                            middles[k, i, 1] - middles[m, j, 1],
                            middles[k, i, 2] - middles[m, j, 2],
                            lattice,
                            shift,
                        )
                        if k == m and not _moves(shift):
                            continue
                        was = _volume(before, k, i, m, j, shift) > 0.0
                        if was == (_volume(after, k, i, m, j, shift) > 0.0):
                            continue
                        if count < found.shape[0]:
                            found[count, 0], found[count, 1] = k, i
                            found[count, 2], found[count, 3] = m, j
                            shifts[count] = shift
                        count += 1
    return count
