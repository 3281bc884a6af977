"""Slow, obvious twins of the Ewald sum: plain sums over pairs, images and modes.

Velocities are times 8 pi mu. Nothing is shared with the package.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.special import erf


def stokeslet(r: np.ndarray) -> np.ndarray:
    """Return ``(I + rr/r^2)/r`` at r (3,)."""
    size = np.linalg.norm(r)
    return np.eye(3) / size + np.outer(r, r) / size**3


def doublet(r: np.ndarray) -> np.ndarray:
    """Return ``(I - 3 rr/r^2)/r^3`` at r (3,)."""
    size = np.linalg.norm(r)
    return np.eye(3) / size**3 - 3.0 * np.outer(r, r) / size**5


def no_pair(i, j):  # noqa: ARG001
    """Leave no pair out."""
    return False


def free_sum(targets, sources, forces, *, radius=0.0, left_out=no_pair):
    """Return the sum in free space, with doublets a^2/2 D; pairs `left_out(i, j)` are skipped."""
    radius = np.broadcast_to(radius, len(sources))
    out = np.zeros((len(targets), 3))
    for i, x in enumerate(targets):
        for j, y in enumerate(sources):
            if not left_out(i, j):
                tensor = stokeslet(x - y) + 0.5 * radius[j] ** 2 * doublet(x - y)
                out[i] += tensor @ forces[j]
    return out


def lattice_tensor(r: np.ndarray, vectors: np.ndarray, xi: float) -> np.ndarray:
    """Return the sum of S over the images of a lattice, zero mean flow, at r (3,).

    Hasimoto's split with ``Phi = erf(xi r)``. At r = 0 without the image that is there. `vectors`
    (3, 3) are rows; images and modes are taken until both series are at rounding.
    """
    out = np.zeros((3, 3))
    volume = abs(np.linalg.det(vectors))
    reach, k_max = 6.0 / xi, 12.0 * xi
    most = np.ceil(reach * np.linalg.norm(np.linalg.inv(vectors), axis=0)).astype(int) + 1
    images = np.array(list(product(*(range(-m, m + 1) for m in most))))
    at = r + images @ vectors
    size = np.linalg.norm(at, axis=1)
    if np.any(size == 0.0):
        out -= 4.0 * xi / np.sqrt(np.pi) * np.eye(3)
    at, size = at[size > 0.0], size[size > 0.0]
    phi, steep = erf(xi * size), 2.0 * xi / np.sqrt(np.pi) * size * np.exp(-((xi * size) ** 2))
    out += np.sum((1.0 - phi - steep) / size) * np.eye(3)
    out += np.einsum("p,pi,pj->ij", (1.0 - phi + steep) / size**3, at, at)
    waves = 2.0 * np.pi * np.linalg.inv(vectors).T
    most = np.ceil(k_max * np.linalg.norm(vectors, axis=1) / (2.0 * np.pi)).astype(int)
    modes = np.array([m for m in product(*(range(-n, n + 1) for n in most)) if any(m)])
    k = modes @ waves
    k2 = np.sum(k**2, axis=1)
    x2 = 0.25 * k2 / xi**2
    weight = 8.0 * np.pi / k2 * (1.0 + x2) * np.exp(-x2) * np.cos(k @ r) / volume
    return out + np.sum(weight) * np.eye(3) - np.einsum("p,pi,pj->ij", weight / k2, k, k)


def lattice_sum(targets, sources, forces, vectors, *, own=no_pair):
    """Return the sum over all images, less the image as given (unwrapped) of pairs `own(i, j)`."""
    xi = np.sqrt(np.pi) / abs(np.linalg.det(vectors)) ** (1.0 / 3.0)
    out = np.zeros((len(targets), 3))
    for i, x in enumerate(targets):
        for j, y in enumerate(sources):
            tensor = lattice_tensor(x - y, vectors, xi)
            if own(i, j) and np.any(x != y):
                tensor = tensor - stokeslet(x - y)
            out[i] += tensor @ forces[j]
    return out


def laplacian(function, x: np.ndarray, h: float) -> np.ndarray:
    """Return the Laplacian of function(x (3,)) by central differences of order 6."""
    weights = {0: -49.0 / 18.0, 1: 1.5, 2: -0.15, 3: 1.0 / 90.0}
    out = 3.0 * weights[0] * function(x)
    for axis, step, sign in product(range(3), (1, 2, 3), (1, -1)):
        e = np.zeros(3)
        e[axis] = sign * step * h
        out = out + weights[step] * function(x + e)
    return out / h**2


def relative(found, expected) -> float:
    """Return the relative rms error."""
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))
