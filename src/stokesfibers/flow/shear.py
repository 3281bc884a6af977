"""Shear along x that varies with y: steady, oscillating (paper, section 4.2), or any rate(t)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, final

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError
from stokesfibers.flow.base import AbstractFlow, as_points, qualified_name
from stokesfibers.flow.source import SourceFile, sources_of


@final
@dataclass(frozen=True)
class Shear(AbstractFlow):
    """Steady shear, U = (rate y, 0, 0).

    Attributes
    ----------
    rate
        Shear rate [1/time], any sign. A positive rate turns a fiber clockwise in the (x, y) plane.
    """

    kind: ClassVar[str] = "shear"

    rate: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate", checks.finite("rate", self.rate))

    def velocity(self, x: Points, t: float) -> Points:  # noqa: ARG002
        return _shear_velocity(self.rate, x)

    def gradient(self, x: Points, t: float) -> Array:  # noqa: ARG002
        return _shear_gradient(self.rate, x)

    def rate_scale(self) -> float:
        return abs(self.rate)

    def strain(self, t: float) -> float:
        return self.rate * t


@final
@dataclass(frozen=True)
class OscillatoryShear(AbstractFlow):
    """Oscillating shear, U = (amplitude sin(2 pi frequency t) y, 0, 0) (paper, section 4.2).

    Attributes
    ----------
    amplitude
        Largest shear rate [1/time], any sign.
    frequency
        Cycles per time [1/time], above zero; not an angular frequency. In Python
        it is given by name.
    """

    kind: ClassVar[str] = "oscillatory_shear"

    amplitude: float = 1.0
    frequency: float = field(kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitude", checks.finite("amplitude", self.amplitude))
        object.__setattr__(self, "frequency", checks.positive("frequency", self.frequency))

    def velocity(self, x: Points, t: float) -> Points:
        return _shear_velocity(self._rate(t), x)

    def gradient(self, x: Points, t: float) -> Array:
        return _shear_gradient(self._rate(t), x)

    def rate_scale(self) -> float:
        return abs(self.amplitude)

    def strain(self, t: float) -> float:
        turn = math.pi * self.frequency
        return self.amplitude / turn * math.sin(turn * t) ** 2

    def _rate(self, t: float) -> float:
        return self.amplitude * math.sin(2.0 * math.pi * self.frequency * t)


@final
@dataclass(frozen=True)
class TimeDependentShear(AbstractFlow):
    """Shear whose rate is a function of time, U = (rate(t) y, 0, 0).

    Attributes
    ----------
    rate
        Function of the time that returns the shear rate [1/time], a finite number.
    scale
        Typical size of the rate [1/time], zero or above; only `rate_scale` uses it.
    sources
        Files that define the function; found when the flow is made.
    """

    kind: ClassVar[str] = "time_dependent_shear"

    rate: Callable[[float], float]
    scale: float = 1.0
    sources: tuple[SourceFile, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not callable(self.rate):
            raise InputError(
                "rate", "a function of the time", self.rate, "For a constant rate use Shear."
            )
        object.__setattr__(self, "scale", checks.non_negative("scale", self.scale))
        object.__setattr__(self, "sources", sources_of(self.rate))

    def velocity(self, x: Points, t: float) -> Points:
        return _shear_velocity(self._rate(t), x)

    def gradient(self, x: Points, t: float) -> Array:
        return _shear_gradient(self._rate(t), x)

    def rate_scale(self) -> float:
        return self.scale

    def _rate(self, t: float) -> float:
        where = f"rate function '{qualified_name(self.rate)}' at t = {t:.6g}"
        try:
            value = self.rate(t)
        except Exception as error:
            raise InputError(
                where, "a finite number", f"{type(error).__name__}: {error}"
            ) from error
        return checks.finite(where, value)


def _shear_velocity(rate: float, x: Points) -> Points:
    x = as_points(x)
    velocity = np.zeros_like(x)
    velocity[..., 0] = rate * x[..., 1]
    return velocity


def _shear_gradient(rate: float, x: Points) -> Array:
    gradient = np.zeros((*as_points(x).shape, 3))
    gradient[..., 0, 1] = rate
    return gradient
