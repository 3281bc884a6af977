"""Compiled parts of the Ewald sum: sorting into cells, near lists, near part, own pairs, far modes.

Lengths of the near part are in units of ``rc / sqrt 2``, so that a pair is near if r^2 < 2, and
polynomials (tuples of blocks, ascending) are in ``y = r^2 - 1``. The near part of a pair is

    (q + d q^3 - P_a - d Q_a) f + (q^3 - 3 d q^5 - P_b - d Q_b) (r . f) r,

with q = 1 / r, d = a^2 / 2.

In single precision positions are taken from the middle of the group of targets and held as a whole
number of steps and a rest, so that the difference of close points keeps its digits. Slow twins are
in ``tests/reference``.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"reassoc", "contract", "arcp", "nsz", "afn"},
}
_PLAIN = {"cache": True, "nogil": True, "error_model": "numpy"}
# Parts are inlined and not cached by themselves; see `kernels`.
_PART = {**_OPTIONS, "cache": False, "forceinline": True}
_STEP = 2.0**-20
_GRID = 2.0**20
_EXACT = {**_PLAIN, "cache": False, "forceinline": True}


# --- cells and near lists ---------------------------------------------------------------------


@njit(**_PLAIN)
def count_shared(points, origin, side, slots):
    """Return how many of the points (3, n) fall into each slot: cells of `side`, hashed."""
    counts = np.zeros(slots, dtype=np.int64)
    for j in range(points.shape[1]):
        code = np.int64(0)
        for d in range(3):
            cell = np.int64(np.floor((points[d, j] - origin[d]) / side))
            code = (code * 1000003) ^ cell
        counts[code % slots] += 1
    return counts


@njit(**_PLAIN)
def sort_into_cells(points, origin, sides, counts):
    """Return the order of points (3, n) by cell, x fastest, and where each cell starts."""
    n = points.shape[1]
    cells = counts[0] * counts[1] * counts[2]
    cell_of = np.empty(n, dtype=np.int64)
    start = np.zeros(cells + 1, dtype=np.int64)
    for j in range(n):
        code = 0
        for d in (2, 1, 0):
            c = np.int64((points[d, j] - origin[d]) / sides[d])
            code = code * counts[d] + min(max(c, 0), counts[d] - 1)
        cell_of[j] = code
        start[code + 1] += 1
    for c in range(cells):
        start[c + 1] += start[c]
    place = start[:-1].copy()
    order = np.empty(n, dtype=np.int64)
    for j in range(n):
        order[place[cell_of[j]]] = j
        place[cell_of[j]] += 1
    return order, start


@njit(**_PLAIN)
def target_groups(points, start, most):
    """Return bounds (group + 1,) of groups of at most `most` sorted targets of one cell.

    Also their boxes (group, 6): least and largest x, y, z.
    """
    count = 0
    for c in range(start.size - 1):
        count += (start[c + 1] - start[c] + most - 1) // most
    bounds = np.zeros(count + 1, dtype=np.int64)
    boxes = np.empty((count, 6))
    g = 0
    for c in range(start.size - 1):
        i = start[c]
        while i < start[c + 1]:
            stop = min(i + most, start[c + 1])
            bounds[g + 1] = stop
            for d in range(3):
                low, high = points[d, i], points[d, i]
                for j in range(i + 1, stop):
                    low, high = min(low, points[d, j]), max(high, points[d, j])
                boxes[g, d], boxes[g, d + 3] = low, high
            i = stop
            g += 1
    return bounds, boxes


@njit(**_EXACT)
def _gap(low, high, a, b):
    """Return the distance between the intervals [low, high] and [a, b]."""
    return max(0.0, max(a - high, low - b))


@njit(**_EXACT)
def _row(points, j0, j1, box, shift, rc2, code, last, fill, index, at, runs, codes, run):
    """Append the points j0 ... j1, moved by `shift`, that are within rc of the box."""
    for j in range(j0, j1):
        r2 = 0.0
        for d in range(3):
            x = points[d, j] + shift[d]
            gap = _gap(box[d], box[d + 3], x, x)
            r2 += gap * gap
        if r2 < rc2:
            if code != last:
                if fill:
                    codes[run] = code
                run += 1
                last = code
            if fill:
                index[at] = j
                runs[run - 1] = at + 1
            at += 1
    return at, run, last


@njit(**_PLAIN)
def near_lists(
    first, stop, boxes, points, start, grid, periods, offset, rc, fill, heads, index, runs, codes
):
    """Count or fill the near lists of groups first ... stop.

    Parameters
    ----------
    boxes
        Of the groups, (group, 6).
    points, start
        Sorted sources (3, n) and where each cell starts.
    grid
        (origin (3,), sides (3,), counts (3,)) of the cells.
    periods, offset
        Periods (3,), infinite where free, and how far along x the image one period up in y is.
    fill
        With False, heads[g] becomes (entries, runs) of each group. With True, heads[g] holds
        where they begin, and index, runs (end of each run in index) and codes (image of each) are
        set.
    """
    origin, sides, counts = grid
    shift = np.empty(3)
    whole = np.empty(3, dtype=np.int64)
    rc2 = rc * rc * (1.0 + 1e-9)
    reach = rc * (1.0 + 1e-9)
    low, high = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for g in range(first, stop):
        box = boxes[g]
        at, run, last = (heads[g, 0], heads[g, 1], -1) if fill else (0, 0, -1)
        for d in range(1, 3):
            low[d] = np.int64(np.floor((box[d] - reach - origin[d]) / sides[d]))
            high[d] = np.int64(np.floor((box[d + 3] + reach - origin[d]) / sides[d]))
            if periods[d] == np.inf:
                low[d], high[d] = max(low[d], 0), min(high[d], counts[d] - 1)
                # a point on the upper border is in the last cell, which ends there
                low[d] = min(low[d], counts[d] - 1)
        for cz in range(low[2], high[2] + 1):
            whole[2] = np.int64(np.floor(cz / counts[2]))
            shift[2] = whole[2] * periods[2] if whole[2] != 0 else 0.0
            edge = origin[2] + cz * sides[2]
            dz = _gap(box[2], box[5], edge, edge + sides[2])
            for cy in range(low[1], high[1] + 1):
                whole[1] = np.int64(np.floor(cy / counts[1]))
                shift[1] = whole[1] * periods[1] if whole[1] != 0 else 0.0
                edge = origin[1] + cy * sides[1]
                dy = _gap(box[1], box[4], edge, edge + sides[1])
                left = rc2 - dy * dy - dz * dz
                if left <= 0.0:
                    continue
                left = np.sqrt(left)
                slide = whole[1] * offset
                begin, end = box[0] - left - slide - origin[0], box[3] + left - slide - origin[0]
                base = counts[0] * (
                    (cy - whole[1] * counts[1]) + counts[1] * (cz - whole[2] * counts[2])
                )
                c0, c1 = np.int64(np.floor(begin / sides[0])), np.int64(np.floor(end / sides[0]))
                if periods[0] == np.inf:
                    c0, c1 = min(max(c0, 0), counts[0] - 1), min(max(c1, 0), counts[0] - 1)
                wx = np.int64(np.floor(c0 / counts[0]))
                while wx * counts[0] <= c1:
                    a, b = max(c0 - wx * counts[0], 0), min(c1 - wx * counts[0], counts[0] - 1)
                    shift[0] = slide + (wx * periods[0] if wx != 0 else 0.0)
                    code = (wx + 3) * 9 + (whole[1] + 1) * 3 + whole[2] + 1
                    at, run, last = _row(
                        points,
                        start[base + a],
                        start[base + b + 1],
                        box,
                        shift,
                        rc2,
                        code,
                        last,
                        fill,
                        index,
                        at,
                        runs,
                        codes,
                        run,
                    )
                    wx += 1
        if not fill:
            heads[g, 0], heads[g, 1] = at, run


# --- near part --------------------------------------------------------------------------------


@njit(**_PART)
def _block(c, y):
    value = c[len(c) - 1]
    for k in range(len(c) - 2, -1, -1):
        value = value * y + c[k]
    return value


@njit(**_PART)
def _polynomial(blocks, y):
    """Return a polynomial in blocks of seven coefficients: loops that short are unrolled."""
    value = _block(blocks[len(blocks) - 1], y)
    y2 = y * y
    y7 = y2 * y2 * y2 * y
    for k in range(len(blocks) - 2, -1, -1):
        value = value * y7 + _block(blocks[k], y)
    return value


@njit(**_PART)
def _apart(high, low, other_high, other_low, step):
    """Return a difference of numbers in two parts; whole parts keep it exact for close ones."""
    return np.float32(np.int32(high - other_high)) * step + (low - other_low)


@njit(**_PART)
def _low_part(value, high):
    return np.float32(value - high * _STEP)


@njit(**_PART)
def _near_factors(r2, own, d, polynomials, numbers):
    """Return what multiplies f and (r . f) r; zero beyond rc and for own pairs."""
    zero, one, two, three = numbers
    pa, pb, qa, qb = polynomials
    y = r2 - one
    safe = r2 if r2 > zero else one
    q = one / np.sqrt(safe)
    q = q if r2 > zero else zero
    q2 = q * q
    dq2 = d * q2
    on_force = q + q * dq2 - (_polynomial(pa, y) + d * _polynomial(qa, y))
    on_r = q2 * q * (one - three * dq2) - (_polynomial(pb, y) + d * _polynomial(qb, y))
    near = (r2 < two) & (not own)
    return (on_force if near else zero), (on_r if near else zero)


@njit(**_PART)
def _gather_single(g, heads, index, runs, codes, points, keys, force, d, table, jump, mid, s):
    """Fill the buffers with the sources near group g; return how many."""
    buffer, whole = s
    scale = table[0, 3]
    at, run = heads[g, 0], heads[g, 1]
    n = 0
    while run < heads[g + 1, 1]:
        code = codes[run]
        sx, sy, sz = table[code, 0] - mid[0], table[code, 1] - mid[1], table[code, 2] - mid[2]
        less = jump[code]
        for k in range(at, runs[run]):
            j = index[k]
            x, y, z = scale * (points[0, j] + sx), scale * (points[1, j] + sy), 0.0
            z = scale * (points[2, j] + sz)
            hx, hy, hz = np.int32(x * _GRID), np.int32(y * _GRID), np.int32(z * _GRID)
            i = n + k - at
            whole[0, i], whole[1, i], whole[2, i] = hx, hy, hz
            buffer[0, i], buffer[1, i] = _low_part(x, hx), _low_part(y, hy)
            buffer[2, i] = _low_part(z, hz)
            buffer[3, i], buffer[4, i], buffer[5, i] = force[0, j], force[1, j], force[2, j]
            buffer[6, i] = d[j]
            whole[3, i] = keys[j] - less
        n += runs[run] - at
        at = runs[run]
        run += 1
    return n


@njit(**_PART)
def _gather_double(g, heads, index, runs, codes, points, keys, force, d, table, jump, mid, s):
    """Fill the buffers with the sources near group g; return how many."""
    buffer, key = s
    scale = table[0, 3]
    at, run = heads[g, 0], heads[g, 1]
    n = 0
    while run < heads[g + 1, 1]:
        code = codes[run]
        sx, sy, sz = table[code, 0] - mid[0], table[code, 1] - mid[1], table[code, 2] - mid[2]
        less = jump[code]
        for k in range(at, runs[run]):
            j = index[k]
            i = n + k - at
            buffer[0, i] = scale * (points[0, j] + sx)
            buffer[1, i] = scale * (points[1, j] + sy)
            buffer[2, i] = scale * (points[2, j] + sz)
            buffer[3, i], buffer[4, i], buffer[5, i] = force[0, j], force[1, j], force[2, j]
            buffer[6, i] = d[j]
            key[i] = keys[j] - less
        n += runs[run] - at
        at = runs[run]
        run += 1
    return n


@njit(**_OPTIONS)
def near_single(
    first, stop, bounds, boxes, lists, targets, target_keys, sources, polynomials, numbers, out
):
    """Add the near part to out (target, 3), sorted, for groups first ... stop; single precision.

    Parameters
    ----------
    lists
        (heads, index, runs, codes, most): near lists, and the entries of the longest.
    targets, target_keys
        Sorted, (3, m) and (m,).
    sources
        (points (3, n), keys (n,), force (3, n), d (n,), table (image, 4), jump (image,)): sorted;
        table holds each image's shift and the scale, jump what it takes from a key.
    polynomials
        (P_a, P_b, Q_a, Q_b).
    numbers
        0, 1, 2, 3 in the precision.
    """
    heads, index, runs, codes, most = lists
    points, keys, force, d, table, jump = sources
    buffer = np.empty((7, most + 16), dtype=np.float32)
    whole = np.empty((4, most + 16), dtype=np.int32)
    step = np.float32(_STEP)
    mid = np.empty(3)
    scale = table[0, 3]
    zero = numbers[0]
    for g in range(first, stop):
        size = 0.0
        for k in range(3):
            mid[k] = 0.5 * (boxes[g, k] + boxes[g, k + 3])
            size = max(size, boxes[g, k + 3] - boxes[g, k])
        n = _gather_single(
            g,
            heads,
            index,
            runs,
            codes,
            points,
            keys,
            force,
            d,
            table,
            jump,
            mid,
            (buffer, whole),
        )
        full = (n + 15) // 16 * 16
        for i in range(n, full):
            buffer[:, i] = zero
            whole[:, i] = 0
            whole[0, i] = np.int32((scale * size + 4.0) * _GRID)
            whole[3, i] = -2
        for t in range(bounds[g], bounds[g + 1]):
            x, y = scale * (targets[0, t] - mid[0]), scale * (targets[1, t] - mid[1])
            z = scale * (targets[2, t] - mid[2])
            tx, ty, tz = np.int32(x * _GRID), np.int32(y * _GRID), np.int32(z * _GRID)
            lx, ly, lz = _low_part(x, tx), _low_part(y, ty), _low_part(z, tz)
            mine = target_keys[t]
            ox, oy, oz = zero, zero, zero
            for j in range(full):
                rx = _apart(tx, lx, whole[0, j], buffer[0, j], step)
                ry = _apart(ty, ly, whole[1, j], buffer[1, j], step)
                rz = _apart(tz, lz, whole[2, j], buffer[2, j], step)
                r2 = rx * rx + ry * ry + rz * rz
                a, b = _near_factors(r2, whole[3, j] == mine, buffer[6, j], polynomials, numbers)
                fx, fy, fz = buffer[3, j], buffer[4, j], buffer[5, j]
                b *= rx * fx + ry * fy + rz * fz
                ox += a * fx + b * rx
                oy += a * fy + b * ry
                oz += a * fz + b * rz
            out[t, 0] += scale * ox
            out[t, 1] += scale * oy
            out[t, 2] += scale * oz


@njit(**_OPTIONS)
def near_double(
    first, stop, bounds, boxes, lists, targets, target_keys, sources, polynomials, numbers, out
):
    """Do what `near_single` does in double precision."""
    heads, index, runs, codes, most = lists
    points, keys, force, d, table, jump = sources
    buffer = np.empty((7, most + 16))
    key = np.empty(most + 16, dtype=np.int32)
    mid = np.empty(3)
    scale = table[0, 3]
    zero = numbers[0]
    for g in range(first, stop):
        size = 0.0
        for k in range(3):
            mid[k] = 0.5 * (boxes[g, k] + boxes[g, k + 3])
            size = max(size, boxes[g, k + 3] - boxes[g, k])
        n = _gather_double(
            g,
            heads,
            index,
            runs,
            codes,
            points,
            keys,
            force,
            d,
            table,
            jump,
            mid,
            (buffer, key),
        )
        full = (n + 15) // 16 * 16
        for i in range(n, full):
            buffer[:, i] = zero
            buffer[0, i] = scale * size + 4.0
            key[i] = -2
        for t in range(bounds[g], bounds[g + 1]):
            tx, ty = scale * (targets[0, t] - mid[0]), scale * (targets[1, t] - mid[1])
            tz = scale * (targets[2, t] - mid[2])
            mine = target_keys[t]
            ox, oy, oz = zero, zero, zero
            for j in range(full):
                rx, ry, rz = tx - buffer[0, j], ty - buffer[1, j], tz - buffer[2, j]
                r2 = rx * rx + ry * ry + rz * rz
                a, b = _near_factors(r2, key[j] == mine, buffer[6, j], polynomials, numbers)
                fx, fy, fz = buffer[3, j], buffer[4, j], buffer[5, j]
                b *= rx * fx + ry * fy + rz * fz
                ox += a * fx + b * rx
                oy += a * fy + b * ry
                oz += a * fz + b * rz
            out[t, 0] += scale * ox
            out[t, 1] += scale * oy
            out[t, 2] += scale * oz


# --- own pairs --------------------------------------------------------------------------------


@njit(**_OPTIONS)
def own_pairs(
    first, stop, heads, members, target_heads, target_members, points, targets, force, d, scale,
    polynomials, out,
):  # fmt: skip
    """Subtract from out (target, 3) the far part of pairs on one filament in the same image.

    Within rc that is the polynomials, beyond it the whole kernel. All arrays are in the order
    given by the user, positions (n, 3) unwrapped; heads and members list the sources of each
    filament, target_heads and target_members its targets; filaments first ... stop are done.
    """
    pa, pb, qa, qb = polynomials
    most = 0
    for filament in range(first, stop):
        most = max(most, heads[filament + 1] - heads[filament])
    b = np.empty((7, most))
    for filament in range(first, stop):
        n = heads[filament + 1] - heads[filament]
        if n == 0:
            continue
        origin = points[members[heads[filament]]]
        for k in range(n):
            j = members[heads[filament] + k]
            for c in range(3):
                b[c, k] = scale * (points[j, c] - origin[c])
                b[c + 3, k] = force[j, c]
            b[6, k] = d[j]
        for k in range(target_heads[filament], target_heads[filament + 1]):
            t = target_members[k]
            tx, ty = scale * (targets[t, 0] - origin[0]), scale * (targets[t, 1] - origin[1])
            tz = scale * (targets[t, 2] - origin[2])
            ox, oy, oz = 0.0, 0.0, 0.0
            for j in range(n):
                rx, ry, rz = tx - b[0, j], ty - b[1, j], tz - b[2, j]
                r2 = rx * rx + ry * ry + rz * rz
                y = min(r2, 2.0) - 1.0
                on_force = _polynomial(pa, y) + b[6, j] * _polynomial(qa, y)
                on_r = _polynomial(pb, y) + b[6, j] * _polynomial(qb, y)
                q2 = 1.0 / max(r2, 2.0)
                q = np.sqrt(q2)
                far_force, far_r = q * (1.0 + b[6, j] * q2), q * q2 * (1.0 - 3.0 * b[6, j] * q2)
                on_force, on_r = (
                    (on_force if r2 < 2.0 else far_force),
                    (on_r if r2 < 2.0 else far_r),
                )
                fx, fy, fz = b[3, j], b[4, j], b[5, j]
                on_r *= rx * fx + ry * fy + rz * fz
                ox += on_force * fx + on_r * rx
                oy += on_force * fy + on_r * ry
                oz += on_force * fz + on_r * rz
            out[t, 0] -= scale * ox
            out[t, 1] -= scale * oy
            out[t, 2] -= scale * oz


# --- far part ---------------------------------------------------------------------------------


@njit(**_EXACT)
def _pair_of_modes(a, b, i, j, m, i2, j2, m2, kx, ky, kz, weight):
    """Multiply the modes k and -k of f_x + i f_y (a) and f_z (b) by weight (I - kk / k^2)."""
    p, n = a[i, j, m], a[i2, j2, m2].conjugate()
    xr, xi = 0.5 * (p.real + n.real), 0.5 * (p.imag + n.imag)
    yr, yi = 0.5 * (p.imag - n.imag), 0.5 * (n.real - p.real)
    zr, zi = b[i, j, m].real, b[i, j, m].imag
    less = 1.0 / max(kx * kx + ky * ky + kz * kz, 1e-300)
    along_r = less * (kx * xr + ky * yr + kz * zr)
    along_i = less * (kx * xi + ky * yi + kz * zi)
    xr, xi = weight * (xr - kx * along_r), weight * (xi - kx * along_i)
    yr, yi = weight * (yr - ky * along_r), weight * (yi - ky * along_i)
    zr, zi = weight * (zr - kz * along_r), weight * (zi - kz * along_i)
    a[i, j, m] = complex(xr - yi, xi + yr)
    b[i, j, m] = complex(zr, zi)
    a[i2, j2, m2] = complex(xr + yi, yr - xi)
    b[i2, j2, m2] = complex(zr, -zi)


@njit(**_PLAIN)
def multiply_modes(i, a, b, weights, kx, ky, kz, slant):
    """Multiply the planes i and -i of spectra in FFT order by the weights and the projection.

    `weights` (nx/2, ny, nz) are those of planes 0 <= i < nx/2. The plane i = nx/2 and all other
    modes without a partner become zero, and so does k = 0. `slant` is added to ky per kx:
    ``k_y = ky - slant kx`` of a sheared cell.
    """
    nx, ny, nz = a.shape
    i2 = (nx - i) % nx
    if i == nx // 2:
        a[i], b[i] = 0.0, 0.0
        return
    for j in range(ny):
        if i == 0 and j > ny // 2:
            break
        j2 = (ny - j) % ny
        own_row = i == 0 and j2 == j
        if j == ny // 2:
            a[i, j], b[i, j] = 0.0, 0.0
            a[i2, j], b[i2, j] = 0.0, 0.0
            continue
        y = ky[j] - slant * kx[i]
        for m in range(nz):
            m2 = (nz - m) % nz
            if m == nz // 2 or (own_row and m == 0):
                a[i, j, m], b[i, j, m] = 0.0, 0.0
                a[i2, j2, m2], b[i2, j2, m2] = 0.0, 0.0
                continue
            if own_row and m > nz // 2:
                break
            _pair_of_modes(a, b, i, j, m, i2, j2, m2, kx[i], y, kz[m], weights[i, j, m])


@njit(**_PLAIN)
def fill_weights(i, kx, ky, kz, slant, k_max, series, quarter, out):
    """Set plane i of out (nx/2, ny, nz) to ``gamma (1 - quarter k^2)``.

    gamma is a Chebyshev series in ``2 k^2 / k_max^2 - 1``, zero beyond k_max.
    """
    for j in range(ky.size):
        y = ky[j] - slant * kx[i]
        for m in range(kz.size):
            k2 = kx[i] * kx[i] + y * y + kz[m] * kz[m]
            x2 = 4.0 * k2 / (k_max * k_max) - 2.0
            if x2 > 2.0:
                out[i, j, m] = 0.0
                continue
            ahead, value = 0.0, 0.0
            for n in range(series.size - 1, 0, -1):
                ahead, value = value, series[n] + x2 * value - ahead
            value = series[0] + 0.5 * x2 * value - ahead
            out[i, j, m] = value * (1.0 - quarter * k2)


@njit(**_PLAIN)
def add_doublets(i, a, b, second, third, kx, ky, kz, slant):
    """Add ``-k^2/4`` times the spectra of a_j^2 f_j to those of f_j, plane i."""
    for j in range(a.shape[1]):
        y = ky[j] - slant * kx[i]
        for m in range(a.shape[2]):
            k2 = kx[i] * kx[i] + y * y + kz[m] * kz[m]
            w = 0.25 * k2
            a[i, j, m] -= complex(w * second[i, j, m].real, w * second[i, j, m].imag)
            b[i, j, m] -= complex(w * third[i, j, m].real, w * third[i, j, m].imag)
