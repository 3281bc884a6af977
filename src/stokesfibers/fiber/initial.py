"""Initial shapes as records: what the table [initial] of a case says."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from math import hypot
from pathlib import Path
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.fiber import curves
from stokesfibers.fiber.curves import Curve
from stokesfibers.fiber.parameters import Fiber


class AbstractInitial(abc.ABC):
    """A way to lay out the fibers at time 0."""

    kind: ClassVar[str]

    @abc.abstractmethod
    def curves(self, fibers: tuple[Fiber, ...], periods: Array) -> tuple[Curve, ...]:
        """Return one centreline per fiber; `periods` (3,) of the domain, 0 where it is free."""


@dataclass(frozen=True)
class Straight(AbstractInitial):
    """Straight fibers.

    Attributes
    ----------
    angle
        Angle to the x-axis in the xy-plane, radians.
    tilt
        Angle out of the xy-plane, towards +z, radians.
    centre
        Mid-point, in units of length.
    """

    angle: float = 0.0
    tilt: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    kind: ClassVar[str] = "straight"

    def __post_init__(self) -> None:
        checks.finite("angle", self.angle)
        checks.finite("tilt", self.tilt)
        object.__setattr__(self, "centre", checks.vector3("centre", self.centre))

    def curves(self, fibers: tuple[Fiber, ...], periods: Array) -> tuple[Curve, ...]:  # noqa: ARG002
        given = {"angle": self.angle, "tilt": self.tilt, "centre": self.centre}
        return tuple(curves.straight(fiber, **given) for fiber in fibers)


@dataclass(frozen=True)
class NearlyStraight(AbstractInitial):
    """The paper's slightly bent shape (47).

    Attributes
    ----------
    angle
        theta_0, angle to the x-axis in the xy-plane, radians; default the paper's.
    amplitude
        d_y, in units of the fiber's length. It bends along y, by d_y / 256 of the length at most:
        20 is a bend of 0.08 L. Of that |cos(angle)| is across a fiber in the xy-plane.
    tilt
        Angle out of the xy-plane, towards +z, radians.
    centre
        Mid-point, in units of length.
    """

    angle: float = curves.PAPER_ANGLE
    amplitude: float = -1e-4
    tilt: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    kind: ClassVar[str] = "nearly_straight"

    def __post_init__(self) -> None:
        checks.finite("angle", self.angle)
        checks.finite("tilt", self.tilt)
        checks.finite("amplitude", self.amplitude)
        object.__setattr__(self, "centre", checks.vector3("centre", self.centre))

    def curves(self, fibers: tuple[Fiber, ...], periods: Array) -> tuple[Curve, ...]:  # noqa: ARG002
        return tuple(
            curves.nearly_straight(
                fiber,
                angle=self.angle,
                amplitude=self.amplitude,
                tilt=self.tilt,
                centre=self.centre,
            )
            for fiber in fibers
        )

    @property
    def bend(self) -> float:
        """The height of the arc, across the fiber and over its length, to first order."""
        return self.across * abs(self.amplitude) / 256.0

    @property
    def across(self) -> float:
        """The share of the bend that is across the fiber; 1 where there is no bend."""
        x, _, z = curves.direction_at(self.angle, self.tilt)
        return hypot(x, z) if self.amplitude else 1.0


@dataclass(frozen=True)
class FromFile(AbstractInitial):
    """Points from a file, resampled by arclength and scaled to the fiber's length.

    Attributes
    ----------
    path
        A .npy file of shape (fiber, point, 3), or (point, 3) for one fiber.
    """

    path: str
    kind: ClassVar[str] = "file"

    def __post_init__(self) -> None:
        if not isinstance(self.path, str):
            raise InputError("path", "the name of a .npy file", self.path)

    def curves(self, fibers: tuple[Fiber, ...], periods: Array) -> tuple[Curve, ...]:  # noqa: ARG002
        file = Path(self.path)
        if not file.is_file():
            raise InputError(
                "initial.path",
                "a .npy file",
                f"'{file}', which does not exist",
                "The path is relative to the case file.",
            )
        try:
            points = np.load(file, allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise InputError(
                "initial.path", "a .npy file of numbers", f"'{file}' ({error})"
            ) from None
        return given(points, fibers, where=f"initial.path '{file}'")


def given(
    points: np.ndarray, fibers: tuple[Fiber, ...], *, where: str = "points"
) -> tuple[Curve, ...]:
    """Return the curves through `points` (fiber, point, 3), or (point, 3) for one fiber."""
    if points.ndim == 2:
        points = points[None]
    if points.ndim != 3 or points.shape[0] != len(fibers) or points.shape[2] != 3:
        expected = f"an array of shape ({len(fibers)}, point, 3)"
        raise InputError(where, expected, f"shape {points.shape}")
    return tuple(
        curves.fitted(p, f, where=f"{where}, fiber {k}")
        for k, (p, f) in enumerate(zip(points, fibers, strict=True))
    )
