"""Periodic images (Section 3.4): the nearest exactly, the next ones by six moments, (42).

Along each periodic direction images |p| <= 1 about the nearest one are summed exactly, those with
2 <= |p| <= Q through the moments (41) of each fiber. In one direction the rest decays as p^-3.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from itertools import product
from typing import ClassVar, Literal

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.domain import AbstractDomain

About = Literal["midpoint", "centre_of_mass"]


class AbstractImageSum(abc.ABC):
    """A way to sum over periodic images."""

    kind: ClassVar[str]
    citation: ClassVar[str]
    most_directions: ClassVar[int]
    reach: int
    about: About

    def shifts(self, domain: AbstractDomain) -> tuple[Array, Array, Array]:
        """Return periods (3,), shifts of the exact images (image, 3), of the far ones (3, image).

        Images are taken in a cube of lattice vectors about the nearest one.
        """
        lengths = domain.lengths
        ranges = [range(-self.reach, self.reach + 1) if d > 0.0 else range(1) for d in lengths]
        index = np.array(list(product(*ranges)), dtype=float)
        exact = np.abs(index).max(axis=1) <= 1.0
        shifts = index * lengths
        return lengths, np.ascontiguousarray(shifts[exact]), np.ascontiguousarray(shifts[~exact].T)


def _check(choice: AbstractImageSum) -> None:
    checks.whole("reach", choice.reach, 1)
    if choice.about not in ("midpoint", "centre_of_mass"):
        raise InputError("about", "'midpoint' or 'centre_of_mass'", repr(choice.about))


@dataclass(frozen=True)
class FastImages(AbstractImageSum):
    """All fibers and all their images by a fast Ewald sum, for the high-order engine.

    For free space and one to three periodic directions; the cost grows like the number of fibers.

    Attributes
    ----------
    tolerance
        Relative rms error of the velocities between fibers; None for what the engine's own
        tolerance asks for.
    split
        ``"prolate"``, or ``"gaussian"`` for Hasimoto's, dearer and there to compare.
    cutoff
        Of the near part, in units of length; None for the cheapest. The result does not depend
        on it to the tolerance; what was chosen is recorded at each step.
    """

    tolerance: float | None = None
    split: str = "prolate"
    cutoff: float | None = None
    kind: ClassVar[str] = "ewald"
    citation: ClassVar[str] = "stokesfibers, theory page 'Ewald sums'"
    most_directions: ClassVar[int] = 3
    reach: ClassVar[int] = 1  # pyright: ignore[reportIncompatibleVariableOverride]
    about: ClassVar[About] = "centre_of_mass"  # pyright: ignore[reportIncompatibleVariableOverride]

    def __post_init__(self) -> None:
        tolerance = self.tolerance
        if tolerance is not None and not 1e-12 <= checks.positive("tolerance", tolerance) <= 1e-2:
            raise InputError("tolerance", "a number from 1e-12 to 1e-2", tolerance)
        if self.split not in ("prolate", "gaussian"):
            raise InputError("split", "'prolate' or 'gaussian'", repr(self.split))
        if self.cutoff is not None:
            checks.positive("cutoff", self.cutoff)


@dataclass(frozen=True)
class ImageSum(AbstractImageSum):
    """The paper's approximate image sum, for one periodic direction.

    Attributes
    ----------
    reach
        Q: images up to |p| = Q are included.
    about
        The point that stands for a far image: ``"midpoint"`` as in the paper, or
        ``"centre_of_mass"``, which is 3.5 times more accurate at no cost.
    """

    reach: int = 20
    about: About = "midpoint"
    kind: ClassVar[str] = "images"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, (41), (42)"
    most_directions: ClassVar[int] = 1

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True)
class TruncatedSum(AbstractImageSum):
    """The same sum for two or three periodic directions, cut off at a cube of images.

    The terms fall as the inverse square of the distance while their number grows as its first or
    second power: the sum converges slowly, or only for the shape it is cut off at. Use it to
    compare, not to rely on.

    Attributes
    ----------
    reach
        Images up to this number in each direction are included.
    about
        As for `ImageSum`.
    """

    reach: int = 2
    about: About = "midpoint"
    kind: ClassVar[str] = "truncated"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, (19), truncated"
    most_directions: ClassVar[int] = 3

    def __post_init__(self) -> None:
        _check(self)


class EngineImages(AbstractImageSum):
    """Whatever the engine uses unless told otherwise; a problem replaces it."""

    kind: ClassVar[str] = "engine's own"
    citation: ClassVar[str] = ""
    most_directions: ClassVar[int] = 1
    reach: ClassVar[int] = 1  # pyright: ignore[reportIncompatibleVariableOverride]
    about: ClassVar[About] = "midpoint"  # pyright: ignore[reportIncompatibleVariableOverride]
