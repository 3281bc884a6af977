"""N_1 and extra viscosity against concentration, for stiff fibers and for ones that buckle.

The paper's last section names the question. Straight isotropic fibers are sheared in a periodic
cell; stresses are averaged over the second half of the run and over seeds. The stiff ones lie below
the threshold of buckling in shear, the flexible ones 20 times above it.
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
from stokesfibers.experiments.sheared_cells import NAMES, CellRun, stresses, uniform

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MU_BARS = {"stiff": 1e3, "flexible": 5e4}
_FULL = (0.05, 0.25, 0.5, 1.0, 2.0)
_QUICK = (0.05, 1.0)
_DRAWN = 1.0  # concentration whose series are drawn


def planned(kind: str, concentration: float, *, quick: bool) -> list[CellRun]:
    """Return the runs of one point of the curves."""
    count, seeds, until = (8, 1, 1.0) if quick else (60, 2, 10.0)
    return [
        CellRun(kind, uniform(count), MU_BARS[kind], concentration, seed, until)
        for seed in range(1, seeds + 1)
    ]


def run(settings: Settings) -> xr.Dataset:
    """Return averages with errors by stiffness and concentration, and series of one of them."""
    concentrations = _QUICK if settings.quick else _FULL
    plans = {
        (kind, c): planned(kind, c, quick=settings.quick)
        for kind in MU_BARS
        for c in concentrations
    }
    every = [one for plan in plans.values() for one in plan]
    trees = dict(zip([one.name for one in every], runs.finished(every, settings), strict=True))
    found, drawn, time = [], [], np.empty(0)
    for (_, c), plan in plans.items():
        own = [trees[one.name] for one in plan]
        found.append(Averages.of(own, plan))
        if c == _DRAWN:
            series = [stresses(tree, one) for tree, one in zip(own, plan, strict=True)]
            drawn.append(np.mean([values for _, values in series], axis=0))
            time = series[0][0]
    axes = {"kind": len(MU_BARS), "concentration": len(concentrations)}
    return xr.Dataset(
        {
            **variables(found, axes),
            "series": (("kind", "quantity", "time"), drawn),
        },
        coords={
            "kind": list(MU_BARS),
            "concentration": list(concentrations),
            "quantity": list(NAMES),
            "time": time,
        },
        attrs={
            "quick": int(settings.quick),
            "count": every[0].count,
            "seeds": len(plans[next(iter(plans))]),
            "until": every[0].until,
        },
    )


def figure(data: xr.Dataset) -> Figure:
    """Draw both stresses over n L^3 against n L^3, and the series at one concentration."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(1, 3, width=PAGE, height=2.4)[0]
    with style():
        for ax, quantity in zip(axes, SHOWN, strict=False):
            _draw_averages(ax, data, quantity)
        _draw_series(axes[2], data)
    return axes[0].figure


def _draw_averages(ax: Axes, data: xr.Dataset, quantity: str) -> None:
    from stokesfibers.plot.style import PALETTE

    c = data["concentration"].to_numpy()
    for number, kind in enumerate(data["kind"].to_numpy()):
        one = data.sel(kind=kind, quantity=quantity)
        over = one.assign(mean=one["mean"] / c, error=one["error"] / c)
        label = rf"{kind}, $\bar\mu={MU_BARS[str(kind)]:g}$"
        draw(ax, c, over, fmt="o-", color=PALETTE[number], label=label)
    ax.axhline(0.0, color="0.7", linewidth=0.5, zorder=0)
    ax.set(xscale="log", xlabel="$nL^3$", ylabel=f"{SHOWN[quantity]} $/\\,nL^3$")
    legend(ax, data)


def _draw_series(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import PALETTE

    for number, kind in enumerate(data["kind"].to_numpy()):
        for quantity, dash in zip(SHOWN, ("-", (0, (3, 1.5))), strict=True):
            one = data["series"].sel(kind=kind, quantity=quantity)
            ax.plot(data["time"], one, color=PALETTE[number], linestyle=dash, linewidth=0.8)
    for quantity, dash in zip(SHOWN, ("-", (0, (3, 1.5))), strict=True):
        ax.plot([], [], color="0.4", linestyle=dash, label=SHOWN[quantity])
    ax.axhline(0.0, color="0.7", linewidth=0.5, zorder=0)
    ax.set(xlabel="strain", ylabel=f"stress, $nL^3={_DRAWN:g}$")
    ax.legend(fontsize=6.5)


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare the dilute start with its exact answer; state the averages and if they settled."""
    rows = []
    for kind in data["kind"].to_numpy():
        for c in data["concentration"].to_numpy():
            one = data.sel(kind=kind, concentration=c)
            where = f"{kind}, n L^3 = {c:g}"
            for quantity in SHOWN:
                mean = one.sel(quantity=quantity)
                name = f"{quantity} / (n L^3), {where}"
                rows.append(Row(name, float(mean["mean"]) / c, note=note(data, mean, c)))
        first = data.sel(kind=kind).isel(concentration=0).sel(quantity="viscosity")
        ratio = float(first["start"] / first["alone"])
        told = "Straight fibers that do not feel each other, in closed form."
        name = f"viscosity at the start over its dilute limit, {kind}, least n L^3"
        rows.append(Row(name, ratio, 1.0, 0.97, 1.03, told))
    return [*rows, unsettled(data)]
