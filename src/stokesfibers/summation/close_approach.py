"""Close approach (Section 3.3.3): finer quadrature near another fiber, and a blend at contact.

Where a target is within 12 h of another fiber, the intervals near it are cut in five. Where its
distance d to the other centreline is below 2 d_0, the velocity is blended with that centreline's
own, and equals it for d <= d_0. By default d_0 = max(h, 2 eps L): the model then changes with the
grid near contact, so fix d_0 in convergence studies.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array


class AbstractCloseApproach(abc.ABC):
    """A treatment of targets near another fiber."""

    kind: ClassVar[str]
    citation: ClassVar[str]
    smooth: ClassVar[bool]
    d0: float | None
    near: float
    parts: int

    def settings(self, spacing: Array, radius: Array) -> tuple[float, float, Array, bool]:
        """Return what the kernels need: near, parts, d_0 of each fiber (fiber,), smooth."""
        d0 = np.maximum(spacing, 2.0 * radius)
        if self.d0 is not None:
            d0 = np.full_like(d0, self.d0)
        return float(self.near), float(self.parts), d0, self.smooth


def _check(approach: AbstractCloseApproach) -> None:
    if approach.d0 is not None:
        checks.positive("d0", approach.d0)
    checks.non_negative("near", approach.near)
    checks.whole("parts", approach.parts, 1)


@dataclass(frozen=True)
class PaperCloseApproach(AbstractCloseApproach):
    """The paper's: linear blend between d_0 and 2 d_0, only continuous.

    Attributes
    ----------
    d0
        d_0, in units of length; None for max(h, 2 eps L) of the near fiber.
    near
        Distance in units of h below which intervals are refined.
    parts
        Into how many parts an interval is cut.
    """

    d0: float | None = None
    near: float = 12.0
    parts: int = 5
    kind: ClassVar[str] = "paper"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, Section 3.3.3"
    smooth: ClassVar[bool] = False

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True)
class SmoothCloseApproach(AbstractCloseApproach):
    """As the paper's, with a blend of two continuous derivatives.

    Attributes
    ----------
    d0
        d_0, in units of length; default 2 eps L of the near fiber, with the paper's engine at
        least h.
    near, parts
        As the paper's; for its engine only.
    """

    d0: float | None = None
    near: float = 12.0
    parts: int = 5
    kind: ClassVar[str] = "smooth"
    citation: ClassVar[str] = "stokesfibers, theory page 'Close approach'"
    smooth: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True)
class EngineCloseApproach(AbstractCloseApproach):
    """Whatever the engine uses unless told otherwise; a problem replaces it."""

    kind: ClassVar[str] = "engine's own"
    citation: ClassVar[str] = ""
    smooth: ClassVar[bool] = True
    d0: ClassVar[float | None] = None  # pyright: ignore[reportIncompatibleVariableOverride]
    near: ClassVar[float] = 12.0  # pyright: ignore[reportIncompatibleVariableOverride]
    parts: ClassVar[int] = 5  # pyright: ignore[reportIncompatibleVariableOverride]


CLOSE_APPROACHES: dict[str, type[AbstractCloseApproach]] = {
    c.kind: c for c in (PaperCloseApproach, SmoothCloseApproach)
}
