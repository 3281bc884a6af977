"""Fig. 10: the suspension at the start and after one period, when the fluid is at rest."""

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


def figure(data: xr.Dataset) -> Figure:
    """Draw all filaments in their cell at t = 0 and t = 25.6."""
    return oscillating.configurations(data, oscillating.TIMES[:2])


def check(data: xr.Dataset) -> Sequence[Row]:
    """Check that the filaments are straight at first and bent after one period."""
    first, after = (oscillating.ends(data, t) for t in oscillating.TIMES[:2])
    rows = [
        Row(
            "smallest end-to-end distance over the length, t = 0",
            float(first.min()),
            "initially straight",
            low=1.0 - 1e-9,
            high=1.0 + 1e-9,
        ),
        Row(
            "smallest end-to-end distance over the length, t = 25.6",
            float(after.min()),
            "bent",
            high=0.9999 if data.attrs["quick"] else 0.99,
            note="The flow is at rest here; filaments have relaxed since the peak of the energy.",
        ),
        Row("elastic energy, t = 25.6", oscillating.at(data, oscillating.TIMES[1])),
    ]
    return [*rows, *_health(data)]


def _health(data: xr.Dataset) -> list[Row]:
    return [
        Row("seed of the initial positions", float(data.attrs["seed"])),
        Row(
            "largest relative length error",
            float(data["length_error"].max()),
            high=0.05 if data.attrs["quick"] else 0.01,
        ),
        Row("smallest gap between surfaces", float(np.min(data["smallest_gap"]))),
        Row(
            "pairs of filaments that passed through each other",
            float(data.attrs["crossings"]),
            note="Slender body theory does not forbid it; the paper does not say.",
        ),
    ]
