"""Fig. 7: shear stress Sigma_12 at mu_bar = 4e5; the buckling reduces it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import xarray as xr
from scipy.integrate import trapezoid

from stokesfibers.experiments import stress
from stokesfibers.experiments.base import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

run = stress.series


def figure(data: xr.Dataset) -> Figure:
    """Draw Sigma_12 of the finest run, the straight filament dashed."""
    return stress.draw(data, "shear_stress", r"$\Sigma_{12} = \Sigma_{21}$")


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare integrals and peaks of Sigma_12 with the straight filament's."""
    time = data["time"].to_numpy()
    ours, rod = data["shear_stress"].to_numpy(), data["straight_shear_stress"].to_numpy()
    total = trapezoid(ours, time, axis=1)
    before = time < data.attrs["vertical"]
    statement = "buckling reduces the added shear stress"
    return [
        *(
            Row(f"integral of Sigma_12, N = {n}", value)
            for n, value in zip(data["intervals"].to_numpy(), total, strict=True)
        ),
        Row("integral of Sigma_12, straight filament", float(trapezoid(rod, time))),
        Row(
            "integral of Sigma_12 over that of the straight filament",
            float(total[-1] / trapezoid(rod, time)),
            statement,
            0.0,
            0.95,
        ),
        Row(
            "peak of Sigma_12 before the vertical over that of the straight filament",
            float(ours[-1][before].max() / rod[before].max()),
            statement,
            0.0,
            0.999,
        ),
    ]
