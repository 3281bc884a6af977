"""Values with weights: their quantiles, and the share of larger ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_CURVE = 400  # points of a smooth curve


@dataclass(frozen=True)
class Sample:
    """Values at one time in ascending order, with the share of each; the shares add up to 1."""

    values: Floats
    shares: Floats

    def quantiles(self, levels: ArrayLike) -> Floats:
        """Return the smallest value below or at which at least a share of each level lies."""
        at = np.searchsorted(np.cumsum(self.shares), np.asarray(levels) * (1.0 - 1e-12))
        return self.values[np.minimum(at, len(self.values) - 1)]

    def beyond(self) -> Floats:
        """Return the share of larger values, beside each value."""
        return np.maximum(1.0 - np.cumsum(self.shares), 0.0)

    def curve(self, span: tuple[float, float], *, smooth: bool) -> tuple[Floats, Floats]:
        """Return values over the span, and the share of what is larger beside each.

        A smooth one is of as many values as a column can show; else there is a step at each.
        """
        if not smooth:
            values = np.concatenate([[span[0]], self.values, [span[1]]])
            return values, np.concatenate([[1.0], self.beyond(), [0.0]])
        values = np.linspace(*span, _CURVE)
        upto = np.concatenate([[0.0], np.cumsum(self.shares)])
        below = upto[np.searchsorted(self.values, values, side="right")]
        return values, np.maximum(1.0 - below, 0.0)
