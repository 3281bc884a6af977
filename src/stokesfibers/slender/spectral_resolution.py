"""How well Legendre modes resolve the shapes they stand for, and how many nodes would."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.arrays import Array
from stokesfibers.numerics.legendre import LEAST_NODES


@dataclass(frozen=True)
class Resolution:
    """How well shapes are resolved, judged by the decay of their modes.

    Attributes
    ----------
    error
        Estimated error of each shape through lack of nodes, relative to the length, (...).
    decay
        Rate: the error falls like exp(-decay nodes); zero if the modes do not decay, (...).
    nodes
        Number of nodes.
    """

    error: Array
    decay: Array
    nodes: int

    def nodes_for(self, tolerance: float) -> NDArray[np.int64]:
        """Return the numbers of nodes, even ones, that would err by `tolerance`, (...)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            more = np.log(np.maximum(self.error, 1e-300) / tolerance) / self.decay
        stuck = np.where(self.error <= tolerance, 0.0, self.nodes)
        wanted = self.nodes + np.where(self.decay > 0.0, more, stuck)
        return 2 * np.ceil(0.5 * np.clip(wanted, LEAST_NODES, 2 * self.nodes)).astype(np.int64)
