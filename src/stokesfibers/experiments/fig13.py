"""Fig. 13: elastic energy of four filaments of the suspension."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import oscillating
from stokesfibers.experiments.base import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

run = oscillating.run
_DRAWN = 4
_BENT = 0.1  # of the largest energy of any filament: below it, no filament counts as buckled
_START = (
    "The paper's initial configuration is not published. Filaments that start straight in all "
    "directions at once are bent by the second half of each period; a filament needs a bent start "
    "to peak in the first."
)


def figure(data: xr.Dataset) -> Figure:
    """Draw the four filaments of the largest energies, dashed lines where the flow turns round."""
    from stokesfibers.plot.style import PAGE, PALETTE, new_panels, style

    axes = new_panels(2, 2, width=PAGE, height=3.4)
    energy = data["elastic_energy"].to_numpy()
    picked = np.sort(np.argsort(energy.max(axis=0))[-_DRAWN:])
    with style():
        for ax, k in zip(axes.flat, picked, strict=True):
            ax.plot(data["observed"], energy[:, k], color=PALETTE[0])
            oscillating.mark_half_periods(ax, data)
            ax.set_title(f"filament {k}")
        for ax in axes[-1]:
            ax.set_xlabel("$t$")
        for ax in axes[:, 0]:
            ax.set_ylabel(r"$E_\mathrm{elas}$")
        axes[0, 0].figure.align_ylabels(list(axes[:, 0]))
    return axes[0, 0].figure


def check(data: xr.Dataset) -> Sequence[Row]:
    """Count the evolutions that the paper describes."""
    first, second = _halves(data)
    largest = np.maximum(first, second)
    bent = largest > _BENT * largest.max()
    change = np.diff(largest, axis=0)
    known = bent[1:] | bent[:-1]
    some = None if data.attrs["quick"] else 1.0  # too few filaments for a variety
    return [
        Row("filaments that buckle", float(bent.any(axis=0).sum()), low=1.0),
        Row(
            "largest energies within a second half period",
            float((second > first)[bent].sum()),
            "some",
            low=1.0,
        ),
        Row(
            "largest energies within a first half period",
            float((first > second)[bent].sum()),
            "some",
            low=some,
            known=_START,
            known_low=0.0,
        ),
        Row(
            "times that a filament's largest energy falls from one period to the next",
            float(((change < 0.0) & known).sum()),
            "some",
            low=some,
        ),
        Row(
            "times that it rises",
            float(((change > 0.0) & known).sum()),
            "some",
            low=some,
        ),
    ]


def _halves(data: xr.Dataset) -> tuple[Array, Array]:
    """Return each filament's largest energy in first and second half periods, (period, fiber)."""
    observed, energy = data["observed"].to_numpy(), data["elastic_energy"].to_numpy()
    half = 0.5 * data.attrs["period"]
    number = np.minimum(observed // half, round(observed[-1] / half) - 1).astype(int)
    largest = np.array([energy[number == n].max(axis=0) for n in range(number[-1] + 1)])
    return largest[0::2], largest[1::2]
