"""Fig. 12: elastic energy of the suspension over five periods of the oscillating shear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.domain import Free
from stokesfibers.experiments import oscillating
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.run.schedule import every
from stokesfibers.run.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PAPER_PEAKS = {1: 23.3 / 25.6, 2: 49.024 / 25.6 - 1.0}


def run(settings: Settings) -> xr.Dataset:
    """Return the suspension's energy, and that of some of its filaments each on its own."""
    data = oscillating.run(settings)
    case, _ = oscillating.computed(settings)
    picked = np.sort(np.argsort(data["elastic_energy"].max("observed").to_numpy())[-2:])
    curves = case.initial.curves(case.problem.fibers, case.problem.domain.lengths)
    fiber = replace(case.problem.kinds[0], count=1)
    # In free space: the images of a filament would bend it too.
    lone = replace(case.problem, fiber=fiber, domain=Free())
    largest = []
    for k in picked:
        alone = simulate(lone, curves[k], until=case.tier.period, record=every(case.tier.period))
        observables = alone.data["observables"].to_dataset()
        largest.append(float(observables["elastic_energy"].max()))
    return data.assign(lone_energy=(("lone",), largest)).assign_coords(lone=("lone", picked))


def figure(data: xr.Dataset) -> Figure:
    """Draw the total elastic energy, dashed lines where the flow turns round."""
    from stokesfibers.plot.style import PAGE, PALETTE, new_panels, style

    ax = new_panels(1, 1, width=0.75 * PAGE, height=2.4)[0, 0]
    with style():
        ax.plot(*oscillating.totals(data), color=PALETTE[0])
        oscillating.mark_half_periods(ax, data)
        ax.set_xlabel("$t$")
        ax.set_ylabel(r"$E_\mathrm{elas}$")
    return ax.figure


def check(data: xr.Dataset) -> Sequence[Row]:
    """Check when the energy is largest and smallest, and that interactions alone cause it."""
    observed, energy = oscillating.totals(data)
    period = data.attrs["period"]
    rows = [
        Row(
            f"largest energy of period {n}, at which part of it",
            float(peak),
            _PAPER_PEAKS.get(n, "shortly before the end"),
            0.8,
            1.0,
        )
        for n, peak in enumerate(oscillating.peaks(data, energy), start=1)
    ]
    second = energy[(observed >= period) & (observed <= 2.0 * period)].max()
    rows += [
        Row(
            "energy at t = 38.4 over the largest of the second period",
            oscillating.at(data, 1.5 * period) / second,
            "little elastic energy",
            high=0.2,
        ),
        Row("energy at the start", float(energy[0]), "initially straight", high=1e-12),
        Row(
            "largest energy of a filament on its own over that of the suspension",
            float(data["lone_energy"].max() / energy.max()),
            "filament interactions alone excite buckling",
            high=1e-6,
            note="The two most bent filaments of the suspension, one period in free space.",
        ),
    ]
    return [*rows, Row("largest energy", float(energy.max()))]
