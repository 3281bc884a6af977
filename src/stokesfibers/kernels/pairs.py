"""Compiled sums over other fibers and their images: (17), (18), close approach (Section 3.3.3).

Arrays are component first: positions, tangents and integrated forces have shape (fiber, 3, node).
The velocity is that of ``V + D W`` with D = (eps L)^2 / 2, times 8 pi mu and without the minus of
(6). Far images use the moment tensor S = int x_s F ds of (41). Targets of one fiber are handled by
one call; calls are independent and release the GIL. Slow twins are in ``tests/reference``.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"reassoc", "contract", "arcp", "nsz"},
}
# Parts are inlined and not cached by themselves; see `kernels`.
_PART = {**_OPTIONS, "cache": False, "forceinline": True}


@njit(**_PART)
def _term(rx, ry, rz, tx, ty, tz, fx, fy, fz, doublet):
    """Return the integrand of V + D W at one source point: R = target - source, x_s, F."""
    inverse2 = 1.0 / (rx * rx + ry * ry + rz * rz)
    inverse3 = inverse2 * np.sqrt(inverse2)
    inverse5 = inverse3 * inverse2
    a = rx * tx + ry * ty + rz * tz
    b = rx * fx + ry * fy + rz * fz
    c = tx * fx + ty * fy + tz * fz
    on_force = -a * (inverse3 + 3.0 * doublet * inverse5)
    less = inverse3 - 3.0 * doublet * inverse5
    on_tangent = b * less
    on_r = c * less - 3.0 * a * b * (inverse5 - 5.0 * doublet * inverse5 * inverse2)
    return (
        on_force * fx + on_tangent * tx + on_r * rx,
        on_force * fy + on_tangent * ty + on_r * ry,
        on_force * fz + on_tangent * tz + on_r * rz,
    )


@njit(**_PART)
def _trapezoid(px, py, pz, x, xs, force, h, doublet, near2):
    """Return the trapezoidal sum over one source and how many of its nodes are near."""
    n = x.shape[1]
    ox, oy, oz = 0.0, 0.0, 0.0
    near = 0
    for j in range(n):
        rx, ry, rz = px - x[0, j], py - x[1, j], pz - x[2, j]
        tx, ty, tz = xs[0, j], xs[1, j], xs[2, j]
        fx, fy, fz = force[0, j], force[1, j], force[2, j]
        r2 = rx * rx + ry * ry + rz * rz
        near += r2 < near2
        vx, vy, vz = _term(rx, ry, rz, tx, ty, tz, fx, fy, fz, doublet)
        ox += vx
        oy += vy
        oz += vz
    # F vanishes at both ends, so their half weights need no correction
    return h * ox, h * oy, h * oz, near


@njit(**_PART)
def _hermite(x, xs, h, j, xi, at):
    """Set at to the cubic Hermite point at fraction xi of interval j."""
    back = 1.0 - xi
    w0, w1 = back * back * (1.0 + 2.0 * xi), xi * xi * (3.0 - 2.0 * xi)
    t0, t1 = h * xi * back * back, -h * xi * xi * back
    for d in range(3):
        at[d] = w0 * x[d, j] + w1 * x[d, j + 1] + t0 * xs[d, j] + t1 * xs[d, j + 1]


@njit(**_PART)
def _is_near(p, x, j, near2):
    r2 = 0.0
    for d in range(3):
        r = p[d] - x[d, j]
        r2 += r * r
    return r2 < near2


@njit(**_PART)
def _refined(p, x, xs, force, h, doublet, near2, parts, at, out):
    """Set out to the sum with intervals near the target cut in `parts`."""
    n = x.shape[1]
    out[:] = 0.0
    for j in range(n - 1):
        cuts = parts if _is_near(p, x, j, near2) or _is_near(p, x, j + 1, near2) else 1
        for q in range(cuts + 1):
            xi = q / cuts
            weight = h / cuts * (0.5 if q == 0 or q == cuts else 1.0)
            _hermite(x, xs, h, j, xi, at)
            back = 1.0 - xi
            vx, vy, vz = _term(
                p[0] - at[0],
                p[1] - at[1],
                p[2] - at[2],
                back * xs[0, j] + xi * xs[0, j + 1],
                back * xs[1, j] + xi * xs[1, j + 1],
                back * xs[2, j] + xi * xs[2, j + 1],
                back * force[0, j] + xi * force[0, j + 1],
                back * force[1, j] + xi * force[1, j + 1],
                back * force[2, j] + xi * force[2, j + 1],
                doublet,
            )
            out[0] += weight * vx
            out[1] += weight * vy
            out[2] += weight * vz


@njit(**_PART)
def nearest(p, x):
    """Return distance to a polygon (3, node), and interval and fraction of its nearest point."""
    best, interval, fraction = 1e300, 0, 0.0
    for j in range(x.shape[1] - 1):
        along, size = 0.0, 0.0
        for d in range(3):
            e = x[d, j + 1] - x[d, j]
            along += (p[d] - x[d, j]) * e
            size += e * e
        xi = min(1.0, max(0.0, along / size))
        d2 = 0.0
        for d in range(3):
            r = p[d] - x[d, j] - xi * (x[d, j + 1] - x[d, j])
            d2 += r * r
        if d2 < best:
            best, interval, fraction = d2, j, xi
    return np.sqrt(best), interval, fraction


@njit(**_PART)
def blend_weight(distance, d0, smooth):
    """Return the share of the outer formula: 0 up to d0, 1 from 2 d0 on.

    Linear in between as in the paper, or the C^2 step with ``smooth``.
    """
    if d0 == 0.0:
        return 1.0
    xi = min(1.0, max(0.0, distance / d0 - 1.0))
    return xi * xi * xi * (10.0 + xi * (6.0 * xi - 15.0)) if smooth else xi


@njit(**_PART)
def _close(p, k, x, xs, force, h, doublet, close, centreline, at, out):
    """Set out to the velocity of source k at a target near it: refined, then blended."""
    near, parts, d0, smooth = close
    reach = near * h
    distance, j, xi = nearest(p, x)
    w = blend_weight(distance, d0[k], smooth)
    out[:] = 0.0
    if w > 0.0:  # within d_0 the outer formula is not needed, and at distance 0 not defined
        _refined(p, x, xs, force, h, doublet, reach * reach, int(parts), at, out)
    if w < 1.0:
        for d in range(3):
            own = (1.0 - xi) * centreline[k, d, j] + xi * centreline[k, d, j + 1]
            out[d] = w * out[d] + (1.0 - w) * own


@njit(**_PART)
def _far_images(rx, ry, rz, s, shifts):
    """Return the sum of - Rhat (3 Rhat.S.Rhat - tr S) / R^2 over R + shifts."""
    ox, oy, oz = 0.0, 0.0, 0.0
    trace = s[0, 0] + s[1, 1] + s[2, 2]
    xy, xz, yz = s[0, 1] + s[1, 0], s[0, 2] + s[2, 0], s[1, 2] + s[2, 1]
    for q in range(shifts.shape[1]):
        ax, ay, az = rx + shifts[0, q], ry + shifts[1, q], rz + shifts[2, q]
        inverse2 = 1.0 / (ax * ax + ay * ay + az * az)
        form = s[0, 0] * ax * ax + s[1, 1] * ay * ay + s[2, 2] * az * az
        form += xy * ax * ay + xz * ax * az + yz * ay * az
        w = (trace - 3.0 * form * inverse2) * inverse2 * np.sqrt(inverse2)
        ox += w * ax
        oy += w * ay
        oz += w * az
    return ox, oy, oz


@njit(**_PART)
def nearest_lattice_shift(r, periods, shift):
    """Set shift to the lattice vector that brings r closest to zero; period 0 is a free axis."""
    for d in range(3):
        shift[d] = -periods[d] * np.round(r[d] / periods[d]) if periods[d] > 0.0 else 0.0


@njit(**_PART)
def _others(
    points, middle, own, x, xs, force, h, doublet, images, close, centreline, moments, centres
):
    """Return what `others_velocity` documents."""
    periods, near_shifts, far_shifts = images
    out = np.zeros(points.shape)
    shift, at, value, p = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    half = x.shape[2] // 2
    for k in range(x.shape[0]):
        nearest_lattice_shift(middle - x[k, :, half], periods, shift)
        # the blend begins at 2 d_0, which on fine grids is farther out than near * h; its distance
        # is to the centreline, half an interval from a node at most
        reach = max(close[0] * h[k], 2.0 * close[2][k] + 0.5 * h[k])
        near2 = reach * reach
        for q in range(near_shifts.shape[0]):
            sx = shift[0] + near_shifts[q, 0]
            sy = shift[1] + near_shifts[q, 1]
            sz = shift[2] + near_shifts[q, 2]
            if k == own and sx == 0.0 and sy == 0.0 and sz == 0.0:
                continue
            for i in range(points.shape[0]):
                p[0], p[1], p[2] = points[i, 0] + sx, points[i, 1] + sy, points[i, 2] + sz
                vx, vy, vz, count = _trapezoid(
                    p[0], p[1], p[2], x[k], xs[k], force[k], h[k], doublet[k], near2
                )
                if count > 0:
                    _close(
                        p, k, x[k], xs[k], force[k], h[k], doublet[k], close, centreline, at, value
                    )
                    vx, vy, vz = value[0], value[1], value[2]
                out[i, 0] += vx
                out[i, 1] += vy
                out[i, 2] += vz
        if far_shifts.shape[1] > 0:
            for i in range(points.shape[0]):
                vx, vy, vz = _far_images(
                    points[i, 0] + shift[0] - centres[k, 0],
                    points[i, 1] + shift[1] - centres[k, 1],
                    points[i, 2] + shift[2] - centres[k, 2],
                    moments[k],
                    far_shifts,
                )
                out[i, 0] += vx
                out[i, 1] += vy
                out[i, 2] += vz
    return out


@njit(**_OPTIONS)
def others_velocity(
    points, middle, own, x, xs, force, h, doublet, images, close, centreline, moments, centres
):
    """Return 8 pi mu times minus the velocity that all fibers but `own` induce at `points`.

    Parameters
    ----------
    points
        Targets, (point, 3), unwrapped.
    middle
        Where the target fiber is, (3,): the nearest image of each source is chosen for it, once for
        all its points.
    own
        Index of the target fiber, whose image p = 0 is left out; -1 for points in the fluid.
    x, xs, force
        Sources, (fiber, 3, node); F as in (17).
    h, doublet
        Spacing and (eps L)^2 / 2 of each source, (fiber,).
    images
        (periods (3,), near shifts (image, 3), far shifts (3, image)).
    close
        (near, parts, d0 (fiber,), smooth): see `_close`.
    centreline
        Lambda f + K f of each source at its nodes, (fiber, 3, node).
    moments, centres
        S of (41), (fiber, 3, 3), and the point it is taken about, (fiber, 3).
    """
    return _others(
        points, middle, own, x, xs, force, h, doublet, images, close, centreline, moments, centres
    )


@njit(**_OPTIONS)
def fluid_velocity(points, x, xs, force, h, doublet, images, close, centreline, moments, centres):
    """Return `others_velocity` at points of the fluid, each with its own nearest images."""
    out = np.empty(points.shape)
    for i in range(points.shape[0]):
        one = points[i : i + 1]
        out[i] = _others(
            one,
            points[i],
            -1,
            x,
            xs,
            force,
            h,
            doublet,
            images,
            close,
            centreline,
            moments,
            centres,
        )[0]
    return out


@njit(**_PART)
def _tension_row(px, py, pz, x, xs, h, doublet, near2, row):
    """Set row (3, node) to the velocity at a point by unit tension at each node; return near nodes.

    The integrand is that of `_term` with F = -x_s.
    """
    near = 0
    for j in range(x.shape[1]):
        rx, ry, rz = px - x[0, j], py - x[1, j], pz - x[2, j]
        tx, ty, tz = xs[0, j], xs[1, j], xs[2, j]
        r2 = rx * rx + ry * ry + rz * rz
        near += r2 < near2
        inverse2 = 1.0 / r2
        inverse3 = h * inverse2 * np.sqrt(inverse2)
        inverse5 = inverse3 * inverse2
        a = rx * tx + ry * ty + rz * tz
        q = tx * tx + ty * ty + tz * tz
        on_tangent = 6.0 * doublet * a * inverse5
        on_r = 3.0 * a * a * (inverse5 - 5.0 * doublet * inverse5 * inverse2)
        on_r -= q * (inverse3 - 3.0 * doublet * inverse5)
        row[0, j] = on_tangent * tx + on_r * rx
        row[1, j] = on_tangent * ty + on_r * ry
        row[2, j] = on_tangent * tz + on_r * rz
    return near


@njit(**_PART)
def _close_tension_row(p, k, x, xs, h, doublet, close, tensile, at, fresh):
    """Set fresh (3, node) to the refined and blended counterpart of `_tension_row`."""
    near, parts, d0, smooth = close
    near2 = near * h * near * h
    distance, nearest_interval, fraction = nearest(p, x)
    w = blend_weight(distance, d0[k], smooth)
    fresh[:] = 0.0
    for j in range(x.shape[1] - 1 if w > 0.0 else 0):
        cuts = int(parts) if _is_near(p, x, j, near2) or _is_near(p, x, j + 1, near2) else 1
        for q in range(cuts + 1):
            xi = q / cuts
            weight = h / cuts * (0.5 if q == 0 or q == cuts else 1.0)
            _hermite(x, xs, h, j, xi, at)
            back = 1.0 - xi
            tx = back * xs[0, j] + xi * xs[0, j + 1]
            ty = back * xs[1, j] + xi * xs[1, j + 1]
            tz = back * xs[2, j] + xi * xs[2, j + 1]
            rx, ry, rz = p[0] - at[0], p[1] - at[1], p[2] - at[2]
            for side in range(2):
                share = back if side == 0 else xi
                if share > 0.0:
                    # the force -T x_s is interpolated linearly between its nodal values
                    vx, vy, vz = _term(
                        rx,
                        ry,
                        rz,
                        tx,
                        ty,
                        tz,
                        -xs[0, j + side],
                        -xs[1, j + side],
                        -xs[2, j + side],
                        doublet,
                    )
                    fresh[0, j + side] += weight * share * vx
                    fresh[1, j + side] += weight * share * vy
                    fresh[2, j + side] += weight * share * vz
    if w < 1.0:
        j, xi = nearest_interval, fraction
        for d in range(3):
            for m in range(x.shape[1]):
                own = (1.0 - xi) * tensile[k, d, j, m] + xi * tensile[k, d, j + 1, m]
                fresh[d, m] = w * fresh[d, m] + (1.0 - w) * own


@njit(**_PART)
def _far_tensor(rx, ry, rz, shifts, out):
    """Set out (3, 6) to the far images' velocity per entry xx, yy, zz, xy, xz, yz of S."""
    sx, sy, sz = 0.0, 0.0, 0.0
    xxx, yyy, zzz, xyz = 0.0, 0.0, 0.0, 0.0
    xxy, xxz, yyx, yyz, zzx, zzy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for q in range(shifts.shape[1]):
        ax, ay, az = rx + shifts[0, q], ry + shifts[1, q], rz + shifts[2, q]
        inverse2 = 1.0 / (ax * ax + ay * ay + az * az)
        w = inverse2 * np.sqrt(inverse2)
        v = 3.0 * w * inverse2
        sx += w * ax
        sy += w * ay
        sz += w * az
        xx, yy, zz = v * ax * ax, v * ay * ay, v * az * az
        xxx += xx * ax
        xxy += xx * ay
        xxz += xx * az
        yyx += yy * ax
        yyy += yy * ay
        yyz += yy * az
        zzx += zz * ax
        zzy += zz * ay
        zzz += zz * az
        xyz += v * ax * ay * az
    out[0] = (sx - xxx, sx - yyx, sx - zzx, -xxy, -xxz, -xyz)
    out[1] = (sy - xxy, sy - yyy, sy - zzy, -yyx, -xyz, -yyz)
    out[2] = (sz - xxz, sz - yyz, sz - zzz, -xyz, -zzx, -zzy)


@njit(**_PART)
def _influence(own, k, x, xs, h, doublet, images, close, tensile, centres, trapezoid, out):
    """Fill out[:, k] with the influence of fiber k, see `tension_influence`."""
    periods, near_shifts, far_shifts = images
    n = x.shape[2]
    half = n // 2
    line = np.empty(n)
    row, before = np.zeros((3, n)), np.zeros((3, n))
    trial = np.empty((3, n))
    far, far_before = np.zeros((3, 6)), np.zeros((3, 6))
    shift, at, p = np.empty(3), np.empty(3), np.empty(3)
    nearest_lattice_shift(x[own, :, half] - x[k, :, half], periods, shift)
    reach = max(close[0] * h[k], 2.0 * close[2][k] + 0.5 * h[k])
    near2 = reach * reach
    six = np.empty((6, n))
    if far_shifts.shape[1] > 0:
        for j in range(n):
            tx, ty, tz = xs[k, 0, j], xs[k, 1, j], xs[k, 2, j]
            w = -trapezoid[j] * h[k]
            six[0, j], six[1, j], six[2, j] = w * tx * tx, w * ty * ty, w * tz * tz
            six[3, j], six[4, j], six[5, j] = 2 * w * tx * ty, 2 * w * tx * tz, 2 * w * ty * tz
    for i in range(n - 1):
        row, before = before, row
        far, far_before = far_before, far
        row[:] = 0.0
        for q in range(near_shifts.shape[0]):
            sx = shift[0] + near_shifts[q, 0]
            sy = shift[1] + near_shifts[q, 1]
            sz = shift[2] + near_shifts[q, 2]
            if k == own and sx == 0.0 and sy == 0.0 and sz == 0.0:
                continue
            p[0] = 0.5 * (x[own, 0, i] + x[own, 0, i + 1]) + sx
            p[1] = 0.5 * (x[own, 1, i] + x[own, 1, i + 1]) + sy
            p[2] = 0.5 * (x[own, 2, i] + x[own, 2, i + 1]) + sz
            count = _tension_row(p[0], p[1], p[2], x[k], xs[k], h[k], doublet[k], near2, trial)
            if count > 0:
                _close_tension_row(p, k, x[k], xs[k], h[k], doublet[k], close, tensile, at, trial)
            for d in range(3):
                for j in range(n):
                    row[d, j] += trial[d, j]
        if far_shifts.shape[1] > 0:
            _far_tensor(
                0.5 * (x[own, 0, i] + x[own, 0, i + 1]) + shift[0] - centres[k, 0],
                0.5 * (x[own, 1, i] + x[own, 1, i + 1]) + shift[1] - centres[k, 1],
                0.5 * (x[own, 2, i] + x[own, 2, i + 1]) + shift[2] - centres[k, 2],
                far_shifts,
                far,
            )
        if i > 0:
            line[:] = 0.0
            for d in range(3):
                t = xs[own, d, i] / h[own]
                new, old = row[d], before[d]
                for j in range(n):
                    line[j] += t * (new[j] - old[j])
            if far_shifts.shape[1] > 0:
                for c in range(6):
                    g = 0.0
                    for d in range(3):
                        g += xs[own, d, i] / h[own] * (far[d, c] - far_before[d, c])
                    source = six[c]
                    for j in range(n):
                        line[j] += g * source[j]
            target = out[i - 1, k]
            for j in range(n - 2):
                target[j] = line[j + 1]


@njit(**_OPTIONS)
def tension_influence(own, x, xs, h, doublet, images, close, tensile, centres, trapezoid, out):
    """Fill out with x_s . d/ds of the velocity at fiber `own` by the tensions of all fibers.

    `out` has shape (m, fiber, m) with m inner nodes: inner nodes of `own`, sources, their inner
    tensions. The derivative is the compact difference (33) between half points. The velocity is
    in the sense of `others_velocity`. `tensile` (fiber, 3, node, node) maps tensions to the
    centreline value, `trapezoid` (node,) holds the rule's weights over h.
    """
    for k in range(x.shape[0]):
        _influence(own, k, x, xs, h, doublet, images, close, tensile, centres, trapezoid, out)
