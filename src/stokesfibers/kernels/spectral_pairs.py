"""Compiled sums over other fibers in Legendre modes: (7) + (8) by quadrature, close approach.

Arrays are component first. Velocities are those of ``V + D W`` with D = (eps L)^2 / 2, times
8 pi mu and without the minus of (6). A source that a target is far from is summed over its own N
Gauss-Legendre nodes. Near ones get a row: the velocity per Legendre coefficient of the force, by a
rule whose points gather where the source comes nearest. With ``s' = a + b sinh t``, a + i b the
complex root of |R|^2 there, the kernel is smooth in t. A source that comes near several times is
cut in between. Targets of one fiber are handled by one call; calls are independent and release the
GIL. Slow twins are in ``tests/reference``; why this rule: ``docs/theory/near.md``.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from stokesfibers.kernels.pairs import blend_weight

_OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"reassoc", "contract", "arcp", "nsz"},
}
# Parts are inlined and not cached by themselves; see `kernels`.
_PART = {**_OPTIONS, "cache": False, "forceinline": True}
_MOST_SEARCHES = 60
_MOST_ROOTS = 8  # Newton steps for a complex root
_NOTICED = 5.0  # reaches within which another approach of a source is resolved by itself
# Points of a rule, fitted to what integrals of P_k (s - a)^j / |R|^m need for all k < N: modes and
# digits ask for points, and half of the weaker wish comes on top of the stronger.
_WIDTH = 1.5  # distance in t of the kernel's poles from the real axis, pi/2 if it were straight
_PER_MODE, _PER_MODE_AND_DEPTH = 0.58, 0.147
_PER_DIGIT, _PER_DIGIT_ALONE = 0.47, 0.34


@njit(**_PART)
def _plain(px, py, pz, x, force, doublet):
    """Return the sum of V + D W over the nodes of one source; forces carry their weights."""
    ox, oy, oz = 0.0, 0.0, 0.0
    for j in range(x.shape[1]):
        rx, ry, rz = px - x[0, j], py - x[1, j], pz - x[2, j]
        fx, fy, fz = force[0, j], force[1, j], force[2, j]
        inverse2 = 1.0 / (rx * rx + ry * ry + rz * rz)
        inverse = np.sqrt(inverse2)
        inverse3 = inverse * inverse2
        on_force = inverse + doublet * inverse3
        along = (rx * fx + ry * fy + rz * fz) * inverse3 * (1.0 - 3.0 * doublet * inverse2)
        ox += on_force * fx + along * rx
        oy += on_force * fy + along * ry
        oz += on_force * fz + along * rz
    return ox, oy, oz


@njit(**_PART)
def _curve_at(p, series, sigma, at):
    """Set at (3, 3) to x - p, dx/dsigma, d2x/dsigma2 of Legendre coefficients `series` (3, n)."""
    z = 2.0 * sigma - 1.0
    p0, p1, d0, d1, c0, c1 = 1.0, z, 0.0, 1.0, 0.0, 0.0
    for d in range(3):
        at[0, d] = series[d, 0] - p[d] + series[d, 1] * z
        at[1, d] = series[d, 1]
        at[2, d] = 0.0
    for k in range(2, series.shape[1]):
        # P'_k = P'_{k-2} + (2 k - 1) P_{k-1}, and alike for P''
        p2 = ((2 * k - 1) * z * p1 - (k - 1) * p0) / k
        d2 = d0 + (2 * k - 1) * p1
        c2 = c0 + (2 * k - 1) * d1
        for d in range(3):
            at[0, d] += series[d, k] * p2
            at[1, d] += series[d, k] * d2
            at[2, d] += series[d, k] * c2
        p0, p1, d0, d1, c0, c1 = p1, p2, d1, d2, c1, c2
    for d in range(3):
        at[1, d] *= 2.0
        at[2, d] *= 4.0


@njit(**_PART)
def _nearest_within(p, series, low, high, at):
    """Return the fraction in [low, high] nearest to p, and the distance, by safeguarded Newton."""
    sigma, found = 0.5 * (low + high), -1.0
    for end in range(2):
        # an end of the fiber is nearest if the distance grows from there inwards
        edge = low if end == 0 else high
        if (end == 0 and low == 0.0) or (end == 1 and high == 1.0):
            _curve_at(p, series, edge, at)
            slope = at[0, 0] * at[1, 0] + at[0, 1] * at[1, 1] + at[0, 2] * at[1, 2]
            if (slope >= 0.0) == (end == 0):
                found = edge
                break
    if found >= 0.0:
        sigma = found
    else:
        for _ in range(_MOST_SEARCHES):
            _curve_at(p, series, sigma, at)
            slope, bend = 0.0, 0.0
            for d in range(3):
                slope += at[0, d] * at[1, d]
                bend += at[1, d] * at[1, d] + at[0, d] * at[2, d]
            if slope > 0.0:
                high = sigma
            else:
                low = sigma
            ahead = sigma - slope / bend if bend > 0.0 else -1.0
            if not low <= ahead <= high:
                ahead = 0.5 * (low + high)
            moved = abs(ahead - sigma)
            sigma = ahead
            if moved < 1e-15:
                break
        _curve_at(p, series, sigma, at)
    rx, ry, rz = at[0, 0], at[0, 1], at[0, 2]
    return sigma, np.sqrt(rx * rx + ry * ry + rz * rz)


@njit(**_PART)
def _times(a, b):
    """Return the product of complex numbers (real, imaginary)."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


@njit(**_PART)
def _size(a, b):
    """Return |a + i b|."""
    return np.sqrt(a * a + b * b)


@njit(**_PART)
def _root(p, series, sigma, at):
    """Return a and b of the root a + i b of |x(sigma) - p|^2 = 0 that belongs to an approach.

    `at` holds the curve at the nearest fraction `sigma`. Where Newton's method finds no root near
    the quadratic estimate, that is returned.
    """
    square, slope, speed, bend = 0.0, 0.0, 0.0, 0.0
    for d in range(3):
        square += at[0, d] * at[0, d]
        slope += at[0, d] * at[1, d]
        speed += at[1, d] * at[1, d]
        bend += at[0, d] * at[2, d]
    bend = max(speed + bend, 0.1 * speed)
    ahead = -slope / bend
    a0, b0 = sigma + ahead, np.sqrt(max(square / bend - ahead * ahead, 0.0))
    a, b, moved = a0, b0, 1.0
    for _ in range(_MOST_ROOTS):
        z = (2.0 * a - 1.0, 2.0 * b)
        value_r, value_i, change_r, change_i = 0.0, 0.0, 0.0, 0.0
        for d in range(3):
            p0, p1, d0, d1 = (1.0, 0.0), z, (0.0, 0.0), (1.0, 0.0)
            c0, c1 = series[d, 0] - p[d], series[d, 1]
            r, rs = (c0 + c1 * z[0], c1 * z[1]), (c1, 0.0)
            for k in range(2, series.shape[1]):
                g, h, odd, c = (2.0 * k - 1.0) / k, (k - 1.0) / k, 2.0 * k - 1.0, series[d, k]
                q = _times(z, p1)
                p2 = (g * q[0] - h * p0[0], g * q[1] - h * p0[1])
                d2 = (d0[0] + odd * p1[0], d0[1] + odd * p1[1])
                r = (r[0] + c * p2[0], r[1] + c * p2[1])
                rs = (rs[0] + c * d2[0], rs[1] + c * d2[1])
                p0, p1, d0, d1 = p1, p2, d1, d2
            more, faster = _times(r, r), _times(r, rs)
            value_r += more[0]
            value_i += more[1]
            change_r += 4.0 * faster[0]
            change_i += 4.0 * faster[1]
        less = 1.0 / (change_r * change_r + change_i * change_i)
        step = _times((value_r, value_i), (less * change_r, -less * change_i))
        a -= step[0]
        b -= step[1]
        moved = _size(step[0], step[1])
        if moved < 1e-3 * b0:
            break
    if moved < 1e-2 * b0 and _size(a - a0, b - b0) < 0.8 * b0:
        return a, b
    return a0, b0


@njit(**_PART)
def _rule_size(low, high, modes, digits, sizes):
    """Return the index of the smallest rule that resolves a piece from `low` to `high` in t.

    `modes` counts the oscillations that the piece holds.
    """
    q = 2.0 * _WIDTH / (high - low)
    depth = max(-low, high)
    oscillating = (_PER_MODE + _PER_MODE_AND_DEPTH * depth) * modes
    peaked = _PER_DIGIT * digits / np.log(q + np.sqrt(q * q + 1.0))
    wanted = (oscillating**1.5 + peaked**1.5) ** (2.0 / 3.0) + _PER_DIGIT_ALONE * digits
    rule = 0
    while rule < sizes.size - 1 and sizes[rule] < wanted:
        rule += 1
    return rule


@njit(**_PART)
def _add_piece(p, series, length, doublet, weight, piece, rule, work, values, row):
    """Add `weight` times the velocity per Legendre coefficient by one piece of the source to row.

    `piece` is (low, high, a, b): the ends in t, and what takes t to fractions of the length.
    `rule` (2, n) holds nodes and weights on [-1, 1].
    """
    low, high, middle, b = piece
    n, count = rule.shape[1], row.shape[1]
    z, share = work[0], work[1]
    rx, ry, rz = work[2], work[3], work[4]
    xx, yy, zz, xy, xz, yz = work[5], work[6], work[7], work[8], work[9], work[10]
    for q in range(n):
        t = 0.5 * (low + high) + 0.5 * (high - low) * rule[0, q]
        e = np.exp(t)
        u = 0.5 * b * (e - 1.0 / e)
        share[q] = 0.25 * b * (e + 1.0 / e) * (high - low) * rule[1, q] * length * weight
        z[q] = 2.0 * (middle + u) - 1.0
        rx[q] = p[0] - series[0, 0] - series[0, 1] * z[q]
        ry[q] = p[1] - series[1, 0] - series[1, 1] * z[q]
        rz[q] = p[2] - series[2, 0] - series[2, 1] * z[q]
        values[0, q], values[1, q] = 1.0, z[q]
    for k in range(2, series.shape[1]):
        sx, sy, sz = series[0, k], series[1, k], series[2, k]
        g, h = (2.0 * k - 1.0) / k, (k - 1.0) / k
        older, newer, target = values[k - 2], values[k - 1], values[k]
        for q in range(n):
            fresh = g * z[q] * newer[q] - h * older[q]
            target[q] = fresh
            rx[q] -= sx * fresh
            ry[q] -= sy * fresh
            rz[q] -= sz * fresh
    for q in range(n):
        inverse2 = 1.0 / (rx[q] * rx[q] + ry[q] * ry[q] + rz[q] * rz[q])
        inverse = np.sqrt(inverse2) * share[q]
        inverse3 = inverse * inverse2
        on_force = inverse + doublet * inverse3
        along = inverse3 * (1.0 - 3.0 * doublet * inverse2)
        ax, ay, az = along * rx[q], along * ry[q], along * rz[q]
        xx[q], yy[q], zz[q] = on_force + ax * rx[q], on_force + ay * ry[q], on_force + az * rz[q]
        xy[q], xz[q], yz[q] = ax * ry[q], ax * rz[q], ay * rz[q]
    for k in range(count):
        target = values[k]
        sxx, syy, szz, sxy, sxz, syz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for q in range(n):
            value = target[q]
            sxx += xx[q] * value
            syy += yy[q] * value
            szz += zz[q] * value
            sxy += xy[q] * value
            sxz += xz[q] * value
            syz += yz[q] * value
        row[0, k] += sxx
        row[1, k] += syy
        row[2, k] += szz
        row[3, k] += sxy
        row[4, k] += sxz
        row[5, k] += syz


@njit(**_PART)
def _square(p, x, j):
    rx, ry, rz = p[0] - x[0, j], p[1] - x[1, j], p[2] - x[2, j]
    return rx * rx + ry * ry + rz * rz


@njit(**_PART)
def _fill_row(p, x, series, sigma, settings, rules, scratch, row, blend):
    """Set row (6, N) and blend (N,): velocity per coefficient of the force and of Lambda f + K f.

    `settings` is (length, doublet, reach, modes, d0, smooth, digits).
    """
    length, doublet, reach, modes, d0, smooth, digits = settings
    nodes, weights, sizes = rules
    ends, roots, middles, distances, work, values, at = scratch
    lows, highs = ends[0], ends[1]
    n = x.shape[1]
    noticed2 = _NOTICED * reach * _NOTICED * reach
    row[:] = 0.0
    blend[:] = 0.0
    pieces, cut, deepest, best = 0, 0.0, -1.0, 0
    for j in range(n):
        own = _square(p, x, j)
        before = _square(p, x, j - 1) if j > 0 else np.inf
        after = _square(p, x, j + 1) if j < n - 1 else np.inf
        if pieces > 0 and own > deepest:
            deepest, cut = own, sigma[j]
        if own < noticed2 and own <= before and own < after:
            if pieces > 0:
                highs[pieces - 1] = cut
            lows[pieces] = cut if pieces > 0 else 0.0
            low, high = sigma[j - 1] if j > 0 else 0.0, sigma[j + 1] if j < n - 1 else 1.0
            middle, distance = _nearest_within(p, series, low, high, at)
            middles[pieces], distances[pieces] = middle, distance
            roots[0, pieces], roots[1, pieces] = middle, distance / length
            if 0.0 < middle < 1.0:
                roots[0, pieces], roots[1, pieces] = _root(p, series, middle, at)
            if distances[pieces] < distances[best]:
                best = pieces
            pieces += 1
            deepest = -1.0
    highs[pieces - 1] = 1.0
    w = blend_weight(distances[best], d0, smooth)
    if w > 0.0:
        for m in range(pieces):
            a, b = roots[0, m], roots[1, m]
            low, high = np.arcsinh((lows[m] - a) / b), np.arcsinh((highs[m] - a) / b)
            r = _rule_size(low, high, (highs[m] - lows[m]) * modes, digits, sizes)
            rule = np.empty((2, sizes[r]))
            rule[0] = nodes[r, : sizes[r]]
            rule[1] = weights[r, : sizes[r]]
            piece = (low, high, a, b)
            _add_piece(p, series, length, doublet, w, piece, rule, work, values, row)
    if w < 1.0:
        z = 2.0 * middles[best] - 1.0
        older, newer = 1.0, z
        blend[0], blend[1] = 1.0 - w, (1.0 - w) * z
        for k in range(2, n):
            older, newer = newer, ((2 * k - 1) * z * newer - (k - 1) * older) / k
            blend[k] = (1.0 - w) * newer


@njit(**_PART)
def _scratch(n, terms, most):
    """Return the working memory of `_fill_row`."""
    return (
        np.empty((2, n)),
        np.empty((2, n)),
        np.empty(n),
        np.empty(n),
        np.empty((11, most)),
        np.empty((terms, most)),
        np.empty((3, 3)),
    )


@njit(**_PART)
def _least_square(p, x):
    """Return the smallest squared distance of p from the nodes x (3, N)."""
    least = np.inf
    for j in range(x.shape[1]):
        least = min(least, _square(p, x, j))
    return least


@njit(**_PART)
def _radius(x):
    """Return the largest distance of the nodes x (3, N) from the middle one."""
    most, middle = 0.0, x[:, x.shape[1] // 2]
    for j in range(x.shape[1]):
        most = max(most, _square(middle, x, j))
    return np.sqrt(most)


@njit(**_PART)
def _is_near(p, x, series, sigma, extent, at):
    """Return whether the nodes of a source are not enough for its velocity at p.

    `extent` is (reach, widest, rho, radius): within the reach they never are; from there to the
    widest, where the source is bent, if a root of |R|^2 lies within the ellipse `rho` about the
    source. No node is farther than `radius` from the middle one.
    """
    reach, widest, rho, radius = extent
    if np.sqrt(_square(p, x, x.shape[1] // 2)) > widest + radius:
        return False
    least = _least_square(p, x)
    if least < reach * reach:
        return True
    if least >= widest * widest:
        return False
    n = x.shape[1]
    for j in range(n):
        own = _square(p, x, j)
        before = _square(p, x, j - 1) if j > 0 else np.inf
        after = _square(p, x, j + 1) if j < n - 1 else np.inf
        if own < widest * widest and own <= before and own < after:
            low, high = sigma[j - 1] if j > 0 else 0.0, sigma[j + 1] if j < n - 1 else 1.0
            middle, _ = _nearest_within(p, series, low, high, at)
            a, b = _root(p, series, middle, at)
            # half the distances from the ends -1 and 1 is the ellipse's longer half axis
            half = _size(a, b) + _size(a - 1.0, b)
            if half + np.sqrt(max(half * half - 1.0, 0.0)) < rho:
                return True
    return False


@njit(**_OPTIONS)
def near_rows(points, own, shift, near_shifts, sources, close, rules):
    """Return which sources are near which targets, and their rows.

    Parameters
    ----------
    points
        Targets of one fiber, (3, point).
    own
        Its index, whose image p = 0 is left out; -1 for points in the fluid.
    shift
        Lattice vector that brings the targets to each source, (fiber, 3).
    near_shifts
        Of the images that are summed directly, (image, 3).
    sources
        (positions at the nodes (fiber, 3, N), their Legendre coefficients (fiber, 3, N + 4), nodes
        as fractions (N,), lengths (fiber,), doublets (fiber,)).
    close
        (reach (fiber,), widest (fiber,), rho, modes (fiber,), d0 (fiber,), smooth, digits): nearer
        than the reach a source gets a row, with a relative error of exp(-digits) where force and
        shape oscillate as `modes` modes do; from there to the widest it does if a root of |R|^2
        lies within the Bernstein ellipse `rho` about it.
    rules
        Gauss-Legendre rules on [-1, 1]: (nodes (rule, most), weights, sizes (rule,)).

    Returns
    -------
    number
        Of the row, -1 for none, (fiber, image, point).
    rows
        Velocity per Legendre coefficient of the force: xx, yy, zz, xy, xz, yz, (row, 6, N).
    blends
        The same per coefficient of the source's own Lambda f + K f, (row, N).
    """
    x, series, sigma, lengths, doublets = sources
    reach, widest, rho, modes, d0, smooth, digits = close
    count, n = x.shape[0], x.shape[2]
    number = np.full((count, near_shifts.shape[0], points.shape[1]), -1)
    scratch = _scratch(n, series.shape[2], rules[0].shape[1])
    p, at = np.empty(3), scratch[-1]
    total = 0
    for k in range(count):
        own_x, own_series = x[k], series[k]
        extent = (reach[k], widest[k], rho, _radius(own_x))
        for q in range(near_shifts.shape[0]):
            a = shift[k] + near_shifts[q]
            if k == own and a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0:
                continue
            for i in range(points.shape[1]):
                for d in range(3):
                    p[d] = points[d, i] + a[d]
                if _is_near(p, own_x, own_series, sigma, extent, at):
                    number[k, q, i] = total
                    total += 1
    rows, blends = np.empty((total, 6, n)), np.empty((total, n))
    for k in range(count):
        settings = (lengths[k], doublets[k], reach[k], modes[k], d0[k], smooth, digits)
        for q in range(near_shifts.shape[0]):
            a = shift[k] + near_shifts[q]
            for i in range(points.shape[1]):
                r = number[k, q, i]
                if r >= 0:
                    for d in range(3):
                        p[d] = points[d, i] + a[d]
                    _fill_row(
                        p, x[k], series[k], sigma, settings, rules, scratch, rows[r], blends[r]
                    )
    return number, rows, blends


@njit(**_OPTIONS)
def others_velocity(points, own, shift, near_shifts, x, doublets, near, forces):
    """Return 8 pi mu times minus the velocity of all fibers but `own` at `points`, (3, point).

    Parameters
    ----------
    points, own, shift, near_shifts
        As for `near_rows`.
    x, doublets
        Positions of the sources at the nodes (fiber, 3, N) and their doublets (fiber,).
    near
        What `near_rows` returned.
    forces
        (force per length times quadrature weight at the nodes, Legendre coefficients of the force,
        Legendre coefficients of Lambda f + K f), each (fiber, 3, N).
    """
    number, rows, blends = near
    weighted, series, centreline = forces
    out = np.zeros(points.shape)
    for k in range(x.shape[0]):
        for q in range(near_shifts.shape[0]):
            a = shift[k] + near_shifts[q]
            if k == own and a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0:
                continue
            for i in range(points.shape[1]):
                r = number[k, q, i]
                if r < 0:
                    vx, vy, vz = _plain(
                        points[0, i] + a[0],
                        points[1, i] + a[1],
                        points[2, i] + a[2],
                        x[k],
                        weighted[k],
                        doublets[k],
                    )
                else:
                    vx, vy, vz = 0.0, 0.0, 0.0
                    row, blend, f, c = rows[r], blends[r], series[k], centreline[k]
                    for m in range(x.shape[2]):
                        fx, fy, fz, b = f[0, m], f[1, m], f[2, m], blend[m]
                        vx += row[0, m] * fx + row[3, m] * fy + row[4, m] * fz + b * c[0, m]
                        vy += row[3, m] * fx + row[1, m] * fy + row[5, m] * fz + b * c[1, m]
                        vz += row[4, m] * fx + row[5, m] * fy + row[2, m] * fz + b * c[2, m]
                out[0, i] += vx
                out[1, i] += vy
                out[2, i] += vz
    return out


@njit(**_PART)
def _less_plain(p, x, quadrature, polynomials, doublet, row):
    """Take the plain sum over the nodes of a source off its row (6, N); polynomials (node, N)."""
    for j in range(x.shape[1]):
        rx, ry, rz = p[0] - x[0, j], p[1] - x[1, j], p[2] - x[2, j]
        inverse2 = 1.0 / (rx * rx + ry * ry + rz * rz)
        inverse = np.sqrt(inverse2) * quadrature[j]
        inverse3 = inverse * inverse2
        on_force = inverse + doublet * inverse3
        along = inverse3 * (1.0 - 3.0 * doublet * inverse2)
        xx, yy, zz = (
            on_force + along * rx * rx,
            on_force + along * ry * ry,
            on_force + along * rz * rz,
        )
        xy, xz, yz = along * rx * ry, along * rx * rz, along * ry * rz
        for m in range(row.shape[1]):
            value = polynomials[j, m]
            row[0, m] -= xx * value
            row[1, m] -= yy * value
            row[2, m] -= zz * value
            row[3, m] -= xy * value
            row[4, m] -= xz * value
            row[5, m] -= yz * value


@njit(**_OPTIONS)
def corrections(bodies, points, near, sources, plain, close, rules):
    """Return what near sources add at points to the plain sums over their nodes.

    Parameters
    ----------
    bodies
        First and last + 1 of the bodies whose points are targets.
    points
        Targets, (body, 3, point).
    near
        (start (body + 1,), source (pair,), shift (pair, 3)): images near each body.
    sources, close, rules
        As for `near_rows`.
    plain
        (quadrature weights (fiber, N), Legendre polynomials at the nodes (N, N)).

    Returns
    -------
    target, source
        Body times points per body plus point, and source, of each row, (row,).
    rows, blends
        As of `near_rows`, less the plain sum.
    """
    first, last = bodies
    start, listed, shift = near
    x, series, sigma, lengths, doublets = sources
    reach, widest, rho, modes, d0, smooth, digits = close
    quadrature, polynomials = plain
    count, n = points.shape[2], x.shape[2]
    scratch = _scratch(n, series.shape[2], rules[0].shape[1])
    p, at = np.empty(3), scratch[-1]
    begin, total = start[first], 0
    chosen = np.zeros((start[last] - begin, count), np.bool_)
    for b in range(first, last):
        for c in range(start[b], start[b + 1]):
            k = listed[c]
            own_x, own_series = x[k], series[k]
            extent = (reach[k], widest[k], rho, _radius(own_x))
            for i in range(count):
                for d in range(3):
                    p[d] = points[b, d, i] + shift[c, d]
                chosen[c - begin, i] = _is_near(p, own_x, own_series, sigma, extent, at)
                total += chosen[c - begin, i]
    target, source = np.empty(total, np.int64), np.empty(total, np.int64)
    rows, blends = np.empty((total, 6, n)), np.empty((total, n))
    r = 0
    for b in range(first, last):
        for c in range(start[b], start[b + 1]):
            k = listed[c]
            settings = (lengths[k], doublets[k], reach[k], modes[k], d0[k], smooth, digits)
            for i in range(count):
                if chosen[c - begin, i]:
                    for d in range(3):
                        p[d] = points[b, d, i] + shift[c, d]
                    target[r], source[r] = b * count + i, k
                    _fill_row(
                        p, x[k], series[k], sigma, settings, rules, scratch, rows[r], blends[r]
                    )
                    _less_plain(p, x[k], quadrature[k], polynomials, doublets[k], rows[r])
                    r += 1
    return target, source, rows, blends


@njit(**_OPTIONS)
def add_corrections(found, series, centreline, out):
    """Add the rows `found` by `corrections` to out (target, 3).

    Parameters
    ----------
    found
        (target, source, rows, blends) of `corrections`.
    series, centreline
        Legendre coefficients of the force and of Lambda f + K f, (fiber, 3, N).
    """
    target, source, rows, blends = found
    for r in range(target.size):
        f, c, row, blend = series[source[r]], centreline[source[r]], rows[r], blends[r]
        vx, vy, vz = 0.0, 0.0, 0.0
        for m in range(row.shape[1]):
            fx, fy, fz, b = f[0, m], f[1, m], f[2, m], blend[m]
            vx += row[0, m] * fx + row[3, m] * fy + row[4, m] * fz + b * c[0, m]
            vy += row[3, m] * fx + row[1, m] * fy + row[5, m] * fz + b * c[1, m]
            vz += row[4, m] * fx + row[5, m] * fy + row[2, m] * fz + b * c[2, m]
        out[target[r], 0] += vx
        out[target[r], 1] += vy
        out[target[r], 2] += vz
