"""Compiled assembly of the linear system of one implicit step of one fiber in Legendre modes.

Everything is for unit length and unit rigidity; `drag` is then 8 pi mu L^4 / E. Arrays are
component first: coefficients and nodal values have shape (3, N), symmetric tensors the six
components xx, yy, zz, xy, xz, yz. `tables` (4, N, N) holds the position modes and their derivatives
1, 2 and 4 at the nodes, `tension_tables` (2, N, N - 1) the tension modes and their slopes there,
`constraint` (N - 1, N) the derivative of the position modes where |x_s| = 1 is imposed, and
`weights` (1 + terms, N, N) the shape-free weights. Tests compare with graded quadrature of (24) and
with the residual of (20) written out.
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
_AS_WRITTEN = {**_PART, "fastmath": False}


@njit(**_PART)
def _mobility(x, xs, xss, s, weights, delta, a, b, out):
    """Fill out (6, N, N) with Lambda + K_delta acting on nodal forces; return the series' ratio.

    The ratio is the largest ``delta^2 h u^2 w^2``: the series in h converges where it is below 1.
    """
    n, terms = s.size, weights.shape[0]
    xx, yy, zz, xy, xz, yz = out[0], out[1], out[2], out[3], out[4], out[5]
    h, series = np.empty(n), np.empty(n)
    worst = 0.0
    for i in range(n):
        px, py, pz = x[0, i], x[1, i], x[2, i]
        d2 = delta[i] * delta[i]
        for j in range(n):
            rx, ry, rz = px - x[0, j], py - x[1, j], pz - x[2, j]
            u = s[i] - s[j]
            u2 = u * u + 1e-300
            p = u2 / (rx * rx + ry * ry + rz * rz + 1e-300)
            h[j] = (p - 1.0) / u2
            worst = max(worst, d2 * abs(p - 1.0) / (u2 + d2))
        bx, by, bz = xss[0, i], xss[1, i], xss[2, i]
        h[i] = (bx * bx + by * by + bz * bz) / 12.0
        worst = max(worst, d2 * h[i])
        for j in range(n):
            series[j] = weights[terms - 1, i, j]
        for m in range(terms - 2, -1, -1):
            for j in range(n):
                series[j] = weights[m, i, j] + h[j] * series[j]
        for j in range(n):
            rx, ry, rz = px - x[0, j], py - x[1, j], pz - x[2, j]
            u = s[i] - s[j]
            r2 = rx * rx + ry * ry + rz * rz + 1e-300
            g = series[j] * np.sqrt((u * u + 1e-300) / r2)
            d = g / r2
            xx[i, j] = g + d * rx * rx
            yy[i, j] = g + d * ry * ry
            zz[i, j] = g + d * rz * rz
            xy[i, j] = d * rx * ry
            xz[i, j] = d * rx * rz
            yz[i, j] = d * ry * rz
        tx, ty, tz = xs[0, i], xs[1, i], xs[2, i]
        g = series[i]
        xx[i, i] = g + a + (g + b) * tx * tx
        yy[i, i] = g + a + (g + b) * ty * ty
        zz[i, i] = g + a + (g + b) * tz * tz
        xy[i, i] = (g + b) * tx * ty
        xz[i, i] = (g + b) * tx * tz
        yz[i, i] = (g + b) * ty * tz
    return worst


@njit(**_PART)
def _apply(mobility, f, out):
    """Set out = mobility f for nodal forces f (3, N)."""
    n = f.shape[1]
    for i in range(n):
        ox, oy, oz = 0.0, 0.0, 0.0
        for j in range(n):
            fx, fy, fz = f[0, j], f[1, j], f[2, j]
            ox += mobility[0, i, j] * fx + mobility[3, i, j] * fy + mobility[4, i, j] * fz
            oy += mobility[3, i, j] * fx + mobility[1, i, j] * fy + mobility[5, i, j] * fz
            oz += mobility[4, i, j] * fx + mobility[5, i, j] * fy + mobility[2, i, j] * fz
        out[0, i], out[1, i], out[2, i] = ox, oy, oz


@njit(**_OPTIONS)
def resisted_velocity(coefficients, force, s, tables, weights, delta, a, b):
    """Return (Lambda + K_delta)[force] at the nodes, (3, N), and the ratio of the series."""
    n = s.size
    x = np.dot(coefficients, tables[0].T)
    xs = np.dot(coefficients, tables[1].T)
    xss = np.dot(coefficients, tables[2].T)
    mobility = np.empty((6, n, n))
    ratio = _mobility(x, xs, xss, s, weights, delta, a, b, mobility)
    out = np.empty((3, n))
    _apply(mobility, force, out)
    return out, ratio


@njit(**_OPTIONS)
def increment_system(
    coefficients,
    tension,
    rate,
    flow,
    gradient,
    load,
    alpha,
    implicit,
    drag,
    s,
    tables,
    tension_tables,
    constraint,
    weights,
    delta,
    a,
    b,
):
    """Return the system for the increments of one Newton pass, and the forces it is about.

    It is, linearised about (x, T) and with the mobility M = Lambda + K_delta held there,

        drag (rate + alpha dx - U - implicit grad U dx) + M (f + implicit df - (dT x_s)_s) = 0,
        x_s . dx_s = implicit (1 - |x_s|^2) / 2,

    with f = x_ssss - (T x_s)_s - load and df = dx_ssss - (T dx_s)_s. With implicit = 1, alpha the
    leading coefficient of a difference formula and `rate` its value for x, this is one step in
    time. With implicit = 0, alpha = 1, rate = 0 and T = 0, dx is the velocity and dT the tension.

    Parameters
    ----------
    coefficients, tension
        Modes of x, (3, N), and of T, (N - 1,).
    rate
        x_t of the difference formula, as modes, (3, N).
    flow, gradient
        U (3, N) and grad U (N, 3, 3) at the nodes.
    load
        External force per length at the nodes, (3, N).

    Returns
    -------
    matrix, right
        (4 N - 1, 4 N - 1) and (4 N - 1,). Unknowns are the modes of dx, then those of dT times
        `scale`. A velocity v from elsewhere, so that drag x_t gains -v, takes `scale` v from the
        first 3 N entries of `right`.
    scale
        1 / (drag alpha).
    ratio
        The largest ratio of the kernel's series.
    force, resisted, mobility
        f and M f at the nodes, (3, N), and M itself: xx, yy, zz, xy, xz, yz, (6, N, N).
    own
        `implicit` times the map from modes of x to x_ssss - (T x_s)_s at the nodes, (N, N).
    tangent, curvature
        x_s and x_ss at the nodes, (3, N).
    """
    n = s.size
    m = n - 1
    v0, v1, v2, v4 = tables[0], tables[1], tables[2], tables[3]
    x = np.dot(coefficients, v0.T)
    xs = np.dot(coefficients, v1.T)
    xss = np.dot(coefficients, v2.T)
    f = np.dot(coefficients, v4.T)
    value = np.dot(tension_tables[0], tension)
    slope = np.dot(tension_tables[1], tension)
    mobility = np.empty((6, n, n))
    ratio = _mobility(x, xs, xss, s, weights, delta, a, b, mobility)

    own = np.empty((n, n))
    for j in range(n):
        for k in range(n):
            own[j, k] = implicit * (v4[j, k] - value[j] * v2[j, k] - slope[j] * v1[j, k])
    scale = 1.0 / (drag * alpha)
    bent = np.dot(mobility.reshape(6 * n, n), own).reshape(6, n, n)

    # Columns of the tension: M times -(dT_s x_s + dT x_ss), x_s and x_ss multiplied into M.
    pulled = np.empty((3, n, 2 * n))
    for p in range(3):
        mx, my, mz = mobility[(0, 3, 4)[p]], mobility[(3, 1, 5)[p]], mobility[(4, 5, 2)[p]]
        for i in range(n):
            row = pulled[p, i]
            for j in range(n):
                kx, ky, kz = mx[i, j], my[i, j], mz[i, j]
                row[j] = kx * xss[0, j] + ky * xss[1, j] + kz * xss[2, j]
                row[n + j] = kx * xs[0, j] + ky * xs[1, j] + kz * xs[2, j]
    tensile = np.dot(pulled.reshape(3 * n, 2 * n), tension_tables.reshape(2 * n, m))

    size = 3 * n + m
    matrix = np.zeros((size, size))
    right = np.empty(size)
    for p in range(3):
        for q in range(3):
            block = bent[(p, q, 3, 4, 5)[0 if p == q else p + q + 1]]
            for i in range(n):
                row = matrix[p * n + i]
                g = implicit * gradient[i, p, q] / alpha
                one = 1.0 if p == q else 0.0
                for k in range(n):
                    row[q * n + k] = scale * block[i, k] + (one - g) * v0[i, k]
        for i in range(n):
            row = matrix[p * n + i]
            for k in range(m):
                row[3 * n + k] = -tensile[p * n + i, k]  # in units of drag alpha
    for p in range(3):
        for j in range(n):
            f[p, j] -= value[j] * xss[p, j] + slope[j] * xs[p, j] + load[p, j]
    resisted = np.empty((3, n))
    _apply(mobility, f, resisted)
    moved = np.dot(rate, v0.T)
    for p in range(3):
        for i in range(n):
            right[p * n + i] = (flow[p, i] - moved[p, i]) / alpha - scale * resisted[p, i]
    direction = np.dot(coefficients, constraint.T)
    for i in range(m):
        row = matrix[3 * n + i]
        length2 = 0.0
        for p in range(3):
            t = direction[p, i]
            length2 += t * t
            for k in range(1, n):
                row[p * n + k] = t * constraint[i, k]
        right[3 * n + i] = 0.5 * implicit * (1.0 - length2)
    return matrix, right, scale, ratio, f, resisted, mobility, own, xs, xss


@njit(**_OPTIONS)
def resisted_force(mobility, force):
    """Return M f at the nodes for M (6, N, N) and f (3, N)."""
    out = np.empty(force.shape)
    _apply(mobility, force, out)
    return out


@njit(**_PART)
def _norms(weights, scales, history, fresh, transposed, work, out):
    rows, depth = weights.shape
    n = fresh.shape[1]
    for r in range(rows + 1):
        for p in range(3):
            for k in range(n):
                value = fresh[p, k]
                if r < rows:
                    for j in range(depth):
                        value -= weights[r, j] * history[j, p, k]
                    value *= scales[r]
                work[p, k] = value
        for c in range(2):
            values = np.dot(work, transposed)
            largest = 0.0
            for i in range(n):
                vx, vy, vz = values[0, i], values[1, i], values[2, i]
                size = vx * vx + vy * vy + vz * vz
                if size > largest or size != size:  # NaN stays NaN
                    largest = size
            out[r, c] = np.sqrt(largest)
            work[:, :2] = 0.0


@njit(**_AS_WRITTEN)
def _raise_to_ratios(worst, norms, allowed, least_bend):
    shift, bend, rounding = allowed
    size, bent = norms[-1, 0], norms[-1, 1]
    if bent < least_bend:
        bent = least_bend
    if size < 1.0:
        size = 1.0
    bent = bend * bent + rounding * size
    for r in range(worst.size):
        for error in (norms[r, 0] / shift, norms[r, 1] / bent):
            if error > worst[r] or error != error:  # NaN stays NaN
                worst[r] = error


@njit(**_OPTIONS)
def step_errors(weights, scales, history, fresh, table, allowed, least_bends):
    """Return ``scales[r] (fresh - sum_j weights[r, j] history[j])`` over what is allowed, (r,).

    The largest of all fibers counts. A shift, the largest distance at a node, may be allowed[0] of
    the length. A bend, the shift without its rigid modes 0 and 1, may be allowed[1] of that of
    `fresh` (fiber, 3, N), or of `least_bends` (fiber,) if that is more, and the rounding allowed[2]
    besides: rounding shows least in it. `table` (N, N) holds the position modes at the nodes. NaN
    stays NaN.
    """
    rows = weights.shape[0]
    norms, worst = np.empty((rows + 1, 2)), np.zeros(rows)
    work, transposed = np.empty(fresh.shape[1:]), np.ascontiguousarray(table.T)
    for k in range(fresh.shape[0]):
        _norms(weights, scales, history[k], fresh[k], transposed, work, norms)
        _raise_to_ratios(worst, norms, allowed, least_bends[k])
    return worst
