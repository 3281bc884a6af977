"""Fig. 3: shapes of the filament at mu_bar = 3e5, N = 200, dt = 0.0064."""

from __future__ import annotations

from collections.abc import Sequence

import xarray as xr

from stokesfibers.experiments import shapes
from stokesfibers.experiments.base import Row, Settings

MU_BAR = 3e5
EXPECTED = shapes.Expected("pronounced buckling", energy=39.13, shortest=0.7841)
figure = shapes.figure


def run(settings: Settings) -> xr.Dataset:
    """Return shapes through the buckling."""
    return shapes.run(settings, MU_BAR)


def check(data: xr.Dataset) -> Sequence[Row]:
    """Check how far the filament buckles."""
    return shapes.check(data, EXPECTED)
