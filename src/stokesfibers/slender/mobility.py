"""Mobilities: how the force per length moves the centreline, (1)-(3) and (15).

A mobility is a local operator ``Lambda[g] = a g + b x_s (x_s . g)`` and the shape-free weights of
a finite-part operator, which are zero for the purely local model. The velocity is
``8 pi mu (x_t - U_0) = -Lambda[f] - K[f]`` with f the force of the fluid on the fiber, as in (2).
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from functools import lru_cache
from math import log
from typing import ClassVar

import numpy as np

from stokesfibers.numerics.product_integration import (
    FinitePartWeights,
    finite_part_weights,
    no_finite_part,
)
from stokesfibers.slender.regularization import AbstractRegularization, PaperRegularization


@dataclass(frozen=True)
class LocalOperator:
    """Coefficients of ``Lambda[g] = a g + b x_s (x_s . g)``; dimensionless.

    Attributes
    ----------
    a
        Coefficient of g: the drag across the fiber is 1 / a.
    b
        Coefficient of the tangential part: the drag along the fiber is 1 / (a + b).
    """

    a: float
    b: float


def slenderness_constant(eps: float) -> float:
    """Return c = log(eps^2 e) < 0 of (3)."""
    return log(eps**2) + 1.0


class AbstractMobility(abc.ABC):
    """A choice of local operator and finite-part operator."""

    kind: ClassVar[str]
    citation: ClassVar[str]

    @abc.abstractmethod
    def local(self, eps: float) -> LocalOperator:
        """Return the local operator for slenderness `eps`."""

    def resolved(self, regularization: AbstractRegularization) -> AbstractMobility:  # noqa: ARG002
        """Return the mobility with an engine's own `regularization` where it has none."""
        return self

    @abc.abstractmethod
    def weights(self, intervals: int, eps: float) -> FinitePartWeights:
        """Return the weights of the finite-part operator on `intervals` equal intervals."""


@dataclass(frozen=True)
class NonLocal(AbstractMobility):
    """Non-local slender body theory, (2), (3) and (15).

    Attributes
    ----------
    regularization
        delta(s) of the finite-part operator; None for that of the engine.
    """

    regularization: AbstractRegularization | None = None
    kind: ClassVar[str] = "nonlocal"
    citation: ClassVar[str] = "Keller & Rubinow 1976; Johnson 1980; Tornberg & Shelley 2004, (2)"

    def local(self, eps: float) -> LocalOperator:
        c = slenderness_constant(eps)
        return LocalOperator(a=2.0 - c, b=-(2.0 + c))

    def resolved(self, regularization: AbstractRegularization) -> NonLocal:
        return self if self.regularization is not None else NonLocal(regularization)

    def weights(self, intervals: int, eps: float) -> FinitePartWeights:
        return _cached_weights(self.regularization or PaperRegularization(), intervals, eps)


@dataclass(frozen=True)
class LocalDrag(AbstractMobility):
    """The local drag model (1) with -c = -log(eps^2 e), without the term 2 (I - ss)."""

    kind: ClassVar[str] = "local_drag"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, (1)"

    def local(self, eps: float) -> LocalOperator:
        c = slenderness_constant(eps)
        return LocalOperator(a=-c, b=-c)

    def weights(self, intervals: int, eps: float) -> FinitePartWeights:  # noqa: ARG002
        return no_finite_part(intervals)


@lru_cache(maxsize=16)
def _cached_weights(
    regularization: AbstractRegularization, intervals: int, eps: float
) -> FinitePartWeights:
    nodes = np.linspace(0.0, 1.0, intervals + 1)
    half = (np.arange(intervals) + 0.5) / intervals
    return finite_part_weights(regularization.delta(nodes, eps), regularization.delta(half, eps))
