"""Two filaments whose surfaces nearly touch: arrangements, forces, and (7) + (8) to rounding.

All lengths are 1. Distances are in units of the radius at mid-length, eps: a gap of g radii between
the surfaces is a distance of (2 + g) eps between the centrelines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array, Points, as_float
from stokesfibers.experiments.close_pair_curves import Filament

Indices = NDArray[np.int64]
Curve = Callable[[Array], Array]
"""Arclengths (n,) to points or forces (3, n)."""

_BEND = 120.0  # of `bent`: it turns by 4 radians, with a smallest radius of curvature of 0.13
_CROSSING = 13.0 / 30.0
_SLIDE = 0.3
_MOST_LEVELS = 60
_LARGEST = 0.8  # width of a panel of the reference over its distance
_WIDEST = 0.1
# Legendre coefficients of F / (s (1 - s)): F vanishes at both ends, as a free filament's does
_STRENGTH = np.array(
    [[1.0, -0.7, 0.4, 0.3, -0.2], [0.6, 0.8, -0.5, 0.1, 0.2], [-0.4, 0.5, 0.7, -0.3, 0.1]]
)


@dataclass(frozen=True)
class Arrangement:
    """Where two filaments are.

    Attributes
    ----------
    name
        Of the arrangement.
    source
        The filament that induces the velocity.
    target
        Points on the other, at arclengths (n,) and a distance of the centrelines, (3, n).
    """

    name: str
    source: Filament
    target: Callable[[Array, float], Array]


def _straight() -> Filament:
    return Filament.build(np.zeros_like, np.zeros_like, 0.5, 0.0)


def _bent() -> Filament:
    rise = np.polynomial.Polynomial([0.0, 0.0, 0.0, 1.0 / 3.0, -1.0 / 2.0, 1.0 / 5.0])
    return Filament.build(lambda s: _BEND * rise(s), np.zeros_like, 0.5, 0.0)


def arrangements() -> tuple[Arrangement, ...]:
    """Return parallel, sliding and crossed filaments, and one along a strongly bent one."""
    straight, bent = _straight(), _bent()
    up = np.array([0.0, 0.0, 1.0])[:, None]
    turned = np.array([np.cos(np.pi / 3.0), np.sin(np.pi / 3.0), 0.0])[:, None]
    along = np.array([1.0, 0.0, 0.0])[:, None]

    def outside(s: Array, distance: float) -> Array:
        shape = bent.sample(s)
        right = np.stack([shape.xs[1], -shape.xs[0], np.zeros(s.size)])
        return shape.x + distance * right

    return (
        Arrangement("parallel", straight, lambda s, d: straight.sample(s).x + d * up),
        Arrangement(
            "sliding", straight, lambda s, d: straight.sample(s).x + _SLIDE * along + d * up
        ),
        Arrangement(
            "crossed",
            straight,
            lambda s, d: (_CROSSING - 0.5) * along + (s - 0.56) * turned + d * up,
        ),
        Arrangement("bent", bent, outside),
    )


def integrated_force(s: Array) -> Array:
    """Return F at arclengths s, (3, n): a polynomial of degree 6, zero at both ends."""
    s = np.asarray(s, dtype=float)
    return s * (1.0 - s) * (_STRENGTH @ legvander(2.0 * s - 1.0, 4).T)


def smooth_force(s: Array) -> Array:
    """Return f, the derivative of `integrated_force`, (3, n)."""
    legendre = np.polynomial.legendre
    ends = legendre.poly2leg([0.25, 0.0, -0.25])  # s (1 - s)
    series = np.stack([legendre.legmul(ends, row) for row in _STRENGTH], axis=1)
    values = legendre.legval(2.0 * np.asarray(s, dtype=float) - 1.0, legendre.legder(series))
    return as_float(2.0 * values)


def rough_force(nodes: int) -> Curve:
    """Return a force of as many modes as nodes, the last a thousandth of the first."""
    rng = np.random.default_rng(nodes)
    fall = 10.0 ** (-3.0 * np.arange(nodes) / nodes)
    series = rng.choice([-1.0, 1.0], size=(3, nodes)) * fall

    def force(s: Array) -> Array:
        return series @ legvander(2.0 * np.asarray(s, dtype=float) - 1.0, nodes - 1).T

    return force


def panels_for(position: Curve, points: Points) -> tuple[Indices, Array, Array]:
    """Return panels on [0, 1] for each point (point, 3), none wide against its distance.

    Returns
    -------
    owner, low, high
        Which point a panel is for, its start and its end, (panel,).
    """
    edges = np.linspace(0.0, 1.0, round(1.0 / _WIDEST) + 1)
    owner = np.repeat(np.arange(len(points)), edges.size - 1)
    low, high = np.tile(edges[:-1], len(points)), np.tile(edges[1:], len(points))
    done: list[tuple[Indices, Array, Array]] = []
    probes = np.linspace(0.0, 1.0, 5)
    for _ in range(_MOST_LEVELS):
        s = low[:, None] + (high - low)[:, None] * probes
        x = position(s.ravel()).T.reshape(*s.shape, 3)
        distance = np.linalg.norm(x - points[owner][:, None], axis=2).min(axis=1)
        wide = high - low > _LARGEST * distance
        done.append((owner[~wide], low[~wide], high[~wide]))
        if not wide.any():
            break
        middle = 0.5 * (low + high)[wide]
        owner = np.r_[owner[wide], owner[wide]]
        low, high = np.r_[low[wide], middle], np.r_[middle, high[wide]]
    owners, lows, highs = zip(*done, strict=True)
    return np.concatenate(owners), np.concatenate(lows), np.concatenate(highs)


def exact_velocity(
    position: Curve,
    forces: tuple[Curve, ...],
    points: Points,
    doublet: float,
    *,
    order: int = 16,
) -> Array:
    """Return V + `doublet` W of (7) and (8) times 8 pi mu at points (point, 3) by each force.

    Panels of Gauss-Legendre nodes are halved until each is narrower than its distance: every panel
    then errs by less than 1e-20 at order 16, and rounding is what is left. (force, point, 3).
    """
    nodes, weights = leggauss(order)
    owner, low, high = panels_for(position, points)
    s = (low[:, None] + (high - low)[:, None] * 0.5 * (nodes + 1.0)).ravel()
    share = ((high - low)[:, None] * 0.5 * weights).ravel()
    owner = np.repeat(owner, order)
    r = points[owner].T - position(s)
    inverse2 = 1.0 / np.sum(r * r, axis=0)
    inverse = share * np.sqrt(inverse2)
    out = np.empty((len(forces), *points.shape))
    for k, force in enumerate(forces):
        f = force(s)
        along = np.sum(r * f, axis=0) * inverse * inverse2 * (1.0 - 3.0 * doublet * inverse2)
        for d, part in enumerate(inverse * (1.0 + doublet * inverse2) * f + along * r):
            out[k, :, d] = np.bincount(owner, part, len(points))
    return out
