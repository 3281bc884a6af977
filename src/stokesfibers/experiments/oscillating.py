"""The suspension of Section 4.2: 25 straight filaments in an oscillating shear, periodic in x.

The paper's initial positions are not published. Ours are drawn at random from a seed, so only what
the paper says in words can be compared.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.domain import Periodic
from stokesfibers.experiments import runs
from stokesfibers.experiments.base import Settings
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.fiber.suspension import Suspension
from stokesfibers.flow import OscillatoryShear
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stokesfibers.fiber.initial import AbstractInitial

SEED = 1
MU_BAR = 1.5e5
EPS = 1e-2
TIMES = (0.0, 25.6, 38.4, 49.024)
"""Configurations drawn in Figs. 10 and 11."""


@dataclass(frozen=True)
class SuspensionTier:
    """A size of the suspension.

    Attributes
    ----------
    name
        ``"full"`` or ``"quick"``.
    count
        Filaments.
    intervals
        N.
    dt
        Time step.
    period
        Of the flow.
    periods
        How many of them.
    box
        Where mid-points are.
    mu_bar
        Effective viscosity (10).
    beta
        Penalisation of (14).
    """

    name: str
    count: int
    intervals: int
    dt: float
    period: float
    periods: int
    box: tuple[float, float, float]
    mu_bar: float
    beta: float


FULL = SuspensionTier("full", 25, 100, 0.0128, 25.6, 5, (2.0, 2.5, 2.5), MU_BAR, 20.0)
"""The paper's: 10,000 steps."""
QUICK = SuspensionTier("quick", 4, 32, 0.0256, 25.6, 2, (2.0, 0.9, 0.9), 5e4, 10.0)
"""Fewer and stiffer filaments, on a coarse grid, two periods."""


@dataclass(frozen=True)
class SuspensionRun:
    """The suspension from one seed.

    Attributes
    ----------
    tier
        How large.
    seed
        Of the initial positions.
    """

    tier: SuspensionTier
    seed: int

    @property
    def name(self) -> str:
        """Name of the run's store, without its suffix."""
        return f"{self.tier.name}-suspension-seed{self.seed}"

    @property
    def problem(self) -> Problem:
        """The problem to solve."""
        tier = self.tier
        return Problem(
            Fiber(length=1.0, slenderness=EPS, rigidity=1.0, count=tier.count),
            mu_bar=tier.mu_bar,
            flow=OscillatoryShear(amplitude=1.0, frequency=1.0 / tier.period),
            domain=Periodic((2.0, 0.0, 0.0)),
            engine=PaperEngine(tier.intervals, dt=tier.dt, beta=tier.beta),
        )

    @property
    def initial(self) -> AbstractInitial:
        """Straight filaments, isotropic, a least gap apart."""
        return Suspension(seed=self.seed, box=self.tier.box, least_gap=0.03)

    @property
    def until(self) -> float:
        """Time to stop."""
        return self.tier.period * self.tier.periods

    @property
    def schedule(self) -> Schedule:
        """What is recorded when."""
        return Schedule(0.128, 0.128, checkpoint_every=1.28)


def computed(settings: Settings) -> tuple[SuspensionRun, xr.DataTree]:
    """Return the run of the settings' seed, computed or taken from where it is kept."""
    run = SuspensionRun(
        QUICK if settings.quick else FULL, SEED if settings.seed is None else settings.seed
    )
    return run, runs.finished([run], settings)[0]


def run(settings: Settings) -> xr.Dataset:
    """Return shapes at the paper's times, and energies and health against time."""
    case, tree = computed(settings)
    frames = runs.frames(tree, np.array(TIMES))
    observables = tree["observables"].to_dataset().load()
    return xr.Dataset(
        {
            "position": frames["position"],
            "tension": frames["tension"],
            "elastic_energy": (
                ("observed", "fiber"),
                observables["elastic_energy"].to_numpy(),
                {"units": "force length"},
            ),
            "length_error": (("observed",), observables["length_error"].max("fiber").to_numpy()),
            "smallest_gap": (("observed",), observables["smallest_gap"].to_numpy()),
        },
        coords={
            "time": frames["time"],
            "observed": (("observed",), observables["time"].to_numpy(), {"units": "time"}),
        },
        attrs={
            "case": tree.attrs["case"],
            "crossings": len(json.loads(tree.attrs.get("crossings", "[]"))),
            "period": case.tier.period,
            "seed": case.seed,
            "quick": int(settings.quick),
        },
    )


def totals(data: xr.Dataset) -> tuple[Array, Array]:
    """Return times and the elastic energy of all filaments together."""
    return data["observed"].to_numpy(), data["elastic_energy"].sum("fiber").to_numpy()


def at(data: xr.Dataset, time: float) -> float:
    """Return the total elastic energy at `time`."""
    observed, energy = totals(data)
    return float(np.interp(time, observed, energy))


def peaks(data: xr.Dataset, energy: Array) -> Array:
    """Return the time of the largest `energy` (observed, ...) within each period, in periods."""
    observed, period = data["observed"].to_numpy(), data.attrs["period"]
    count = round(observed[-1] / period)
    found = []
    for n in range(count):
        inside = np.flatnonzero((observed >= n * period) & (observed <= (n + 1) * period))
        found.append(observed[inside[np.argmax(energy[inside], axis=0)]] / period - n)
    return np.array(found)


def ends(data: xr.Dataset, time: float) -> Array:
    """Return the end-to-end distances at one of the `TIMES`, over the length."""
    x = data["position"].sel(time=time, method="nearest")
    return np.linalg.norm((x.isel(node=-1) - x.isel(node=0)).to_numpy(), axis=-1)


def configurations(data: xr.Dataset, times: tuple[float, float]) -> Figure:
    """Draw all filaments in their cell at two times, side by side (Figs. 10, 11)."""
    from stokesfibers.plot.perspective import perspective, solid_panels
    from stokesfibers.plot.style import PAGE

    tree = xr.DataTree.from_dict({"trajectory": data[["position", "tension"]]})
    tree.attrs["case"] = data.attrs["case"]
    axes = solid_panels(len(times), width=PAGE, height=2.8)
    for ax, time in zip(axes, times, strict=True):
        perspective(tree, time=time, colour=None, ax=ax)
    return axes[0].figure


def mark_half_periods(ax: Axes, data: xr.Dataset) -> None:
    """Draw a dashed line wherever the flow turns round, as the paper does."""
    from stokesfibers.plot.style import FAINT

    half = 0.5 * data.attrs["period"]
    last = float(data["observed"][-1])
    for turn in np.arange(1, round(last / half)) * half:
        ax.axvline(turn, color=FAINT, linewidth=0.5, linestyle=(0, (4, 2)), zorder=0)
    ax.set_xlim(0.0, last)
    if ax.get_yscale() == "linear":
        ax.set_ylim(bottom=0.0)
