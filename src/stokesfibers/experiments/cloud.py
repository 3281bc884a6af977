"""A ball of filaments falls in free space: its velocity against theory, then its evolution.

Length and rigidity are 1 and 8 pi mu = 1; each filament weighs `WEIGHT`. Lengths of the figure are
filaments', times are those in which the cloud falls its own radius at first. As a cloud of points
it stays a blob and loses a few filaments to a tail behind it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import StokesFibersError
from stokesfibers.experiments import runs
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.cloud_start import Ball, swarm_velocity
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.load import Gravity
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import Schedule, every
from stokesfibers.run.simulate import simulate
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import SpheroidalRegularization
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.summation import FastImages

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EPS = 1e-2
WEIGHT = 100.0
"""Of one filament, times L^2 / E: the elasto-gravitational number."""
DENSITY = 200.0 / 5.0**3
"""Filaments over R^3, R the radius of the ball."""
RTOL = 1e-3
_FIRST = 1e-3  # of the time to fall R: over it the first velocity is taken
_FRAMES = 2
_OUTSIDE = 2.0  # in R from the median: filaments farther away are left behind
_INNER = 0.9  # share of the filaments that the size is told from
_BELOW = 0.5  # of the velocity of the start


@dataclass(frozen=True)
class CloudRun:
    """The run of one ball of filaments, as `runs` keeps it.

    Attributes
    ----------
    count
        Filaments.
    seed
        Of the places.
    falls
        How long, in times to fall R.
    """

    count: int
    seed: int = 1
    falls: float = 4.0

    @property
    def name(self) -> str:
        """Name of the run's store, without its suffix."""
        return f"cloud-{self.count}-seed{self.seed}-{self.falls:g}"

    @property
    def radius(self) -> float:
        """R."""
        return float((self.count / DENSITY) ** (1.0 / 3.0))

    @property
    def problem(self) -> Problem:
        """The problem to solve; the filaments fall towards negative y."""
        return Problem(
            Fiber(slenderness=EPS, count=self.count),
            mu_bar=1.0,
            load=Gravity((0.0, -WEIGHT, 0.0)),
            mobility=NonLocal(SpheroidalRegularization()),
            image_sum=FastImages(),
            engine=SpectralEngine(rtol=RTOL),
        )

    @property
    def initial(self) -> Ball:
        """Where the filaments start."""
        return Ball(self.radius, self.seed)

    @property
    def unit(self) -> float:
        """The time in which the swarm falls R by theory."""
        return self.radius / self.swarm

    @property
    def swarm(self) -> float:
        """What the others add to a filament's velocity by theory."""
        return swarm_velocity(self.count, WEIGHT, radius=self.radius, length=1.0)

    @property
    def until(self) -> float:
        """Time to stop."""
        return self.falls * self.unit

    @property
    def schedule(self) -> Schedule:
        """What is recorded when."""
        return every(self.until / 24.0, observables=self.until / 96.0, points=21)


def run(settings: Settings) -> xr.Dataset:
    """Return first velocities of several clouds, and one cloud's evolution."""
    count, seeds = (20, range(1, 4)) if settings.quick else (200, range(1, 13))
    first = np.array([_first_velocity(CloudRun(count, seed)) for seed in seeds])
    chosen = CloudRun(count, falls=2.0 if settings.quick else 4.0)
    tree = runs.finished([chosen], settings)[0]
    observed = tree["observables"].to_dataset()
    centres = observed["centre"].to_numpy()
    time = observed["time"].to_numpy() / chosen.unit
    trajectory = tree["trajectory"].to_dataset()
    frames = np.linspace(0, trajectory.sizes["time"] - 1, _FRAMES).astype(int)
    shown = trajectory.isel(time=frames)
    return xr.Dataset(
        {
            "others": (("seed",), first[:, 0]),
            "own": (("seed",), first[:, 1]),
            "time": (("step",), time),
            "fallen": (("step",), -centres.mean(axis=1)[:, 1] / chosen.radius),
            "wide": (("step",), _spread(centres, (0, 2)) / chosen.radius),
            "high": (("step",), _spread(centres, (1,)) / chosen.radius),
            "left": (("step",), _left_behind(centres, chosen.radius)),
            "curvature": (("step",), observed["largest_curvature"].max("fiber").to_numpy()),
            "position": (("frame", "fiber", "node", "space"), shown["position"].to_numpy()),
            "frame_time": (("frame",), shown["time"].to_numpy() / chosen.unit),
        },
        coords={"seed": list(seeds)},
        attrs={
            "count": count,
            "radius": chosen.radius,
            "swarm": chosen.swarm,
            "points": 8.0 * (count - 1) * WEIGHT / (5.0 * chosen.radius),
            "status": str(runs.status(tree).get("explanation", "")),
            "steps": tree["numerics"].sizes["step"],
            "crossings": len(json.loads(tree.attrs.get("crossings", "[]"))),
            "quick": int(settings.quick),
        },
    )


def _first_velocity(cloud: CloudRun) -> tuple[float, float]:
    """Return the mean velocity down, less the filaments' own, and that: times 8 pi mu."""
    problem = cloud.problem
    units = cloud.initial.placed(problem.fibers)[1]
    until = _FIRST * cloud.unit
    result = simulate(
        problem, cloud.initial.curves(problem.fibers, np.zeros(3)), until=until,
        record=every(until), threads=1,
    )  # fmt: skip
    if result.status.code == "interrupted":
        raise KeyboardInterrupt
    if not result.status.ok:
        raise StokesFibersError(f"{cloud.name} failed: {result.status.explanation}")
    centres = result.data["observables"]["centre"].to_numpy()
    total = -(centres[-1] - centres[0]).mean(axis=0)[1] / until
    kind = problem.kinds[0]
    local = SpectralFiber.build(
        kind.length, kind.eps, rigidity=kind.rigidity, nodes=8, mobility=problem.mobility
    ).local
    own = WEIGHT * float(np.mean(local.a + local.b * units[:, 1] ** 2))
    return total - own, own


def _spread(centres: Array, axes: tuple[int, ...]) -> Array:
    """Return sqrt(5) times the rms distance from the median along `axes`: R for a ball.

    Of the inner nine tenths, which are those within 0.9^(1/3) R in a ball: the tail is counted by
    itself.
    """
    off = centres - np.median(centres, axis=1, keepdims=True)
    inner = np.argsort(np.linalg.norm(off, axis=2), axis=1)[:, : int(_INNER * off.shape[1])]
    kept = np.take_along_axis(off, inner[..., None], axis=1)[..., axes]
    return np.sqrt(5.0 * np.square(kept).mean(axis=(1, 2))) / _INNER ** (1.0 / 3.0)


def _left_behind(centres: Array, radius: float) -> Array:
    off = centres - np.median(centres, axis=1, keepdims=True)
    return np.mean(np.linalg.norm(off, axis=2) > _OUTSIDE * radius, axis=1)


def figure(data: xr.Dataset) -> Figure:
    """Draw the cloud at first and last, in perspective, and its velocity, shape and losses."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from stokesfibers.plot import perspective
    from stokesfibers.plot.solid import look
    from stokesfibers.plot.style import PAGE, style

    tree = _as_run(data)
    with style():
        drawn = Figure(figsize=(PAGE, 5.2), layout="constrained")
        FigureCanvasAgg(drawn)
        grid = drawn.add_gridspec(2, 6, height_ratios=[1.6, 1.0])
        _draw_series([drawn.add_subplot(grid[1, 2 * k : 2 * k + 2]) for k in range(3)], data)
        for k, at in enumerate(tree["trajectory"]["time"].to_numpy()):
            solid: Any = drawn.add_subplot(grid[0, 3 * k : 3 * k + 3], projection="3d")
            look(solid)
            perspective(tree, time=float(at), colour=None, ax=solid)
    return drawn


def _as_run(data: xr.Dataset) -> xr.DataTree:
    """Return what `plot` reads of a run; times in units of the fall."""
    axes = ("time", "fiber", "node", "space")
    position = (axes, data["position"].to_numpy())
    held = xr.Dataset({"position": position}, coords={"time": data["frame_time"].to_numpy()})
    return xr.DataTree.from_dict({"/": xr.Dataset(), "/trajectory": held})


def _draw_series(axes: Sequence[Axes], data: xr.Dataset) -> None:
    from stokesfibers.plot.style import FAINT, PALETTE

    time = data["time"].to_numpy()
    axes[0].plot(time, _velocity(data), color=PALETTE[0])
    axes[0].axhline(1.0, color=FAINT, linewidth=0.6, linestyle="--")
    axes[0].set(ylabel="velocity / theory at first", ylim=(0.0, 1.3))
    for name, colour in (("wide", PALETTE[0]), ("high", PALETTE[1])):
        axes[1].plot(time, data[name], color=colour, label=name)
    axes[1].set(ylabel="half axes / $R$")
    axes[1].set_ylim(bottom=0.0)
    axes[1].legend()
    axes[2].plot(time, 100.0 * data["left"], color=PALETTE[0], label="left behind, %")
    axes[2].plot(time, data["curvature"], color=PALETTE[1], label="largest curvature $L$")
    axes[2].set_ylim(bottom=0.0)
    axes[2].legend()
    for ax in axes:
        ax.set(xlabel="time / time to fall $R$")


def _velocity(data: xr.Dataset) -> Array:
    """Return the velocity of the mean over that of theory, swarm and own."""
    whole = 1.0 + float(data["own"].mean()) / data.attrs["swarm"]
    return np.gradient(data["fallen"].to_numpy(), data["time"].to_numpy()) / whole


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare first velocities with theory; state the evolution."""
    ratio = data["others"].to_numpy() / data.attrs["swarm"]
    error = float(ratio.std(ddof=1) / np.sqrt(ratio.size))
    width = 0.15 if data.attrs["quick"] else 0.03
    where = f"{data.attrs['count']} filaments, R = {data.attrs['radius']:.3g} L"
    velocity = _velocity(data)
    last = data.isel(step=-1)
    note = f"Mean of {ratio.size} clouds, +- {error:.1%}."
    return [
        Row(
            f"velocity by the others / theory, {where}",
            float(ratio.mean()),
            1.0,
            1.0 - width,
            1.0 + width,
            note,
        ),
        Row(
            "theory for filaments / N - 1 point forces, F (N - 1) / (5 pi mu R)",
            data.attrs["swarm"] / data.attrs["points"],
            None,
            0.9,
            1.0,
            "Filaments reach out of the ball.",
        ),
        Row(
            "filament's own velocity / that by the others",
            float(data["own"].mean()) / data.attrs["swarm"],
        ),
        Row(
            "least velocity on the way / theory for the start",
            float(velocity.min()),
            low=_BELOW,
            note="It falls as a blob all the way.",
        ),
        Row(f"distance fallen / R at t = {float(last['time']):.3g}", float(last["fallen"])),
        Row("half width / half height in the end", float(last["wide"] / last["high"])),
        Row("left behind in the end, %", 100.0 * float(last["left"]), high=35.0),
        Row("pairs that passed through each other", float(data.attrs["crossings"]), high=0.0),
        Row("largest curvature times L", float(data["curvature"].max()), note=data.attrs["status"]),
    ]
