"""Slow, obvious twins of the pair kernels, written from (7), (8), (17), (18), (19)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial.legendre import leggauss

Curve = Callable[[np.ndarray], np.ndarray]


def stokeslet(r: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Return (I + RR)/|R| . f."""
    size = np.linalg.norm(r)
    return f / size + r * (r @ f) / size**3


def doublet(r: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Return (I - 3 RR)/|R|^3 . f."""
    size = np.linalg.norm(r)
    return f / size**3 - 3.0 * r * (r @ f) / size**5


def plain(point: np.ndarray, x: Curve, f: Curve, weight: float, panels: int = 400) -> np.ndarray:
    """Return V + weight W by (7) and (8), by Gauss-Legendre panels over [0, 1]."""
    nodes, weights = leggauss(8)
    edges = np.linspace(0.0, 1.0, panels + 1)
    s = (edges[:-1, None] + (nodes + 1.0) / (2.0 * panels)).ravel()
    w = np.tile(weights / (2.0 * panels), panels)
    total = np.zeros(3)
    for position, force, share in zip(x(s).T, f(s).T, w, strict=True):
        r = point - position
        total += share * (stokeslet(r, force) + weight * doublet(r, force))
    return total


def by_parts(
    point: np.ndarray, x: np.ndarray, xs: np.ndarray, force: np.ndarray, h: float, weight: float
) -> np.ndarray:
    """Return V + weight W by (17) and (18) and the trapezoidal rule; arrays (node, 3)."""
    total = np.zeros(3)
    for j in range(len(x)):
        r = point - x[j]
        size = np.linalg.norm(r)
        unit = r / size
        t, identity = xs[j], np.eye(3)
        dyads = np.outer(t, unit) + np.outer(unit, t)
        v = ((unit @ t) * (identity + 3.0 * np.outer(unit, unit)) - dyads) / size**2
        w = 3.0 * ((unit @ t) * (identity - 5.0 * np.outer(unit, unit)) + dyads) / size**4
        share = 0.5 if j in (0, len(x) - 1) else 1.0
        total -= share * h * (v + weight * w) @ force[j]
    return total
