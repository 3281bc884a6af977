"""Compiled assembly of the finite-part operator (30)-(32) and of the equations built on it.

Everything here works on one fiber and on plain arrays, component first: positions and derivatives
have shape (3, node), symmetric tensors the six components xx, yy, zz, xy, xz, yz. Inner loops run
over source nodes, contiguous in memory, so that they vectorise. Each kernel has a slow twin in
``tests/reference``. `a` and `b` are the coefficients of the local operator
``Lambda[g] = a g + b x_s (x_s . g)``.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    # Contraction and reassociation let the loops vectorise; NaN and infinity keep their meaning.
    "fastmath": {"reassoc", "contract", "arcp", "nsz"},
}
# Parts are inlined and not cached by themselves; see `kernels`.
_PART = {**_OPTIONS, "cache": False, "forceinline": True}


@njit(**_PART)
def _smooth_kernel(x_t, t_t, s_t, delta, self_node, x, s, g):
    """Fill g with the six components of G(s_t, s_k) of (32) at all nodes k."""
    n = s.size
    d2 = delta * delta
    xx, yy, zz = 1.0 + t_t[0] * t_t[0], 1.0 + t_t[1] * t_t[1], 1.0 + t_t[2] * t_t[2]
    xy, xz, yz = t_t[0] * t_t[1], t_t[0] * t_t[2], t_t[1] * t_t[2]
    for k in range(n):
        rx, ry, rz = x_t[0] - x[0, k], x_t[1] - x[1, k], x_t[2] - x[2, k]
        u = s_t - s[k]
        r2 = rx * rx + ry * ry + rz * rz + 1e-300
        q = np.sqrt((u * u + d2) / (r2 + d2))
        p = q / r2
        g[0, k] = q + p * rx * rx - xx
        g[1, k] = q + p * ry * ry - yy
        g[2, k] = q + p * rz * rz - zz
        g[3, k] = p * rx * ry - xy
        g[4, k] = p * rx * rz - xz
        g[5, k] = p * ry * rz - yz
    if self_node >= 0:  # G vanishes at s' = s
        for c in range(6):
            g[c, self_node] = 0.0


@njit(**_PART)
def _node_rows(i, x, xs, s, delta, hat, square, product, phi, g, rows):
    """Fill rows with the six components of the finite-part operator at node i, (node) weights."""
    n = s.size
    _smooth_kernel(x[:, i], xs[:, i], s[i], delta[i], i, x, s, g)
    for c in range(6):
        gc, rc = g[c], rows[c]
        for k in range(n):
            rc[k] = square[i, k] * gc[k]
        for k in range(n - 1):
            rc[k] += product[i, k] * gc[k + 1]
        for k in range(1, n):
            rc[k] += product[i, k - 1] * gc[k - 1]
    tx, ty, tz = xs[0, i], xs[1, i], xs[2, i]
    dyad = (1.0 + tx * tx, 1.0 + ty * ty, 1.0 + tz * tz, tx * ty, tx * tz, ty * tz)
    for c in range(6):
        rc, w = rows[c], dyad[c]
        for k in range(n):
            rc[k] += w * hat[i, k]
        rc[i] -= w * phi[i]


@njit(**_OPTIONS)
def apply_finite_part(x, xs, s, delta, hat, square, product, phi, g):
    """Return K_delta[g] of (24) at all nodes for piecewise linear g of shape (3, node)."""
    n = s.size
    out = np.empty((3, n))
    smooth, rows = np.empty((6, n)), np.empty((6, n))
    for i in range(n):
        _node_rows(i, x, xs, s, delta, hat, square, product, phi, smooth, rows)
        ox, oy, oz = 0.0, 0.0, 0.0
        for k in range(n):
            gx, gy, gz = g[0, k], g[1, k], g[2, k]
            ox += rows[0, k] * gx + rows[3, k] * gy + rows[4, k] * gz
            oy += rows[3, k] * gx + rows[1, k] * gy + rows[5, k] * gz
            oz += rows[4, k] * gx + rows[5, k] * gy + rows[2, k] * gz
        out[0, i], out[1, i], out[2, i] = ox, oy, oz
    return out


@njit(**_OPTIONS)
def tensile_matrix(x, xs, xss, s, delta, hat, square, product, phi, a, b, d1):
    """Return the map from nodal tensions to (Lambda + K_delta)[(T x_s)_s], (3, node, node)."""
    n = s.size
    out = np.zeros((3, n, n))
    smooth, rows = np.empty((6, n)), np.empty((6, n))
    by_slope = np.empty((3, n))
    for i in range(n):
        _node_rows(i, x, xs, s, delta, hat, square, product, phi, smooth, rows)
        for k in range(n):
            tx, ty, tz = xs[0, k], xs[1, k], xs[2, k]
            by_slope[0, k] = rows[0, k] * tx + rows[3, k] * ty + rows[4, k] * tz
            by_slope[1, k] = rows[3, k] * tx + rows[1, k] * ty + rows[5, k] * tz
            by_slope[2, k] = rows[4, k] * tx + rows[5, k] * ty + rows[2, k] * tz
            tx, ty, tz = xss[0, k], xss[1, k], xss[2, k]
            out[0, i, k] = rows[0, k] * tx + rows[3, k] * ty + rows[4, k] * tz
            out[1, i, k] = rows[3, k] * tx + rows[1, k] * ty + rows[5, k] * tz
            out[2, i, k] = rows[4, k] * tx + rows[5, k] * ty + rows[2, k] * tz
        for d in range(3):
            by_slope[d, i] += (a + b) * xs[d, i]
            out[d, i, i] += a * xss[d, i]
            line = out[d, i]
            for k in range(n):
                slope = by_slope[d, k]
                low, high = (0, 3) if k == 0 else ((n - 3, n) if k == n - 1 else (k - 1, k + 2))
                for m in range(low, high):
                    line[m] += slope * d1[k, m]
    return out


@njit(**_PART)
def _times_fourth_difference(row, padded, d4, out):
    """Set out = row . D_4, using the five-point stencil inside and d4's own rows at the ends."""
    n = row.size
    inner = d4[2, 0]
    for k in range(n):
        padded[k + 2] = row[k]
    for k in (0, 1, n - 2, n - 1):
        padded[k + 2] = 0.0
    for m in range(n):
        out[m] = inner * (
            padded[m]
            - 4.0 * padded[m + 1]
            + 6.0 * padded[m + 2]
            - 4.0 * padded[m + 3]
            + padded[m + 4]
        )
    for m in range(6):
        out[m] += row[0] * d4[0, m] + row[1] * d4[1, m]
        out[n - 6 + m] += row[n - 2] * d4[n - 2, n - 6 + m] + row[n - 1] * d4[n - 1, n - 6 + m]


@njit(**_OPTIONS)
def evolution_matrix(x, xs, s, delta, hat, square, product, phi, a, b, factor, d2, d3, d4):
    """Return I + factor (Lambda + K_delta) D_4 with the free-end rows, shape (3 node, 3 node).

    Unknowns are ordered component first. Rows of nodes 0, 1, N - 1, N carry D_2 x_0 = 0,
    D_3 x_0 = 0, D_3 x_N = 0, D_2 x_N = 0, scaled to entries of order one.
    """
    n = s.size
    matrix = np.zeros((3, n, 3, n))
    smooth, rows = np.empty((6, n)), np.empty((6, n))
    padded, line = np.zeros(n + 4), np.empty(n)
    for i in range(2, n - 2):
        _node_rows(i, x, xs, s, delta, hat, square, product, phi, smooth, rows)
        tx, ty, tz = xs[0, i], xs[1, i], xs[2, i]
        rows[0, i] += a + b * tx * tx
        rows[1, i] += a + b * ty * ty
        rows[2, i] += a + b * tz * tz
        rows[3, i] += b * tx * ty
        rows[4, i] += b * tx * tz
        rows[5, i] += b * ty * tz
        for c in range(6):
            _times_fourth_difference(rows[c], padded, d4, line)
            p, q = (0, 1, 2, 0, 0, 1)[c], (0, 1, 2, 1, 2, 2)[c]
            for k in range(n):
                matrix[p, i, q, k] = factor * line[k]
            if p != q:
                for k in range(n):
                    matrix[q, i, p, k] = factor * line[k]
        for c in range(3):
            matrix[c, i, c, i] += 1.0
    h = s[1] - s[0]
    h2, h3 = h * h, h * h * h
    for c in range(3):
        for k in range(n):
            matrix[c, 0, c, k] = h2 * d2[0, k]
            matrix[c, 1, c, k] = h3 * d3[0, k]
            matrix[c, n - 2, c, k] = h3 * d3[n - 1, k]
            matrix[c, n - 1, c, k] = h2 * d2[n - 1, k]
    return matrix.reshape(3 * n, 3 * n)


@njit(**_PART)
def _quadratic_basis(j):
    """Return first node and coefficients (3 nodes, 3 powers) of Q_2 on interval j."""
    tau = np.zeros((3, 3))
    if j == 0:
        tau[0] = (1.0, -1.5, 0.5)
        tau[1] = (0.0, 2.0, -1.0)
        tau[2] = (0.0, -0.5, 0.5)
        return 0, tau
    tau[0] = (0.0, -0.5, 0.5)
    tau[1] = (1.0, 0.0, -1.0)
    tau[2] = (0.0, 0.5, 0.5)
    return j - 1, tau


@njit(**_PART)
def _tensile_polynomials(xs, xss, h):
    """Return (T x_s)_s on each interval as a cubic: (basis node, power, space, interval)."""
    count = xs.shape[1] - 1
    poly = np.zeros((3, 4, 3, count))
    for j in range(count):
        _, tau = _quadratic_basis(j)
        for m in range(3):
            t0, t1, t2 = tau[m, 0], tau[m, 1], tau[m, 2]
            for d in range(3):
                a0, a1 = xs[d, j], xs[d, j + 1] - xs[d, j]
                b0, b1 = xss[d, j], xss[d, j + 1] - xss[d, j]
                poly[m, 0, d, j] = t1 * a0 / h + t0 * b0
                poly[m, 1, d, j] = (t1 * a1 + 2.0 * t2 * a0) / h + t0 * b1 + t1 * b0
                poly[m, 2, d, j] = 2.0 * t2 * a1 / h + t1 * b1 + t2 * b0
                poly[m, 3, d, j] = t2 * b1
    return poly


@njit(**_PART)
def _add_tensile_rows(p, poly, g, moments, phi_p, phi_0, xs, h, matrix):
    """Add - x_s . d/ds {K_delta[(T x_s)_s] + phi_0 ...} of half point p to rows p and p + 1.

    The second part of the operator is taken with phi_0 added, as on the right of (37).
    """
    count = moments.shape[1]
    m0, m1, m2, m3, m4 = moments[0], moments[1], moments[2], moments[3], moments[4]
    tx, ty, tz = (
        0.5 * (xs[0, p] + xs[0, p + 1]),
        0.5 * (xs[1, p] + xs[1, p + 1]),
        0.5 * (xs[2, p] + xs[2, p + 1]),
    )
    dxx, dyy, dzz = 1.0 + tx * tx, 1.0 + ty * ty, 1.0 + tz * tz
    dxy, dxz, dyz = tx * ty, tx * tz, ty * tz
    lx, ly, lz = xs[0, p] / h, xs[1, p] / h, xs[2, p] / h
    rx, ry, rz = xs[0, p + 1] / h, xs[1, p + 1] / h, xs[2, p + 1] / h
    left, right = np.empty(count), np.empty(count)
    for m in range(3):
        px, py, pz = poly[m, :, 0], poly[m, :, 1], poly[m, :, 2]
        for j in range(count):
            ux = m0[j] * px[0, j] + m1[j] * px[1, j] + m2[j] * px[2, j] + m3[j] * px[3, j]
            uy = m0[j] * py[0, j] + m1[j] * py[1, j] + m2[j] * py[2, j] + m3[j] * py[3, j]
            uz = m0[j] * pz[0, j] + m1[j] * pz[1, j] + m2[j] * pz[2, j] + m3[j] * pz[3, j]
            vx = m1[j] * px[0, j] + m2[j] * px[1, j] + m3[j] * px[2, j] + m4[j] * px[3, j]
            vy = m1[j] * py[0, j] + m2[j] * py[1, j] + m3[j] * py[2, j] + m4[j] * py[3, j]
            vz = m1[j] * pz[0, j] + m2[j] * pz[1, j] + m3[j] * pz[2, j] + m4[j] * pz[3, j]
            axx, ayy, azz = g[0, j] + dxx, g[1, j] + dyy, g[2, j] + dzz
            axy, axz, ayz = g[3, j] + dxy, g[4, j] + dxz, g[5, j] + dyz
            bxx, byy, bzz = g[0, j + 1] - g[0, j], g[1, j + 1] - g[1, j], g[2, j + 1] - g[2, j]
            bxy, bxz, byz = g[3, j + 1] - g[3, j], g[4, j + 1] - g[4, j], g[5, j + 1] - g[5, j]
            wx = axx * ux + axy * uy + axz * uz + bxx * vx + bxy * vy + bxz * vz
            wy = axy * ux + ayy * uy + ayz * uz + bxy * vx + byy * vy + byz * vz
            wz = axz * ux + ayz * uy + azz * uz + bxz * vx + byz * vy + bzz * vz
            left[j] = lx * wx + ly * wy + lz * wz
            right[j] = rx * wx + ry * wy + rz * wz
        # Node p's own value of (T x_s)_s is the mean of the interval's two end values.
        n0, _ = _quadratic_basis(p)
        gx = px[0, p] + 0.5 * (px[1, p] + px[2, p] + px[3, p])
        gy = py[0, p] + 0.5 * (py[1, p] + py[2, p] + py[3, p])
        gz = pz[0, p] + 0.5 * (pz[1, p] + pz[2, p] + pz[3, p])
        wx = (phi_0 - phi_p) * (dxx * gx + dxy * gy + dxz * gz)
        wy = (phi_0 - phi_p) * (dxy * gx + dyy * gy + dyz * gz)
        wz = (phi_0 - phi_p) * (dxz * gx + dyz * gy + dzz * gz)
        matrix[p, n0 + m] -= lx * wx + ly * wy + lz * wz
        matrix[p + 1, n0 + m] += rx * wx + ry * wy + rz * wz
        matrix[p, m] -= left[0]
        matrix[p + 1, m] += right[0]
        low, high = matrix[p], matrix[p + 1]
        for j in range(1, count):
            low[j - 1 + m] -= left[j]
            high[j - 1 + m] += right[j]


@njit(**_PART)
def _bending_at_half_point(p, xs, xsss4, product, g, moments, phi_p, phi_0, out):
    """Fill out with I_1[x_ssss] (3) and the two scalars differentiated in (38), at half point p."""
    count = moments.shape[1]
    tx, ty, tz = (
        0.5 * (xs[0, p] + xs[0, p + 1]),
        0.5 * (xs[1, p] + xs[1, p + 1]),
        0.5 * (xs[2, p] + xs[2, p + 1]),
    )
    ox, oy, oz, first, second = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(count):
        m0, m1, m2 = moments[0, j], moments[1, j], moments[2, j]
        fx, fy, fz = xsss4[0, j], xsss4[1, j], xsss4[2, j]
        ex, ey, ez = xsss4[0, j + 1] - fx, xsss4[1, j + 1] - fy, xsss4[2, j + 1] - fz
        ux, uy, uz = m0 * fx + m1 * ex, m0 * fy + m1 * ey, m0 * fz + m1 * ez
        vx, vy, vz = m1 * fx + m2 * ex, m1 * fy + m2 * ey, m1 * fz + m2 * ez
        bxx, byy, bzz = g[0, j + 1] - g[0, j], g[1, j + 1] - g[1, j], g[2, j + 1] - g[2, j]
        bxy, bxz, byz = g[3, j + 1] - g[3, j], g[4, j + 1] - g[4, j], g[5, j + 1] - g[5, j]
        ox += g[0, j] * ux + g[3, j] * uy + g[4, j] * uz + bxx * vx + bxy * vy + bxz * vz
        oy += g[3, j] * ux + g[1, j] * uy + g[5, j] * uz + bxy * vx + byy * vy + byz * vz
        oz += g[4, j] * ux + g[5, j] * uy + g[2, j] * uz + bxz * vx + byz * vy + bzz * vz
        first += m0 * product[j] + m1 * (product[j + 1] - product[j])
        ax, ay, az = xs[0, j] - tx, xs[1, j] - ty, xs[2, j] - tz
        dx, dy, dz = xs[0, j + 1] - xs[0, j], xs[1, j + 1] - xs[1, j], xs[2, j + 1] - xs[2, j]
        second += ux * ax + uy * ay + uz * az + vx * dx + vy * dy + vz * dz
    own = 0.5 * (product[p] + product[p + 1])
    out[0], out[1], out[2] = ox, oy, oz
    out[3] = first + (phi_0 - phi_p) * own
    out[4] = second


@njit(**_OPTIONS)
def tension_coupling(
    x, xs, xss, xsss, xssss, s, delta_half, moments_half, phi_half, phi_0, hat, phi
):
    """Return the non-local parts of the tension equation (22).

    Returns
    -------
    matrix
        Of - x_s . d/ds K_delta[(T x_s)_s] acting on nodal tensions, (node, node), with the term
        phi_0 (2 T_ss - T x_ss . x_ss) of (37) left to the caller. Rows 0 and N are meaningless.
    bending
        x_s . d/ds K_delta[x_ssss] at the nodes, complete, by (38); ends meaningless, zero.
    """
    n = s.size
    h = s[1] - s[0]
    matrix = np.zeros((n, n))
    poly = _tensile_polynomials(xs, xss, h)
    product = np.empty(n)
    for k in range(n):
        product[k] = xss[0, k] * xsss[0, k] + xss[1, k] * xsss[1, k] + xss[2, k] * xsss[2, k]
    g = np.empty((6, n))
    half = np.empty((n - 1, 5))
    middle, tangent = np.empty(3), np.empty(3)
    for p in range(n - 1):
        for d in range(3):
            middle[d] = 0.5 * (x[d, p] + x[d, p + 1])
            tangent[d] = 0.5 * (xs[d, p] + xs[d, p + 1])
        _smooth_kernel(middle, tangent, s[p] + 0.5 * h, delta_half[p], -1, x, s, g)
        _add_tensile_rows(p, poly, g, moments_half[p], phi_half[p], phi_0, xs, h, matrix)
        _bending_at_half_point(
            p, xs, xssss, product, g, moments_half[p], phi_half[p], phi_0, half[p]
        )
    bending = np.zeros(n)
    for j in range(1, n - 1):
        value = 0.0
        for d in range(3):
            value += xs[d, j] * (half[j, d] - half[j - 1, d])
        value -= 6.0 * (half[j, 3] - half[j - 1, 3]) + 2.0 * (half[j, 4] - half[j - 1, 4])
        value /= h
        squares = 0.0
        for d in range(3):
            own = 0.0
            for k in range(n):
                own += hat[j, k] * xssss[d, k]
            value -= xss[d, j] * (own - phi[j] * xssss[d, j])
            squares += xss[d, j] * xssss[d, j] + xsss[d, j] * xsss[d, j]
        bending[j] = value + 6.0 * phi_0 * squares
    return matrix, bending
