"""Orientation distributions of straight fibers."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError

Axis = tuple[float, float, float]
_TINY, _HUGE = 1e-150, 1e150


class AbstractOrientation(abc.ABC):
    """A distribution of unit vectors."""

    kind: ClassVar[str]

    @abc.abstractmethod
    def sample(self, count: int, random: np.random.Generator) -> Points:
        """Return `count` unit vectors, (count, 3)."""


def _checked(where: str, axis: object) -> Axis:
    """Return a vector as it is given; InputError if it is zero."""
    vector = checks.vector3(where, axis)
    if not any(vector):
        raise InputError(where, "a vector that is not zero", axis)
    return vector


def _unit(axis: Axis) -> Array:
    vector = np.array(axis)
    largest = float(np.abs(vector).max())
    if not _TINY < largest < _HUGE:  # its square would not be a number above zero
        vector = vector / largest
    return vector / np.linalg.norm(vector)


def _sphere(count: int, random: np.random.Generator) -> Array:
    vectors = random.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@dataclass(frozen=True)
class Isotropic(AbstractOrientation):
    """Uniform on the sphere."""

    kind: ClassVar[str] = "isotropic"

    def sample(self, count: int, random: np.random.Generator) -> Points:
        return _sphere(count, random)


@dataclass(frozen=True)
class Aligned(AbstractOrientation):
    """All along `axis`.

    Attributes
    ----------
    axis
        Their direction, of any length above zero.
    """

    axis: Axis = (1.0, 0.0, 0.0)
    kind: ClassVar[str] = "aligned"

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", _checked("axis", self.axis))

    def sample(self, count: int, random: np.random.Generator) -> Points:  # noqa: ARG002
        return np.tile(_unit(self.axis), (count, 1))


@dataclass(frozen=True)
class InPlane(AbstractOrientation):
    """Uniform on the circle across `normal`.

    Attributes
    ----------
    normal
        Normal of the plane that fibers lie in, of any length above zero.
    """

    normal: Axis = (0.0, 0.0, 1.0)
    kind: ClassVar[str] = "in_plane"

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", _checked("normal", self.normal))

    def sample(self, count: int, random: np.random.Generator) -> Points:
        normal = _unit(self.normal)
        vectors = _sphere(count, random)
        vectors -= np.outer(vectors @ normal, normal)
        return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@dataclass(frozen=True)
class VonMisesFisher(AbstractOrientation):
    """Von Mises-Fisher distribution about `axis`.

    Attributes
    ----------
    axis
        Mean direction, of any length above zero.
    concentration
        kappa, above zero; a larger one is narrower.
    """

    axis: Axis = (1.0, 0.0, 0.0)
    concentration: float = 10.0
    kind: ClassVar[str] = "von_mises_fisher"

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", _checked("axis", self.axis))
        checks.positive("concentration", self.concentration)

    def sample(self, count: int, random: np.random.Generator) -> Points:
        from scipy.stats import vonmises_fisher  # slow to import, and rarely needed

        kappa: Any = self.concentration
        spread = vonmises_fisher(_unit(self.axis), kappa)
        drawn = spread.rvs(count, random_state=random)
        return np.asarray(drawn).reshape(count, 3)


ORIENTATIONS: dict[str, type[AbstractOrientation]] = {
    o.kind: o for o in (Isotropic, Aligned, InPlane, VonMisesFisher)
}
