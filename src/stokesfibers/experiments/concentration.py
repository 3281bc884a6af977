"""N_1 and extra viscosity against concentration, for stiff fibers and for ones that buckle.

The paper's last section names the question. Its oscillating shear answers it best: a straight fiber
turns there and back, and its N_1 over a period is zero; what is left over is due to buckling, and
the fibers do not end up along the flow, where a steady shear has little to tell. Nearly straight
isotropic fibers fill a periodic cell; with omega the angular frequency, over each period T

    N_1 = 1/T int N_1(t) dt,   viscosity = 2/T int sigma_12(t) sin(omega t) dt,

per volume and over mu times the largest rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import runs
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.cell_periods import PERIOD, Periods
from stokesfibers.experiments.sheared_cells import CellRun, uniform
from stokesfibers.flow import OscillatoryShear

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MU_BARS = {"stiff": 1e3, "flexible": 1.5e5}
"""The flexible ones are those of the paper's Fig. 12; the stiff ones cannot buckle."""
SHOWN = {"viscosity": r"$\eta_{\mathrm{sp}}$", "n1": r"$N_1/\mu\dot\gamma_0$"}
_AMPLITUDE = 1.0  # d_y: bent by 1/256 of the length at the start
_FULL = (0.05, 0.25, 0.5, 1.0, 2.0)
_QUICK = (0.05, 1.0)
_EVERY = 0.1
_LARGEST_SHARE = {False: 0.05, True: 0.2}  # N_1 of stiff over flexible fibers, in full and quickly
_LEAST_ERRORS = {False: 3.0, True: 0.0}  # N_1 of flexible fibers over its error
_DRAWN = 1.0  # concentration whose series are drawn


def planned(kind: str, concentration: float, *, quick: bool) -> list[CellRun]:
    """Return the runs of one point of the curves."""
    count, seeds, periods = (4, 1, 1) if quick else (60, 2, 2)
    flow = OscillatoryShear(amplitude=1.0, frequency=1.0 / PERIOD)
    return [
        CellRun(
            kind,
            uniform(count),
            MU_BARS[kind],
            concentration,
            seed,
            until=periods * PERIOD,
            flow=flow,
            amplitude=_AMPLITUDE,
            every=_EVERY,
        )
        for seed in range(1, seeds + 1)
    ]


def run(settings: Settings) -> xr.Dataset:
    """Return averages over periods by stiffness and concentration, and series of one of them."""
    concentrations = _QUICK if settings.quick else _FULL
    plans = {
        (kind, c): planned(kind, c, quick=settings.quick)
        for kind in MU_BARS
        for c in concentrations
    }
    every = [one for plan in plans.values() for one in plan]
    trees = dict(zip([one.name for one in every], runs.finished(every, settings), strict=True))
    found = {
        point: Periods.of([trees[one.name] for one in plan], plan) for point, plan in plans.items()
    }
    shape = len(MU_BARS), len(concentrations)
    axes = ("kind", "concentration")

    def gathered(name: str) -> Array:
        values = np.stack([getattr(one, name) for one in found.values()])
        return values.reshape(*shape, *values.shape[1:])

    return xr.Dataset(
        {
            "mean": ((*axes, "quantity", "period"), gathered("mean")),
            "error": ((*axes, "quantity", "period"), gathered("error")),
            "alone": ((*axes, "quantity"), gathered("alone")),
            "bent": (axes, gathered("bent")),
            "n1": (("kind", "time"), [found[kind, _DRAWN].n1 for kind in MU_BARS]),
        },
        coords={
            "kind": list(MU_BARS),
            "concentration": list(concentrations),
            "quantity": list(SHOWN),
            "time": found[next(iter(MU_BARS)), _DRAWN].time,
        },
        attrs={
            "quick": int(settings.quick),
            "count": every[0].count,
            "seeds": len(plans[next(iter(plans))]),
        },
    )


def figure(data: xr.Dataset) -> Figure:
    """Draw both stresses over n L^3 against n L^3, and N_1 against time at one concentration."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(1, 3, width=PAGE, height=2.4)[0]
    with style():
        for ax, quantity in zip(axes, SHOWN, strict=False):
            _draw_averages(ax, data, quantity)
        axes[1].legend(fontsize=6.5)
        _draw_series(axes[2], data)
    return axes[0].figure


def _draw_averages(ax: Axes, data: xr.Dataset, quantity: str) -> None:
    from stokesfibers.plot.style import PALETTE

    c = data["concentration"].to_numpy()
    for number, kind in enumerate(data["kind"].to_numpy()):
        one = data.sel(kind=kind, quantity=quantity).isel(period=-1)
        ax.errorbar(
            c * (1.0 + 0.03 * number),
            one["mean"] / c,
            one["error"] / c,
            fmt="o-",
            markersize=3.5,
            capsize=2.0,
            linewidth=0.8,
            color=PALETTE[number],
            label=rf"{kind}, $\bar\mu={_powers(MU_BARS[str(kind)])}$",
        )
    ax.axhline(0.0, color="0.7", linewidth=0.5, zorder=0)
    ax.set(xscale="log", xlabel="$nL^3$", ylabel=f"{SHOWN[quantity]} $/\\,nL^3$")
    ax.margins(y=0.15)


def _powers(value: float) -> str:
    """Return a number as its digits times a power of ten, for mathematics."""
    digits, power = f"{value:e}".split("e")
    factor = "" if float(digits) == 1.0 else rf"{float(digits):g}\times"
    return f"{factor}10^{int(power)}"


def _draw_series(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import PALETTE

    time = data["time"] / PERIOD
    for number, kind in enumerate(data["kind"].to_numpy()):
        series = data["n1"].sel(kind=kind)
        ax.plot(time, series, color=PALETTE[number], linewidth=0.8)
    for reversal in np.arange(0.5, float(time[-1]), 0.5):
        ax.axvline(reversal, color="0.8", linewidth=0.5, zorder=0)
    ax.axhline(0.0, color="0.7", linewidth=0.5, zorder=0)
    ax.set(xlabel="time, periods", ylabel=f"{SHOWN['n1']}, $nL^3={_DRAWN:g}$")


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare stiff fibers with what they do alone, N_1 of both kinds, and state the averages."""
    rows = [_alone(data), *_buckling(data)]
    last = data.isel(period=-1)
    of = f"{data.attrs['seeds']} x {data.attrs['count']} fibers"
    for kind in data["kind"].to_numpy():
        for c in data["concentration"].to_numpy():
            one = last.sel(kind=kind, concentration=c)
            for quantity in SHOWN:
                own = one.sel(quantity=quantity)
                bar = f"+- {float(own['error']) / c:.2g}, last period, {of}."
                name = f"{quantity} / (n L^3), {kind}, n L^3 = {c:g}"
                rows.append(Row(name, float(own["mean"]) / c, note=bar))
            told = "Ends once nearer than 0.9 of the length."
            rows.append(Row(f"share that bends, {kind}, {c:g}", float(one["bent"]), note=told))
    return rows


def _alone(data: xr.Dataset) -> Row:
    """Return the row of stiff fibers that hardly feel each other: closed form."""
    one = data.sel(kind="stiff", quantity="viscosity").isel(concentration=0, period=0)
    told = "First period; straight fibers that do not feel each other, in closed form."
    ratio = float(one["mean"] / one["alone"])
    return Row("viscosity over its dilute limit, stiff, least n L^3", ratio, 1.0, 0.97, 1.03, told)


def _buckling(data: xr.Dataset) -> list[Row]:
    """Return the rows of N_1 over a period: zero for stiff fibers, above it for flexible ones."""
    n1 = data.sel(quantity="n1").isel(period=-1)
    stiff, flexible = n1.sel(kind="stiff"), n1.sel(kind="flexible")
    quick = bool(data.attrs["quick"])
    share = float(np.abs(stiff["mean"] / flexible["mean"]).max())
    above = float((flexible["mean"] / flexible["error"]).min())
    return [
        Row(
            "N_1 of stiff over that of flexible fibers, largest size",
            share,
            0.0,
            high=_LARGEST_SHARE[quick],
            note="A fiber that stays straight turns there and back: nothing is left.",
        ),
        Row(
            "N_1 of flexible fibers over its error, least",
            above,
            low=_LEAST_ERRORS[quick],
            note="Buckling leaves a positive N_1 (the paper's conclusion).",
        ),
    ]
