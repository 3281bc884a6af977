"""Compiled sums over far periodic images of fibers in Legendre modes: exact, and by moments (42).

Velocities are in the sense of `kernels.spectral_pairs`. Far images vary slowly along a fiber, so
the exact sum runs over a few coarse nodes of each source and target.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from stokesfibers.kernels.pairs import _far_images

_OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"reassoc", "contract", "arcp", "nsz"},
}
# Parts are inlined and not cached by themselves; see `kernels`.
_PART = {**_OPTIONS, "cache": False, "forceinline": True}
_EULER = 0.5772156649015329


@njit(**_PART)
def _add_images(along, square, doublet, places, weights, sums):
    """Add V + D W of images at `places` along the axis to sums (4, n).

    With R = (a, b), a along the axis and b across, the terms are on I, on bb, on ab and on aa.
    """
    plain, across, mixed, axial = sums[0], sums[1], sums[2], sums[3]
    for q in range(places.size):
        place, weight = places[q], weights[q]
        for j in range(along.size):
            a = along[j] + place
            inverse2 = 1.0 / (a * a + square[j])
            inverse = weight * np.sqrt(inverse2)
            inverse3 = inverse * inverse2
            on_r = inverse3 * (1.0 - 3.0 * doublet * inverse2)
            plain[j] += inverse + doublet * inverse3
            across[j] += on_r
            mixed[j] += a * on_r
            axial[j] += a * a * on_r


@njit(**_PART)
def _add_line(square, doublet, period, sums):
    """Add the sum over all images as seen from afar."""
    for j in range(square.size):
        both = -2.0 / period * (0.5 * np.log(square[j]) - np.log(2.0 * period) + _EULER)
        dipole = 2.0 * doublet / (period * square[j])
        sums[0, j] += both + dipole
        sums[1, j] += (2.0 / period - 2.0 * dipole) / square[j]
        sums[3, j] += both - 2.0 / period - dipole


@njit(**_OPTIONS)
def image_block(points, shift, sources, doublets, images):
    """Return the velocity at `points` by the far images of unit forces at coarse nodes.

    Parameters
    ----------
    points
        (3, point).
    shift
        Lattice vector that brings the points to each source, (fiber, 3).
    sources, doublets
        Coarse nodes (fiber, 3, n) and (eps L)^2 / 2 (fiber,).
    images
        (index of the axis, period, places (rule, most), weights (rule, most), sizes (rule,),
        constants (rule,), rule by distance across in periods (distance,)): what stands for the
        images |p| >= 2. Farther across than the list goes they are a line.

    Returns
    -------
    Array
        xx, yy, zz, xy, xz, yz, (point, fiber, 6, n).
    """
    axis, period, places, weights, sizes, constants, rule_at = images
    u, v = (axis + 1) % 3, (axis + 2) % 3
    # components aa, uu, vv, au, av, uv among xx, yy, zz, xy, xz, yz
    au, av, uv = 2 + axis + u, 2 + axis + v, 2 + u + v
    count, n = sources.shape[0], sources.shape[2]
    padded = -(-n // 8) * 8  # loops of full vectors
    along, square = np.zeros(padded), np.ones(padded)
    cu, cv = np.zeros(padded), np.zeros(padded)
    sums = np.empty((4, padded))
    direct, ones = period * np.array([-1.0, 0.0, 1.0]), -np.ones(3)
    out = np.empty((points.shape[1], count, 6, n))
    for i in range(points.shape[1]):
        for k in range(count):
            px = points[axis, i] + shift[k, axis]
            pu, pv = points[u, i] + shift[k, u], points[v, i] + shift[k, v]
            widest = 0.0
            for j in range(n):
                along[j] = px - sources[k, axis, j]
                cu[j], cv[j] = pu - sources[k, u, j], pv - sources[k, v, j]
                square[j] = cu[j] * cu[j] + cv[j] * cv[j]
                widest = max(widest, square[j])
            sums[:] = 0.0
            constant = 0.0
            if np.sqrt(widest) < rule_at.size * period:
                r = rule_at[min(int(np.sqrt(widest) / period), rule_at.size - 1)]
                constant = constants[r]
                _add_images(
                    along, square, doublets[k], places[r, : sizes[r]], weights[r, : sizes[r]], sums
                )
            else:
                _add_line(square, doublets[k], period, sums)
                _add_images(along, square, doublets[k], direct, ones, sums)
            block = out[i, k]
            for j in range(n):
                on_force = sums[0, j] - constant
                block[axis, j] = on_force + sums[3, j] - constant
                block[u, j] = on_force + sums[1, j] * cu[j] * cu[j]
                block[v, j] = on_force + sums[1, j] * cv[j] * cv[j]
                block[au, j] = sums[2, j] * cu[j]
                block[av, j] = sums[2, j] * cv[j]
                block[uv, j] = sums[1, j] * cu[j] * cv[j]
    return out


@njit(**_OPTIONS)
def block_velocity(block, forces):
    """Return the velocity (3, point) by forces (fiber, 3, n) through an `image_block`."""
    out = np.empty((3, block.shape[0]))
    for i in range(block.shape[0]):
        vx, vy, vz = 0.0, 0.0, 0.0
        for k in range(block.shape[1]):
            b, f = block[i, k], forces[k]
            for j in range(b.shape[1]):
                fx, fy, fz = f[0, j], f[1, j], f[2, j]
                vx += b[0, j] * fx + b[3, j] * fy + b[4, j] * fz
                vy += b[3, j] * fx + b[1, j] * fy + b[5, j] * fz
                vz += b[4, j] * fx + b[5, j] * fy + b[2, j] * fz
        out[0, i], out[1, i], out[2, i] = vx, vy, vz
    return out


@njit(**_OPTIONS)
def moment_velocity(points, shift, centres, moments, net, shifts):
    """Return the velocity (3, point) by far images through moments, (41), and net forces.

    Parameters
    ----------
    points, shift
        As for `image_block`.
    centres
        Points that the moments are about, (fiber, 3).
    moments
        S of (41), (fiber, 3, 3).
    net
        Net force, (fiber, 3): zero but for loads.
    shifts
        Of the far images, (3, image).
    """
    out = np.zeros(points.shape)
    for k in range(centres.shape[0]):
        fx, fy, fz = net[k, 0], net[k, 1], net[k, 2]
        for i in range(points.shape[1]):
            rx = points[0, i] + shift[k, 0] - centres[k, 0]
            ry = points[1, i] + shift[k, 1] - centres[k, 1]
            rz = points[2, i] + shift[k, 2] - centres[k, 2]
            vx, vy, vz = _far_images(rx, ry, rz, moments[k], shifts)
            if fx != 0.0 or fy != 0.0 or fz != 0.0:
                for q in range(shifts.shape[1]):
                    ax, ay, az = rx + shifts[0, q], ry + shifts[1, q], rz + shifts[2, q]
                    inverse2 = 1.0 / (ax * ax + ay * ay + az * az)
                    inverse = np.sqrt(inverse2)
                    along = (ax * fx + ay * fy + az * fz) * inverse * inverse2
                    vx += inverse * fx + along * ax
                    vy += inverse * fy + along * ay
                    vz += inverse * fz + along * az
            out[0, i] += vx
            out[1, i] += vy
            out[2, i] += vz
    return out
