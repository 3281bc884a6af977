"""Fig. 16: the sum over all images of the filament along three lines, over mu_bar."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import xarray as xr

from stokesfibers.experiments import images
from stokesfibers.experiments.base import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

run = images.run


def figure(data: xr.Dataset) -> Figure:
    """Draw the size of the reference against y, one panel per line of test points."""
    from stokesfibers.plot.style import PAGE, PALETTE, new_panels, style

    axes = new_panels(1, len(images.LINES), width=PAGE, height=2.1)[0]
    bent = data.sel(filament="bent", period=images.PERIODS[0])
    with style():
        for ax, line in zip(axes, images.LINES, strict=True):
            ax.plot(data["y"], bent["magnitude"].sel(x=line) / images.MU_BAR, color=PALETTE[0])
            images.finish_panel(ax, line)
        axes[0].set_ylabel(r"$|\Sigma_{\mathrm{ref}}| / \bar\mu$")
    return axes[0].figure


def check(data: xr.Dataset) -> Sequence[Row]:
    """Check that the sum falls away from the filament, and how exact the reference is."""
    bent = data.sel(filament="bent", period=images.PERIODS[0])
    largest = bent["magnitude"].max("y").to_numpy() / images.MU_BAR
    rows = [
        Row(f"largest |Sigma_ref| / mu_bar, x = {line}", value)
        for line, value in zip(images.LINES, largest, strict=True)
    ]
    for (near, far), ratio in zip(
        zip(images.LINES, images.LINES[1:], strict=False), largest[1:] / largest[:-1], strict=True
    ):
        rows.append(
            Row(
                f"largest |Sigma_ref|, x = {far} over x = {near}",
                ratio,
                "decreases away from the filament",
                high=1.0,
            )
        )
    rows.append(
        Row(
            "relative error of the reference, largest of all",
            float(data["reference_error"].max()),
            high=1e-6,
            note="Change from P = 20, 40 to P = 40, 80, extrapolated in (P + 1/2)^-2.",
        )
    )
    return rows
