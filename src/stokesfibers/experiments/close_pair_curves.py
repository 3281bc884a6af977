"""Two crossing filaments of given shape and tension, and (7) + (8) by adaptive quadrature.

The lower filament arches away below the plane z = 0, the upper one away above z = d. Each touches
its plane at one point, and these two points lie one above the other: the smallest distance between
the centrelines is d, and it is taken there only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.polynomial.chebyshev import chebval
from scipy.integrate import quad_vec

from stokesfibers.core.arrays import Array, Points
from stokesfibers.slender.sampled import Shape

LOWER_CROSSING = 13.0 / 30.0
"""Arclength at the smallest distance, a third of a spacing from the nodes of all grids."""
UPPER_CROSSING = 0.56
"""The same on the upper filament: a node of all grids, so that one target has the distance d."""
TOLERANCE = 1e-11
"""Of the quadrature, relative to the largest component over all targets."""
_DEGREE = 40
_BEND = 30.0
_ANGLE = 1.0
_STRENGTH = 60.0
# int_0^s t^2 (1 - t)^2 dt and int_0^s t^3 (1 - t)^2 dt: angles whose first two derivatives vanish
# at both ends, so that x_ss = x_sss = 0 there
_RISE = Polynomial([0.0, 0.0, 0.0, 1.0 / 3.0, -1.0 / 2.0, 1.0 / 5.0])
_SKEW = Polynomial([0.0, 0.0, 0.0, 0.0, 1.0 / 4.0, -2.0 / 5.0, 1.0 / 6.0])

Angle = Callable[[Array], Array]


@dataclass(frozen=True)
class Filament:
    """A centreline by arclength on [0, 1], with free ends and rigidity 1, under `given_tension`.

    Attributes
    ----------
    series
        Chebyshev coefficients in 2 s - 1 of x and its four derivatives, (coefficient, 5, 3).
    """

    series: Array

    @classmethod
    def build(cls, azimuth: Angle, elevation: Angle, crossing: float, height: float) -> Filament:
        """Return the filament whose tangent has these angles, with x(crossing) = (0, 0, height)."""
        parts = (
            lambda s: np.cos(azimuth(s)) * np.cos(elevation(s)),
            lambda s: np.sin(azimuth(s)) * np.cos(elevation(s)),
            lambda s: np.sin(elevation(s)),
        )
        series = np.zeros((_DEGREE + 2, 5, 3))
        for d, part in enumerate(parts):
            xs = Chebyshev.interpolate(part, _DEGREE, domain=[0.0, 1.0]).trim(1e-15)
            derivatives = (xs.integ(lbnd=crossing), xs, *(xs.deriv(k) for k in (1, 2, 3)))
            for k, found in enumerate(derivatives):
                series[: found.coef.size, k, d] = found.coef
        series[0, 0, 2] += height
        return cls(series)

    def sample(self, s: Array | float) -> Shape:
        """Return the centreline with its derivatives at arclengths s, each (3, *s.shape)."""
        values = chebval(2.0 * np.asarray(s, dtype=float) - 1.0, self.series)
        return Shape(*(np.ascontiguousarray(part) for part in values))


def given_tension(s: Array | float) -> Array | float:
    """Return the tension of both filaments at arclengths s; it stretches them."""
    return _STRENGTH * s * (1.0 - s) * (1.0 + 0.5 * np.sin(4.0 * s))


def _given_tension_slope(s: float) -> float:
    waves = (1.0 - 2.0 * s) * (1.0 + 0.5 * np.sin(4.0 * s)) + 2.0 * s * (1.0 - s) * np.cos(4.0 * s)
    return _STRENGTH * float(waves)


def lower_filament() -> Filament:
    """Return the filament below z = 0, which it touches at `LOWER_CROSSING`."""
    return Filament.build(
        lambda s: 4.0 * _BEND * (_SKEW(s) - _SKEW(LOWER_CROSSING)),
        lambda s: -_BEND * (_RISE(s) - _RISE(LOWER_CROSSING)),
        LOWER_CROSSING,
        0.0,
    )


def upper_filament(distance: float) -> Filament:
    """Return the filament above z = distance, which it touches at `UPPER_CROSSING`."""
    return Filament.build(
        lambda s: _ANGLE + _BEND * (_RISE(s) - _RISE(UPPER_CROSSING)),
        lambda s: _BEND * (_RISE(s) - _RISE(UPPER_CROSSING)),
        UPPER_CROSSING,
        distance,
    )


def exact_velocity(source: Filament, targets: Points, doublet: float) -> tuple[Array, float]:
    """Return V of (7) and `doublet` W of (8), times 8 pi mu, by adaptive Gauss-Kronrod quadrature.

    Both are integrated in their printed form, from the force per length f, for all targets at once.

    Parameters
    ----------
    source
        The filament that induces the velocity.
    targets
        Where, (point, 3).
    doublet
        The weight of W, (eps L)^2 / 2.

    Returns
    -------
    parts
        V and `doublet` W, (2, point, 3).
    error
        The quadrature's own estimate, relative to the largest component of both.

    Raises
    ------
    RuntimeError
        If `TOLERANCE` is not met.
    """

    def integrand(s: float) -> Array:
        shape = source.sample(s)
        f = shape.xssss - given_tension(s) * shape.xss - _given_tension_slope(s) * shape.xs
        r = targets - shape.x
        inverse2 = 1.0 / np.sum(r * r, axis=1, keepdims=True)
        inverse = np.sqrt(inverse2)
        along = r * (r @ f)[:, None] * inverse2
        w = doublet * inverse2 * inverse * (f - 3.0 * along)
        return np.stack([inverse * (f + along), w])

    parts, error, status = quad_vec(
        integrand,
        0.0,
        1.0,
        epsabs=0.0,
        epsrel=TOLERANCE,
        norm="max",
        limit=2000,
        quadrature="gk21",
        points=(LOWER_CROSSING,),
        full_output=True,
    )
    if not status.success:
        raise RuntimeError(f"adaptive quadrature: {status.message}")
    return parts, float(error / np.abs(parts).max())
