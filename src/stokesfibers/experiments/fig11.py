"""Fig. 11: the suspension at the reversal amid the second period, and at its largest energy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.experiments import oscillating
from stokesfibers.experiments.base import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

run = oscillating.run
_STRAIGHT = 0.95  # end-to-end distance over the length of what is "close to being straight"


def figure(data: xr.Dataset) -> Figure:
    """Draw all filaments in their cell at t = 38.4 and t = 49.024."""
    return oscillating.configurations(data, oscillating.TIMES[2:])


def check(data: xr.Dataset) -> Sequence[Row]:
    """Check that most filaments are straight at t = 38.4 and many are bent at t = 49.024."""
    calm, bent = (oscillating.ends(data, t) for t in oscillating.TIMES[2:])
    return [
        Row(
            "share of filaments close to straight, t = 38.4",
            float(np.mean(calm > _STRAIGHT)),
            "many",
            low=0.5,
            note="End-to-end distance above 0.95 L.",
        ),
        Row(
            "share of filaments close to straight, t = 49.024",
            float(np.mean(bent > _STRAIGHT)),
            "many are buckled strongly",
            high=float(np.mean(calm > _STRAIGHT)),
        ),
        Row("smallest end-to-end distance over the length, t = 38.4", float(calm.min())),
        Row("smallest end-to-end distance over the length, t = 49.024", float(bent.min())),
        Row(
            "elastic energy at t = 38.4 over that at t = 49.024",
            oscillating.at(data, oscillating.TIMES[2]) / oscillating.at(data, oscillating.TIMES[3]),
            "little elastic energy",
            high=0.2,
        ),
    ]
