"""What every external force offers: a force per length g on the fibers, its stress, its energy."""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stokesfibers.core.arrays import Array, Positions
from stokesfibers.domain import AbstractDomain


@dataclass(frozen=True)
class LoadedState:
    """What a load may depend on.

    Attributes
    ----------
    positions
        (fiber, node, space).
    weights
        Quadrature weights in arclength, (fiber, node).
    radii
        r(L/2) of each fiber, (fiber,).
    domain
        Free or periodic space, at that time.
    time
        t.
    """

    positions: Positions
    weights: Array
    radii: Array
    domain: AbstractDomain
    time: float = 0.0


class AbstractLoad(abc.ABC):
    """An external force density g, in units of force / length; f = elastic force - g."""

    kind: ClassVar[str]
    citation: ClassVar[str]
    has_net_force: ClassVar[bool] = False
    """Whether all its forces together need not vanish; then not all periodic domains allow it."""

    @abc.abstractmethod
    def density(self, state: LoadedState) -> Positions:
        """Return g at the nodes, (fiber, node, space)."""

    @abc.abstractmethod
    def stress(self, state: LoadedState) -> Array:
        """Return what the load adds to the extra stress of all fibers, (3, 3), force length."""


@dataclass(frozen=True)
class NoLoad(AbstractLoad):
    """No external force."""

    kind: ClassVar[str] = "none"
    citation: ClassVar[str] = ""

    def density(self, state: LoadedState) -> Positions:
        return np.zeros_like(state.positions)

    def stress(self, state: LoadedState) -> Array:  # noqa: ARG002
        return np.zeros((3, 3))
