"""What a fiber is: length, slenderness, rigidity. Radius profile r(s) = 2 eps sqrt(s (L - s))."""

from __future__ import annotations

from dataclasses import dataclass
from math import e

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError

LARGEST_SLENDERNESS = e**-1.5
"""c + 2 changes sign here: the drag across the fiber would turn negative."""
RADIUS_PROFILE = "r(s) = 2 eps sqrt(s (L - s)), so that r(L/2) = eps L"

MOST_FIBERS = 10_000_000
"""Of one kind: more is a slip, and would fill the memory before anything else is looked at."""


@dataclass(frozen=True)
class Fiber:
    """One kind of fiber, `count` times.

    Attributes
    ----------
    length
        L, in units of length.
    slenderness
        eps = r(L/2) / L. Give this or `radius`.
    rigidity
        E, bending rigidity, in units of force times length squared.
    radius
        r(L/2), in units of length. Give this or `slenderness`.
    count
        Number of such fibers.
    """

    length: float = 1.0
    slenderness: float | None = None
    rigidity: float = 1.0
    radius: float | None = None
    count: int = 1

    def __post_init__(self) -> None:
        checks.positive("length", self.length)
        checks.positive("rigidity", self.rigidity)
        checks.whole("count", self.count, 1, MOST_FIBERS)
        if (self.slenderness is None) == (self.radius is None):
            came = "neither" if self.radius is None else "both"
            raise InputError("slenderness", "either slenderness or radius", came)
        name = "slenderness" if self.radius is None else "radius"
        checks.positive(name, getattr(self, name))
        if self.eps >= LARGEST_SLENDERNESS:
            raise InputError(
                name,
                f"a slenderness (radius at mid-length / length) below {LARGEST_SLENDERNESS:.4f}",
                f"{self.eps:.6g}",
                "Slender body theory needs thin fibers; above 0.05 its error is large.",
            )

    @property
    def eps(self) -> float:
        """Slenderness r(L/2) / L."""
        if self.slenderness is not None:
            return float(self.slenderness)
        assert self.radius is not None
        return float(self.radius) / float(self.length)
