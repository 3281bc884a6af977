"""The suspension of Fig. 12 by both engines: energies, cost, and shapes after the last period.

The high-order engine runs at two tolerances, and once more at the smaller one from shapes that are
displaced a little: what becomes of that tells how much the suspension amplifies any error.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import oscillating, runs
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.two_engines_runs import (
    HighOrderRun,
    apart,
    processor_seconds,
    seconds,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RTOLS = (1e-3, 1e-4)
NUDGE = 1e-6
GOAL = 20.0
"""How many times faster the high-order engine at the first tolerance is to be."""
_MOMENTS = 16


def run(settings: Settings) -> xr.Dataset:
    """Return energies of both engines, distances between runs by fiber, and what steps cost."""
    case, paper = oscillating.computed(settings)
    cases = [HighOrderRun(case, rtol) for rtol in RTOLS]
    *trees, nudged = runs.finished([*cases, HighOrderRun(case, RTOLS[1], NUDGE)], settings)
    times, between = apart(*trees)
    _, grown = apart(trees[1], nudged)
    observed, energy = _energy(paper)
    energies = [_energy(tree)[1] for tree in trees]
    numerics = [tree["numerics"].to_dataset().load() for tree in trees]
    again = [processor_seconds(c, tree, _MOMENTS) for c, tree in zip(cases, trees, strict=True)]
    return xr.Dataset(
        {
            "paper_energy": (("observed",), energy),
            "energy": (("rtol", "observed"), np.stack(energies)),
            "distance": (("time", "fiber"), between),
            "nudged_distance": (("time", "fiber"), grown),
            "seconds": (("rtol",), [seconds(tree) for tree in trees]),
            "steps": (("rtol",), [n["step_size"].size for n in numerics]),
            "rejected": (("rtol",), [int(n["rejected"].sum()) for n in numerics]),
            "nodes": (("rtol",), [int(n["nodes"].max()) for n in numerics]),
            "spatial_error": (("rtol",), [float(n["spatial_error"].max()) for n in numerics]),
            "processor_seconds": (("rtol",), again),
            "paper_seconds": ((), seconds(paper)),
            "paper_processor_seconds": ((), processor_seconds(case, paper, _MOMENTS)),
            "paper_steps": ((), paper["numerics"].sizes["step"]),
        },
        coords={"observed": observed, "time": times, "rtol": list(RTOLS)},
        attrs={"period": case.tier.period, "seed": case.seed, "quick": int(settings.quick)},
    )


def _energy(tree: xr.DataTree) -> tuple[Array, Array]:
    """Return times and the elastic energy of all filaments together."""
    observables = tree["observables"]
    return observables["time"].to_numpy(), observables["elastic_energy"].sum("fiber").to_numpy()


def figure(data: xr.Dataset) -> Figure:
    """Draw the energies of both engines, and how far runs of the high-order one are apart."""
    from stokesfibers.plot.style import FAINT, PAGE, PALETTE, new_panels, style

    above, below = new_panels(2, 1, width=0.75 * PAGE, height=4.2)[:, 0]
    with style():
        observed = data["observed"]
        above.plot(observed, data["paper_energy"], color=PALETTE[1], label="paper's scheme")
        above.plot(
            observed, data["energy"][0], color=PALETTE[0], linestyle=(0, (4, 2)), label="high order"
        )
        oscillating.mark_half_periods(above, data)
        above.set_ylabel(r"$E_\mathrm{elas}$")
        above.set_ylim(top=1.25 * float(data["paper_energy"].max()))
        above.legend(loc="upper left", ncols=2)
        time = data["time"].to_numpy()[1:]
        loose, tight = RTOLS
        for name, colour, label in (
            ("distance", PALETTE[0], f"rtol = {loose:g} and {tight:g}"),
            ("nudged_distance", PALETTE[2], f"displaced by {NUDGE:g} at first"),
        ):
            by_fiber = data[name].to_numpy()[1:]
            below.semilogy(time, by_fiber.max(axis=1), color=colour, label=f"{label}: largest")
            median = np.median(by_fiber, axis=1)
            below.semilogy(time, median, color=colour, linestyle=(0, (1, 1.2)), label="median")
        below.axhline(loose, color=FAINT, linewidth=0.7)
        oscillating.mark_half_periods(below, data)
        below.set_ylim(bottom=1e-7, top=10.0 * loose)
        below.set(xlabel="$t$", ylabel="distance of shapes")
        below.legend(loc="upper left", ncols=2)
    return above.figure


def check(data: xr.Dataset) -> Sequence[Row]:
    """Return speeds, differences of energies, and distances of shapes over the tolerance."""
    return [*_of_speed(data), *_of_energy(data), *_of_shapes(data)]


def _of_speed(data: xr.Dataset) -> list[Row]:
    quick = bool(data.attrs["quick"])
    ours, theirs = float(data["processor_seconds"][0]), float(data["paper_processor_seconds"])
    wall = float(data["seconds"][0]), float(data["paper_seconds"])
    one = data.isel(rtol=0)
    return [
        Row(
            f"processor time of the paper's steps over that of the high order, rtol = {RTOLS[0]:g}",
            theirs / ours,
            low=1.0 if quick else GOAL,
            note=f"{theirs:.0f} s in {int(one['paper_steps'])} steps against {ours:.0f} s in "
            f"{int(one['steps'])} ({int(one['rejected'])} tried again), {int(one['nodes'])} nodes "
            f"at the end. One thread, timed anew at {_MOMENTS} moments of each run.",
        ),
        Row(
            "the same of the wall times stored with the runs",
            wall[1] / wall[0],
            note=f"{wall[1]:.0f} s against {wall[0]:.0f} s, other work on the machine included.",
        ),
        Row(
            f"processor time at rtol = {RTOLS[1]:g} over that at {RTOLS[0]:g}",
            float(data["processor_seconds"][1]) / ours,
        ),
        Row("seed of the initial positions", float(data.attrs["seed"])),
    ]


def _of_energy(data: xr.Dataset) -> list[Row]:
    paper, (loose, tight) = data["paper_energy"].to_numpy(), data["energy"].to_numpy()
    largest = paper.max()
    when = [oscillating.peaks(data, e) for e in (paper, loose)]
    return [
        Row(
            f"largest difference of energies, rtol = {RTOLS[0]:g} and {RTOLS[1]:g}, over the "
            "largest energy",
            float(np.abs(loose - tight).max() / largest),
            high=10.0 * RTOLS[0],
        ),
        Row(
            "largest difference of the energies of both engines over the largest energy",
            float(np.abs(paper - tight).max() / largest),
            high=None if data.attrs["quick"] else 0.05,
            note="Two models: each engine has its own delta(s) and sum over images.",
        ),
        Row(
            "largest difference of the times of largest energy in a period, in periods",
            float(np.abs(when[0] - when[1]).max()),
            high=0.02,
        ),
    ]


def _of_shapes(data: xr.Dataset) -> list[Row]:
    loose = RTOLS[0]
    last, grown = data["distance"][-1].to_numpy(), data["nudged_distance"].to_numpy()
    end = float(data["time"][-1])
    reached = ", ".join(f"{float(e):.1e}" for e in data["spatial_error"])
    return [
        Row(
            f"distance of shapes at t = {end:g}, rtol = {loose:g} and {RTOLS[1]:g}, over {loose:g}",
            float(last.max()) / loose,
            high=1.0,
            note=f"The largest of all fibers; median {np.median(last) / loose:.2g}. "
            f"Errors in space {reached}.",
        ),
        Row(
            "the same, largest of the run",
            float(data["distance"].max()) / loose,
            high=10.0,
        ),
        Row(
            f"what becomes of a displacement of {NUDGE:g} at t = {end:g}, over it",
            float(grown[-1].max()) / NUDGE,
            note=f"The largest of all fibers; median {np.median(grown[-1]) / NUDGE:.2g}, largest "
            f"of the run {grown.max() / NUDGE:.2g}. rtol = {RTOLS[1]:g}.",
        ),
    ]
