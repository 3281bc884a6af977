"""Helpers of the tests: comparisons that can fail, orders of convergence, smooth test curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import xarray as xr
from numpy.polynomial import Chebyshev

from stokesfibers.core.arrays import Array
from stokesfibers.flow import AbstractFlow
from stokesfibers.problem.problem import Problem
from stokesfibers.stepping.paper import Carry, PaperStepper


def assert_close(actual, expected, *, rtol: float = 0.0, atol: float = 0.0) -> None:
    """Assert |actual - expected| <= atol + rtol max|expected| everywhere.

    Both tolerances zero asks for equality. The tolerance is relative to the largest entry, since
    the arrays of these tests hold entries near zero. What could not fail is refused.

    Raises
    ------
    ValueError
        If the tolerances are negative, NaN, or so wide that zero would pass for `expected`.
    AssertionError
        If shapes differ, anything is NaN or infinite, or the difference is too large.
    """
    actual, expected = np.asarray(actual), np.asarray(expected)
    if not (rtol >= 0.0 and atol >= 0.0):
        raise ValueError(f"tolerances must be zero or more: rtol={rtol}, atol={atol}")
    assert actual.shape == expected.shape, f"shapes differ: {actual.shape}, {expected.shape}"
    assert actual.size > 0, "nothing to compare"
    assert np.isfinite(expected).all(), "expected values are not finite"
    assert np.isfinite(actual).all(), "actual values are not finite"
    scale = float(np.abs(expected).max())
    tolerance = atol + rtol * scale
    if tolerance > 0.0 and tolerance >= scale:
        raise ValueError(f"vacuous: tolerance {tolerance:.3g} against values up to {scale:.3g}")
    difference = np.abs(actual - expected)
    worst = np.unravel_index(int(np.argmax(difference)), difference.shape)
    assert difference[worst] <= tolerance, (
        f"largest difference {difference[worst]:.6g} at {tuple(map(int, worst))} exceeds "
        f"{tolerance:.3g}: {actual[worst]!r} against {expected[worst]!r}"
    )


def assert_negligible(actual, *, scale: float, rtol: float) -> None:
    """Assert |actual| <= rtol scale, where `scale` is the size of what cancels; rtol < 1e-3."""
    if not (np.isfinite(scale) and scale > 0.0 and 0.0 < rtol < 1e-3):
        raise ValueError(f"vacuous: scale={scale}, rtol={rtol}")
    actual = np.asarray(actual)
    assert np.isfinite(actual).all(), "actual values are not finite"
    largest = float(np.abs(actual).max())
    assert largest <= rtol * scale, f"{largest:.6g} exceeds {rtol:.3g} of {scale:.6g}"


def observed_orders(errors, ratio: float = 2.0) -> Array:
    """Return log(e_k / e_{k+1}) / log(ratio) of errors on grids refined by `ratio`."""
    errors = np.asarray(errors, dtype=float)
    assert np.isfinite(errors).all(), f"errors are not finite: {errors}"
    assert (errors > 0.0).all(), f"errors vanish: {errors}"
    return np.log(errors[:-1] / errors[1:]) / np.log(ratio)


def assert_order(errors, *, between: tuple[float, float], final: float, ratio: float = 2.0) -> None:
    """Assert that the last observed order lies in an interval and the last error below `final`.

    `final` may not exceed the last error by more than a factor 4, so that it watches it.
    """
    orders = observed_orders(errors, ratio)
    low, high = between
    last = float(np.asarray(errors)[-1])
    assert low <= orders[-1] <= high, f"orders {orders} of errors {errors}"
    assert last <= final, f"final error {last:.4g} exceeds {final:.4g}; errors {errors}"
    if final > 4.0 * last:
        raise ValueError(f"final = {final:.3g} is too wide for a last error {last:.3g}")


@dataclass(frozen=True)
class SpaceCurve:
    """A smooth curve in space by arclength in [0, 1], with all its derivatives to rounding.

    Attributes
    ----------
    components
        Chebyshev series of x, y, z.
    """

    components: tuple[Chebyshev, Chebyshev, Chebyshev]

    @classmethod
    def from_angles(
        cls, azimuth: Callable[[Array], Array], elevation: Callable[[Array], Array]
    ) -> SpaceCurve:
        """Return the curve with unit tangent (cos az cos el, sin az cos el, sin el)."""
        tangents = (
            lambda s: np.cos(azimuth(s)) * np.cos(elevation(s)),
            lambda s: np.sin(azimuth(s)) * np.cos(elevation(s)),
            lambda s: np.sin(elevation(s)),
        )
        series = [Chebyshev.interpolate(t, 40, domain=[0, 1]).trim(1e-15) for t in tangents]
        x, y, z = (t.integ(lbnd=0.5) for t in series)
        return cls((x, y, z))

    def __call__(self, s: Array, order: int = 0) -> Array:
        """Return the derivative of `order` at arclengths s, (3, *s.shape)."""
        parts = [c.deriv(order) if order else c for c in self.components]
        return np.stack([c(np.asarray(s, dtype=float)) for c in parts])

    def nodes(self, intervals: int) -> Array:
        """Return the points at equally spaced arclengths, (3, node)."""
        return self(np.linspace(0.0, 1.0, intervals + 1))


def helical_curve() -> SpaceCurve:
    """Return a curve without symmetry, bent and twisted up to its ends."""
    return SpaceCurve.from_angles(
        lambda s: 0.4 + 1.9 * s + 0.5 * np.sin(3.0 * s), lambda s: 0.2 - 0.9 * s + 0.7 * s**2
    )


def free_end_curve(bend: float = 30.0, twist: float = 18.0) -> SpaceCurve:
    """Return a curve without symmetry with x_ss = x_sss = 0 at both ends."""
    # The angles' first and second derivatives vanish at 0 and 1.
    rise = np.polynomial.Polynomial([0, 0, 0, 1 / 3, -1 / 2, 1 / 5])  # integral of s^2 (1-s)^2
    skew = np.polynomial.Polynomial([0, 0, 0, 0, 1 / 4, -2 / 5, 1 / 6])
    return SpaceCurve.from_angles(
        lambda s: 0.3 + bend * rise(s) + 10.0 * skew(s),
        lambda s: 0.1 + twist * (rise(s) - 2.0 * skew(s)) + 15.0 * skew(s),
    )


def advance(problem: Problem, positions: Array, steps: int) -> tuple[PaperStepper, Carry]:
    """Return the stepper of `problem` and its carry after `steps` from positions (3, node)."""
    stepper = PaperStepper(problem)
    carry = stepper.init(np.ascontiguousarray(positions.T)[None])
    for _ in range(steps):
        carry, _ = stepper.step(carry)
    return stepper, carry


def assert_same(found: xr.DataTree, whole: xr.DataTree) -> None:
    """Assert that everything recorded but wall times is bitwise the same."""
    compared = 0
    for group in ("trajectory", "observables", "numerics"):
        one, other = found[group].to_dataset(), whole[group].to_dataset()
        assert set(one.variables) == set(other.variables)
        for name in set(one.variables) - {"wall_time", "space", "i", "j", "stage"}:
            a, b = one[name].to_numpy(), other[name].to_numpy()
            assert a.shape == b.shape, name
            assert a.dtype == b.dtype, name
            assert a.tobytes() == b.tobytes(), name
            compared += 1
    assert compared > 15


@dataclass(frozen=True)
class LinearFlow(AbstractFlow):
    """U_i = g_ij x_j."""

    kind: ClassVar[str] = "linear"
    matrix: tuple[tuple[float, ...], ...]

    def velocity(self, x, t):  # noqa: ARG002
        return x @ np.array(self.matrix).T

    def gradient(self, x, t):  # noqa: ARG002
        return np.broadcast_to(self.matrix, (*x.shape, 3))

    def rate_scale(self):
        return 1.0
