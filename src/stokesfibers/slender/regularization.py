"""Regularisations delta(s) of the finite-part operator: Section 2.4, (15), (16), and B.2.

Lengths are divided by the fiber's length; ``sigma = s / L``. The operator stays elliptic where
``delta(s)`` exceeds ``sqrt(e) r(s)`` with ``r(s) = 2 eps sqrt(sigma (1 - sigma))``; it changes the
unregularised theory by O(eps^2 log eps) if ``sqrt(s^2 + delta^2) - s = O(eps^2)`` at the ends.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from math import e, sqrt
from typing import ClassVar

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError


class AbstractRegularization(abc.ABC):
    """A choice of delta(s)."""

    kind: ClassVar[str]
    citation: ClassVar[str]

    @abc.abstractmethod
    def delta(self, sigma: Array, eps: float) -> Array:
        """Return delta / L at arclengths `sigma` in [0, 1] for slenderness `eps`."""


def _check_m(m: float, allow_small_m: bool) -> None:
    checks.positive("m", m)
    if m <= sqrt(e) and not allow_small_m:
        raise InputError(
            "m",
            "a number above sqrt(e) = 1.6487, so that the operator keeps its sign (B.2)",
            m,
            "The paper uses 2. Set allow_small_m = true to study the loss of ellipticity.",
        )


@dataclass(frozen=True)
class PaperRegularization(AbstractRegularization):
    """The paper's choice (16): m eps inside, a cubic ramp to zero at the ends.

    Well posed at finite resolution only: near the ends delta is below sqrt(e) r(s), and the
    smallest eigenvalue turns negative once the nodes resolve that region.

    Attributes
    ----------
    m
        delta at mid-length divided by eps.
    ramp
        gamma of (16), the fraction of the length over which delta falls to zero.
    allow_small_m
        Accept m <= sqrt(e).
    """

    m: float = 2.0
    ramp: float = 0.1
    allow_small_m: bool = False
    kind: ClassVar[str] = "paper"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, (16)"

    def __post_init__(self) -> None:
        _check_m(self.m, self.allow_small_m)
        if not 0.0 < checks.positive("ramp", self.ramp) <= 0.5:
            raise InputError("ramp", "a number in (0, 0.5]", self.ramp, "The paper uses 0.1.")

    def delta(self, sigma: Array, eps: float) -> Array:
        xi = np.minimum(1.0, np.minimum(sigma, 1.0 - sigma) / self.ramp)
        return self.m * eps * xi**2 * (3.0 - 2.0 * xi)


@dataclass(frozen=True)
class ConstantRegularization(AbstractRegularization):
    """delta = m eps everywhere: elliptic at every resolution, but only O(eps) near the ends.

    Attributes
    ----------
    m
        delta divided by eps.
    allow_small_m
        Accept m <= sqrt(e).
    """

    m: float = 2.0
    allow_small_m: bool = False
    kind: ClassVar[str] = "constant"
    citation: ClassVar[str] = "Shelley & Ueda 2000; Tornberg & Shelley 2004, B.2"

    def __post_init__(self) -> None:
        _check_m(self.m, self.allow_small_m)

    def delta(self, sigma: Array, eps: float) -> Array:
        return np.full_like(np.asarray(sigma, dtype=float), self.m * eps)


@dataclass(frozen=True)
class SpheroidalRegularization(AbstractRegularization):
    """delta = 2 m eps sqrt(sigma (1 - sigma) + 4 eps^2): proportional to the spheroid's radius.

    Rounded off within eps^2 of the ends, it is elliptic at every resolution and keeps the
    asymptotic accuracy of the unregularised theory. At mid-length it equals the paper's m eps.

    Attributes
    ----------
    m
        delta at mid-length divided by eps.
    allow_small_m
        Accept m <= sqrt(e).
    """

    m: float = 2.0
    allow_small_m: bool = False
    kind: ClassVar[str] = "spheroidal"
    citation: ClassVar[str] = "stokesfibers, theory page 'Regularisation'"

    def __post_init__(self) -> None:
        _check_m(self.m, self.allow_small_m)

    def delta(self, sigma: Array, eps: float) -> Array:
        return 2.0 * self.m * eps * np.sqrt(sigma * (1.0 - sigma) + 4.0 * eps**2)


@dataclass(frozen=True)
class NoRegularization(AbstractRegularization):
    """delta = 0: the original operator (4). Only for straight fibers and the study of B.1."""

    kind: ClassVar[str] = "none"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, (4)"

    def delta(self, sigma: Array, eps: float) -> Array:  # noqa: ARG002
        return np.zeros_like(np.asarray(sigma, dtype=float))


REGULARIZATIONS: dict[str, type[AbstractRegularization]] = {
    r.kind: r
    for r in (
        PaperRegularization,
        ConstantRegularization,
        SpheroidalRegularization,
        NoRegularization,
    )
}
