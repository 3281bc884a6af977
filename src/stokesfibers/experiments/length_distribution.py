"""Fibers of several lengths against fibers of one: stresses at equal number and mean length.

In the dilute limit a fiber's stress grows like L^3 / (c - 2), so that long fibers tell more than
their number. Stresses are given over n <L^3>: what is left of the difference is due to bending,
which goes with L^4, to interaction, and to c.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.experiments import runs
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.cell_averages import (
    SHOWN,
    Averages,
    draw,
    legend,
    note,
    unsettled,
    variables,
)
from stokesfibers.experiments.sheared_cells import EPS, NAMES, CellRun
from stokesfibers.fiber.parameters import Fiber

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LENGTHS: dict[str, tuple[float, ...]] = {
    "one length": (1.0,),
    "0.8 and 1.2": (0.8, 1.2),
    "0.5 and 1.5": (0.5, 1.5),
    "0.4 to 1.6": (0.4, 0.7, 1.0, 1.3, 1.6),
}
_MU_BAR = 2e4
_CONCENTRATION = 0.5


def groups(lengths: Sequence[float], count: int) -> tuple[Fiber, ...]:
    """Return `count` fibers in groups as large as each other, all of one radius and material."""
    own = count // len(lengths)
    return tuple(
        Fiber(length=length, slenderness=EPS / length, rigidity=1.0, count=own)
        for length in lengths
    )


def third_moment(lengths: Sequence[float]) -> float:
    """Return <L^3>."""
    return float(np.mean(np.power(lengths, 3)))


def planned(name: str, *, quick: bool) -> list[CellRun]:
    """Return the runs of one distribution."""
    count, seeds, until = (10, 1, 1.0) if quick else (60, 2, 10.0)
    label = f"lengths-{'-'.join(f'{v:g}' for v in LENGTHS[name])}"
    return [
        CellRun(label, groups(LENGTHS[name], count), _MU_BAR, _CONCENTRATION, seed, until)
        for seed in range(1, seeds + 1)
    ]


def run(settings: Settings) -> xr.Dataset:
    """Return averages with errors by distribution."""
    names = ("one length", "0.5 and 1.5") if settings.quick else tuple(LENGTHS)
    plans = [planned(name, quick=settings.quick) for name in names]
    trees = runs.finished([one for plan in plans for one in plan], settings)
    own = len(plans[0])
    found = [Averages.of(trees[i * own : (i + 1) * own], plan) for i, plan in enumerate(plans)]
    return xr.Dataset(
        {
            **variables(found, {"distribution": len(names)}),
            "moment": (("distribution",), [third_moment(LENGTHS[name]) for name in names]),
        },
        coords={"distribution": list(names), "quantity": list(NAMES)},
        attrs={
            "quick": int(settings.quick),
            "seeds": len(plans[0]),
            "count": plans[0][0].count,
            "concentration": _CONCENTRATION,
        },
    )


def figure(data: xr.Dataset) -> Figure:
    """Draw both stresses over n L^3 and over n <L^3> for each distribution."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(1, 2, width=PAGE, height=2.3)[0]
    with style():
        for ax, (quantity, symbol) in zip(axes, SHOWN.items(), strict=True):
            _draw(ax, data.sel(quantity=quantity), symbol)
        legend(axes[0], data)
    return axes[0].figure


def _draw(ax: Axes, data: xr.Dataset, symbol: str) -> None:
    from stokesfibers.plot.style import PALETTE

    places = np.arange(data.sizes["distribution"])
    n = data.attrs["concentration"]
    per_moment = n * data["moment"].to_numpy()
    for shift, unit, label, colour in (
        (-0.08, np.full(places.size, n), "$n\\langle L\\rangle^3$", PALETTE[0]),
        (0.08, per_moment, "$n\\langle L^3\\rangle$", PALETTE[1]),
    ):
        over = data.assign(mean=data["mean"] / unit, error=data["error"] / unit)
        draw(ax, places + shift, over, color=colour, label=f"over {label}")
    ax.axhline(0.0, color="0.7", linewidth=0.5, zorder=0)
    ax.set_xticks(places, [str(d) for d in data["distribution"].to_numpy()])
    ax.set(xlabel="lengths, equally many", ylabel=symbol)
    ax.margins(x=0.15)


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare the start with that of fibers by themselves; state averages, and if they settled."""
    rows = []
    told = "At the start, over that of straight fibers that do not feel each other: dilute."
    for name in data["distribution"].to_numpy():
        one = data.sel(distribution=name)
        volume = data.attrs["concentration"] * float(one["moment"])
        for quantity in SHOWN:
            mean = one.sel(quantity=quantity)
            what = f"{quantity} / (n <L^3>), {name}"
            rows.append(Row(what, float(mean["mean"]) / volume, note=note(data, mean, volume)))
        first = one.sel(quantity="viscosity")
        ratio = float(first["start"] / first["alone"])
        rows.append(
            Row(f"viscosity at the start over the dilute one, {name}", ratio, 1.0, 0.7, 1.3, told)
        )
    return [*rows, unsettled(data)]
