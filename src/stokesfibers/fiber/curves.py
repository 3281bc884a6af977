"""Initial shapes: curves by any parameter, and their points at equal or given arclengths.

A curve does not know the grid of an engine, which samples it by arclength with `at_fractions`. The
perturbation of (47) is 4e-7 of the length, so the arclength is integrated and inverted to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError
from stokesfibers.fiber.parameters import Fiber

PAPER_ANGLE = float(np.pi - np.arcsin((49.664**2 + 1.0) ** -0.5))
"""theta_0 of Section 4.1: a straight fiber started here in unit shear is vertical at t = 49.664."""
_PANELS = 128
_GAUSS = 12
LENGTH_TOLERANCE = 0.01
"""Given points may miss the fiber's length by this fraction before they are refused."""


@dataclass(frozen=True)
class Curve:
    """A centreline by a parameter alpha in [0, 1].

    Attributes
    ----------
    position
        Maps alpha of shape (n,) to points (n, 3).
    tangent
        Its derivative by alpha, (n, 3).
    """

    position: Callable[[Array], Points]
    tangent: Callable[[Array], Points]

    def _speed(self, alpha: Array) -> Array:
        return np.linalg.norm(self.tangent(alpha.ravel()), axis=-1).reshape(alpha.shape)

    def _arclengths(self, edges: Array) -> Array:
        """Return the length from each edge to the next, by Gauss-Legendre quadrature."""
        x, w = np.polynomial.legendre.leggauss(_GAUSS)
        width = np.diff(edges)
        alpha = edges[:-1, None] + 0.5 * width[:, None] * (x + 1.0)
        return 0.5 * width * (self._speed(alpha) @ w)

    def length(self) -> float:
        """Return the length of the curve."""
        return float(self._arclengths(np.linspace(0.0, 1.0, _PANELS + 1)).sum())

    def at_fractions(self, sigma: Array) -> Points:
        """Return points at fractions `sigma` in [0, 1] of the arclength, (n, 3)."""
        edges = np.linspace(0.0, 1.0, _PANELS + 1)
        reached = np.concatenate([[0.0], np.cumsum(self._arclengths(edges))])
        target = np.asarray(sigma, dtype=float) * reached[-1]
        panel = np.clip(np.searchsorted(reached, target, side="right") - 1, 0, _PANELS - 1)
        start, rest = edges[panel], target - reached[panel]
        width = rest / self._speed(start)
        x, w = np.polynomial.legendre.leggauss(_GAUSS)
        for _ in range(8):  # Newton; the speed varies little within a panel
            inside = self._speed(start[:, None] + 0.5 * width[:, None] * (x + 1.0))
            width -= (0.5 * width * (inside @ w) - rest) / self._speed(start + width)
        return self.position(np.clip(start + width, 0.0, 1.0))


def scaled(curve: Curve, fiber: Fiber) -> Curve:
    """Return `curve` scaled about the origin to the fiber's length."""
    factor = fiber.length / curve.length()
    return Curve(
        lambda alpha: factor * curve.position(alpha), lambda alpha: factor * curve.tangent(alpha)
    )


def direction_at(angle: float, tilt: float) -> Array:
    """Return the unit vector at `angle` to the x-axis in the xy-plane, tilted towards z; (3,)."""
    angle, tilt = checks.finite("angle", angle), checks.finite("tilt", tilt)
    level = np.cos(tilt)
    return np.array([level * np.cos(angle), level * np.sin(angle), np.sin(tilt)])


def straight(
    fiber: Fiber,
    *,
    angle: float = 0.0,
    tilt: float = 0.0,
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Curve:
    """Return a straight centreline.

    Parameters
    ----------
    fiber
        Gives the length.
    angle
        Angle to the x-axis in the xy-plane, radians.
    tilt
        Angle out of the xy-plane, towards +z, radians.
    centre
        Its mid-point, in units of length.
    """
    return nearly_straight(fiber, angle=angle, amplitude=0.0, tilt=tilt, centre=centre)


def segment(fiber: Fiber, *, centre: tuple[float, float, float] | Array, direction: Array) -> Curve:
    """Return a straight centreline with its mid-point at `centre`, along the unit `direction`."""
    middle, along = np.asarray(centre, dtype=float), fiber.length * np.asarray(direction)
    return Curve(
        lambda alpha: middle + (alpha[:, None] - 0.5) * along,
        lambda alpha: np.broadcast_to(along, (alpha.size, 3)),
    )


def nearly_straight(
    fiber: Fiber,
    *,
    angle: float = PAPER_ANGLE,
    amplitude: float = -1e-4,
    tilt: float = 0.0,
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Curve:
    """Return the slightly bent centreline (47), in its centred form of unit length (errata).

    Before scaling to the fiber's length it is x = cos(angle) (alpha - 1/2),
    y = sin(angle) (alpha - 1/2) + amplitude alpha^4 (1 - alpha)^4. The paper's is without a tilt.

    Parameters
    ----------
    fiber
        Gives the length.
    angle
        theta_0, radians; by default the paper's, vertical at t = 49.664 in unit shear.
    amplitude
        d_y, in units of the fiber's length; the largest deflection is d_y / 256, along y.
    tilt
        Angle of the direction out of the xy-plane, towards +z, radians.
    centre
        Where alpha = 1/2 would lie without the perturbation, in units of length.
    """
    return bent(
        fiber,
        centre=checks.vector3("centre", centre),
        direction=direction_at(angle, tilt),
        normal=np.array([0.0, 1.0, 0.0]),
        amplitude=checks.finite("amplitude", amplitude),
    )


def bent(
    fiber: Fiber,
    *,
    centre: tuple[float, float, float] | Array,
    direction: Array,
    normal: Array,
    amplitude: float,
) -> Curve:
    """Return the centreline (47) along the unit `direction`, deflected towards `normal`.

    Before scaling to the fiber's length it is
    (alpha - 1/2) direction + amplitude alpha^4 (1 - alpha)^4 normal.
    """
    middle = np.asarray(centre, dtype=float)

    def position(alpha: Array) -> Points:
        bump = amplitude * (alpha * (1.0 - alpha)) ** 4
        return (alpha - 0.5)[:, None] * direction + bump[:, None] * normal

    def tangent(alpha: Array) -> Points:
        slope = amplitude * (4.0 * (alpha * (1.0 - alpha)) ** 3 * (1.0 - 2.0 * alpha))
        return direction + slope[:, None] * normal

    shape = scaled(Curve(position, tangent), fiber)
    return Curve(lambda alpha: shape.position(alpha) + middle, shape.tangent)


def through_points(points: object, *, where: str = "points") -> Curve:
    """Return the quintic spline through `points` (n, 3), n >= 6, by chord length.

    Raises
    ------
    InputError
        If the array has another shape, too few or repeated points, or is not finite.
    """
    try:
        array = np.asarray(points, dtype=float)
    except (TypeError, ValueError):
        raise InputError(where, "numbers of shape (point, 3)", type(points).__name__) from None
    if array.ndim != 2 or array.shape[1] != 3 or array.shape[0] < 6:
        raise InputError(where, "an array of shape (point, 3) with 6 points or more", array.shape)
    if not np.isfinite(array).all():
        raise InputError(where, "finite coordinates", "NaN or infinity")
    chords = np.linalg.norm(np.diff(array, axis=0), axis=1)
    if chords.min() <= 1e-12 * chords.sum():
        raise InputError(where, "distinct neighbouring points", "two points in one place")
    knots = np.concatenate([[0.0], np.cumsum(chords)]) / chords.sum()
    knots[-1] = 1.0
    from scipy.interpolate import make_interp_spline  # slow to import, and rarely needed

    spline = make_interp_spline(knots, array, k=5)
    return Curve(spline, spline.derivative())


def fitted(points: object, fiber: Fiber, *, where: str = "points") -> Curve:
    """Return the curve through `points`, scaled to the fiber's length if within 1 % of it."""
    curve = through_points(points, where=where)
    length = curve.length()
    if abs(length - fiber.length) > LENGTH_TOLERANCE * fiber.length:
        raise InputError(
            where,
            f"a curve of length {fiber.length:.6g} within 1 %",
            f"length {length:.6g}",
            "Scale the points, or set the fiber's length.",
        )
    return scaled(curve, fiber)
