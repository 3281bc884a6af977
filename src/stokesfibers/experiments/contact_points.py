"""How many points three ways of integrating next to a filament need, and how far down they get.

Each gives the velocity per Legendre coefficient of the force, for one target and all N modes:

- ``sinh``: Gauss-Legendre in t, ``s = a + b sinh t``, a + i b the complex root of |R|^2;
- ``swap``: the singularity swap of af Klinteberg & Barnett 2020. With |z - z_0| in place of |R|,
  what is left is smooth and interpolated at Gauss-Legendre nodes; the moments
  ``int P_k / |z - z_0|^m``, m = 1, 3, 5, are exact;
- ``panels``: panels halved towards the target, as many points on each.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.polynomial import legendre
from numpy.polynomial.legendre import leggauss, legvander

from stokesfibers.core.arrays import Array, as_float
from stokesfibers.experiments.contact_rules import SpectralSource
from stokesfibers.experiments.contact_scenes import arrangements, panels_for

WAYS = ("sinh", "swap", "panels")
EPS, NODES, GAP = 1e-3, 32, 0.1
PLACES = ("parallel", "bent")
_AT = 0.41  # arclength of the target
_PER_PANEL = (2, 3, 4, 5, 6, 8, 10, 12, 16)
_MOMENTS = 32


class _Near:
    """One target next to one source."""

    def __init__(self, place: str) -> None:
        arrangement = next(a for a in arrangements() if a.name == place)
        self.source = SpectralSource.of(arrangement.source, eps=EPS, nodes=NODES)
        distance = (2.0 + GAP) * EPS
        self.point = arrangement.target(np.array([_AT]), distance)[:, 0]
        self.series = self.source.modes @ self.source.fiber.position_series
        self.root = self._root(complex(2.0 * _AT - 1.0, 2.0 * distance))

    def _root(self, z: complex) -> complex:
        series = self.series.T.astype(complex)
        series[0] -= self.point
        slope = legendre.legder(series)
        for _ in range(30):
            r = legendre.legval(z, series)
            z -= complex(np.sum(r * r) / (2.0 * np.sum(r * legendre.legval(z, slope))))
        return z

    def row(self, z: Array, weights: Array) -> Array:
        """Return the six parts per coefficient, (6, N).

        `weights` (3, n) multiply 1/|R|, 1/|R|^3 and 1/|R|^5, and count in s.
        """
        values = legvander(z, self.series.shape[1] - 1)
        r = self.point - values @ self.series.T
        inverse = 1.0 / np.linalg.norm(r, axis=1)
        one, three, five = weights * inverse ** np.array([[1], [3], [5]])
        doublet = 0.5 * EPS**2
        along = three - 3.0 * doublet * five
        parts = [(one + doublet * three) * (i == j) + along * r[:, i] * r[:, j] for i, j in _PAIRS]
        return as_float(np.stack(parts) @ values[:, :NODES])

    def panels(self, order: int) -> tuple[Array, Array]:
        """Return points and weights of panels, each with `order` points."""
        _, low, high = panels_for(self.source.position, self.point[None])
        nodes, weights = leggauss(order)
        s = low[:, None] + (high - low)[:, None] * 0.5 * (nodes + 1.0)
        return 2.0 * s.ravel() - 1.0, ((high - low)[:, None] * 0.5 * weights).ravel()

    def sinh(self, count: int) -> Array:
        """Return the row by `count` points in t."""
        a, b = self.root.real, self.root.imag
        low, high = np.arcsinh((-1.0 - a) / b), np.arcsinh((1.0 - a) / b)
        nodes, weights = leggauss(count)
        t = 0.5 * (low + high) + 0.5 * (high - low) * nodes
        share = 0.25 * (high - low) * weights * b * np.cosh(t)
        return self.row(a + b * np.sinh(t), np.stack([share] * 3))

    def swap(self, count: int) -> Array:
        """Return the row by `count` nodes whose weights know |z - z_0|."""
        nodes, weights = leggauss(count)
        z, share = self.panels(_MOMENTS)
        distance = np.hypot(z - self.root.real, self.root.imag)
        powers = np.array([[1], [3], [5]])
        moments = 2.0 * (share / distance**powers) @ legvander(z, count - 1)
        transform = (np.arange(count) + 0.5)[:, None] * legvander(nodes, count - 1).T
        known = weights * (moments @ transform)
        away = np.hypot(nodes - self.root.real, self.root.imag)
        return self.row(nodes, 0.5 * known * away**powers)


_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def errors_by_points(counts: Sequence[int]) -> xr.Dataset:
    """Return the largest error of a row over its largest entry, by place, way and points."""
    found = np.full((len(PLACES), 2, len(counts)), np.nan)
    panels = np.full((len(PLACES), 2, len(_PER_PANEL)), np.nan)
    for p, place in enumerate(PLACES):
        near = _Near(place)

        def of_panels(order: int, near: _Near = near) -> tuple[int, Array]:
            z, share = near.panels(order)
            return z.size, near.row(z, np.stack([share] * 3))

        exact = of_panels(_MOMENTS)[1]
        size = np.abs(exact).max()
        for c, count in enumerate(counts):
            for w, way in enumerate((near.sinh, near.swap)):
                found[p, w, c] = np.abs(way(count) - exact).max() / size
        for c, order in enumerate(_PER_PANEL):
            number, row = of_panels(order)
            panels[p, :, c] = number, np.abs(row - exact).max() / size
    return xr.Dataset(
        {
            "by_points": (("place", "way", "points"), found),
            "panel_points": (("place", "per_panel"), panels[:, 0]),
            "by_panels": (("place", "per_panel"), panels[:, 1]),
        },
        coords={
            "place": list(PLACES),
            "way": list(WAYS[:2]),
            "points": list(counts),
            "per_panel": list(_PER_PANEL),
        },
    )
