"""Steady stretching along x: uniaxial, and planar in the (x, y) plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.flow.base import AbstractFlow, as_points


@final
@dataclass(frozen=True)
class Extension(AbstractFlow):
    """Uniaxial extension along x, U = (rate x, -rate y/2, -rate z/2).

    Attributes
    ----------
    rate
        Rate of stretching along x [1/time]; negative compresses along x.
    """

    kind: ClassVar[str] = "extension"

    rate: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate", checks.finite("rate", self.rate))

    def velocity(self, x: Points, t: float) -> Points:  # noqa: ARG002
        return as_points(x) * _uniaxial(self.rate)

    def gradient(self, x: Points, t: float) -> Array:  # noqa: ARG002
        return _diagonal_gradient(_uniaxial(self.rate), x)

    def rate_scale(self) -> float:
        return abs(self.rate)


@final
@dataclass(frozen=True)
class PlanarExtension(AbstractFlow):
    """Planar extension, U = (rate x, -rate y, 0).

    Attributes
    ----------
    rate
        Rate of stretching along x [1/time]; negative compresses along x, stretches along y.
    """

    kind: ClassVar[str] = "planar_extension"

    rate: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate", checks.finite("rate", self.rate))

    def velocity(self, x: Points, t: float) -> Points:  # noqa: ARG002
        return as_points(x) * _planar(self.rate)

    def gradient(self, x: Points, t: float) -> Array:  # noqa: ARG002
        return _diagonal_gradient(_planar(self.rate), x)

    def rate_scale(self) -> float:
        return abs(self.rate)


def _uniaxial(rate: float) -> Array:
    return np.array([rate, -0.5 * rate, -0.5 * rate])


def _planar(rate: float) -> Array:
    return np.array([rate, -rate, 0.0])


def _diagonal_gradient(diagonal: Array, x: Points) -> Array:
    gradient = np.zeros((*as_points(x).shape, 3))
    for i, entry in enumerate(diagonal):
        gradient[..., i, i] = entry
    return gradient
