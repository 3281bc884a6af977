"""Several background flows at once; Stokes flows add."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np

from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.errors import InputError
from stokesfibers.flow.base import AbstractFlow, as_points


@final
@dataclass(frozen=True)
class SumOfFlows(AbstractFlow):
    """The sum of several flows, U = U_1 + U_2 + ..., added in the order given.

    Attributes
    ----------
    flows
        The parts, at least one; sums may hold sums.
    """

    kind: ClassVar[str] = "sum"

    flows: tuple[AbstractFlow, ...]

    def __post_init__(self) -> None:
        if not isinstance(self.flows, tuple | list) or not self.flows:
            raise InputError("flows", "a list of one or more flows", repr(self.flows))
        for i, flow in enumerate(self.flows):
            if not isinstance(flow, AbstractFlow):
                raise InputError(f"flows[{i}]", "a flow such as Shear(rate=1.0)", repr(flow))
        object.__setattr__(self, "flows", tuple(self.flows))

    def velocity(self, x: Points, t: float) -> Points:
        points = as_points(x)
        total = np.zeros_like(points)
        for flow in self.flows:
            total += flow.velocity(points, t)
        return total

    def gradient(self, x: Points, t: float) -> Array:
        points = as_points(x)
        total = np.zeros((*points.shape, 3))
        for flow in self.flows:
            total += flow.gradient(points, t)
        return total

    def rate_scale(self) -> float:
        """Return the sum of the parts' rates [1/time]: an upper bound, as parts may cancel."""
        return sum(flow.rate_scale() for flow in self.flows)
