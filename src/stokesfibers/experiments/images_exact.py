"""Appendix C against the exact sum: what cutting off images costs, and what moments (42) mend.

The filament of Fig. 2-4 at its largest elastic energy, from the high-order engine. It is at its
middle, image p at -p d. Its velocity is that of the force f at Gauss nodes, without the doublet;
all sums share the nodes, so that their differences are those of the sums. The exact sum is the
Ewald sum with one period; a long sum over images, extrapolated, and the Gauss rule of images at
places between whole ones stand beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline

from stokesfibers.core.arrays import Array, Points
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Periodic
from stokesfibers.experiments import runs
from stokesfibers.experiments import slow_sums as slow
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.engine_runs import EngineRun
from stokesfibers.experiments.images import HEIGHTS, LINES, MU_BAR, PERIODS, REACH
from stokesfibers.experiments.slow_sums import Pairs
from stokesfibers.experiments.tiers import tier
from stokesfibers.numerics.legendre import gauss_legendre
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.summation.ewald import EwaldSum
from stokesfibers.summation.periodic_kernel import replaced_images

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DISTANCES = tuple(float(x) for x in np.linspace(0.3, 1.0, 15))
"""x of the lines of test points; half the shortest period is the farthest there is."""
REACHES = (1, 2, 3, 4, 6, 8, 12, 16)
"""P: images |p| <= P are summed as they are."""
SUMS = ("cut", "midpoint", "centre")
"""|p| <= P alone; with (42) for P < |p| <= Q about the middle node; about the centre of mass."""
FAR = 400
"""Q of the curves against P, far enough that what is left is not Q's."""
_PRINTED = {"cut": 6.7, "midpoint": 0.7}
"""Largest relative errors at x = 0.9 that the paper gives, in percent; its P is 1, its Q 20."""
_NODES = 48
_TOLERANCE = 1e-10
_AXIS = 0


def run(settings: Settings) -> xr.Dataset:
    """Return errors of all sums against distance and against the number of exact images."""
    sources, forces = _filament(settings)
    magnitude = np.empty((len(PERIODS), len(DISTANCES)))
    error = np.empty((len(PERIODS), len(DISTANCES), len(SUMS), len(REACHES)))
    twenty = np.empty((len(PERIODS), len(DISTANCES), len(SUMS)))
    apart = np.empty((len(PERIODS), 2))
    for i, period in enumerate(PERIODS):
        exact, apart[i] = _exact(sources, forces, period)
        for j, line in enumerate(DISTANCES):
            pairs = Pairs(_points(line), sources, forces)
            largest = float(np.linalg.norm(exact[j], axis=1).max())
            magnitude[i, j] = largest
            for k, name in enumerate(SUMS):
                for m, reach in enumerate(REACHES):
                    off = _approximate(pairs, period, name, (reach, FAR)) - exact[j]
                    error[i, j, k, m] = np.linalg.norm(off, axis=1).max() / largest
                off = _approximate(pairs, period, name, (1, REACH)) - exact[j]
                twenty[i, j, k] = np.linalg.norm(off, axis=1).max() / largest
    lines = ("period", "x", "sum")
    return xr.Dataset(
        {
            "position": (("node", "space"), sources),
            "magnitude": (("period", "x"), magnitude),
            "error": ((*lines, "reach"), error),
            "error_of_42": (lines, twenty),
            "between_exact_sums": (("period", "other"), apart),
        },
        coords={
            "period": list(PERIODS),
            "x": list(DISTANCES),
            "sum": list(SUMS),
            "reach": list(REACHES),
            "other": ["long sum, extrapolated", "replaced images"],
        },
        attrs={"mu_bar": MU_BAR, "quick": int(settings.quick)},
    )


def _filament(settings: Settings) -> tuple[Points, Array]:
    """Return nodes (node, 3) about the middle and what force each carries, (node, 3)."""
    chosen = EngineRun(tier(settings.quick), MU_BAR, SpectralEngine(rtol=1e-4))
    tree = runs.finished([chosen], settings)[0]
    times, energies = runs.series(tree, "elastic_energy")
    stored = tree["trajectory"]["time"].to_numpy()
    at_stored = np.interp(stored, times, energies)
    found = runs.frames(tree, stored[[int(np.argmax(at_stored))]]).isel(time=0, fiber=0)
    kind = chosen.problem.kinds[0]
    fiber = SpectralFiber.build(
        kind.length,
        kind.eps,
        rigidity=kind.rigidity,
        nodes=_NODES,
        mobility=chosen.problem.mobility,
    )
    at = np.linspace(0.0, 1.0, found.sizes["node"])
    modes = fiber.fit(make_interp_spline(at, found["position"].to_numpy(), k=7))
    sigma, weight = gauss_legendre(2 * _NODES)
    pull = make_interp_spline(at, found["tension"].to_numpy(), k=7)(sigma)
    root = np.sqrt(weight)
    table = root[:, None] * fiber.basis.tensions(sigma, 0)
    tension = np.linalg.lstsq(table, root * pull / fiber.force_unit, rcond=None)[0]
    s = fiber.sigma * fiber.length
    middle = fiber.position(modes, np.array([0.5 * fiber.length]))
    force = fiber.force(modes, tension, s).T
    # its integral vanishes but for the rule's error on tension times curvature
    force -= fiber.quadrature @ force / fiber.length
    sources = np.ascontiguousarray((fiber.position(modes, s) - middle).T)
    return sources, force * fiber.quadrature[:, None]


def _points(line: float) -> Points:
    points = np.zeros((HEIGHTS.size, 3))
    points[:, 0], points[:, 1] = line, HEIGHTS
    return points


def _exact(sources: Points, forces: Array, period: float) -> tuple[Array, Array]:
    """Return the sum over all images on all lines, (line, point, 3), and how far others are off."""
    points = np.concatenate([_points(line) for line in DISTANCES])
    domain = Periodic((period, 0.0, 0.0))
    plan = EwaldSum(_TOLERANCE).plan(domain, sources, points, workers=Workers(1))
    found = plan.execute(forces)
    some = slice(None, None, 7)
    pairs = Pairs(points[some], sources, forces)
    others = slow.one_direction(pairs, period, _AXIS), _by_replaced_images(pairs, period)
    size = np.linalg.norm(found[some])
    apart = [float(np.linalg.norm(found[some] - other) / size) for other in others]
    return found.reshape(len(DISTANCES), -1, 3), np.array(apart)


def _by_replaced_images(pairs: Pairs, period: float) -> Array:
    """Return |p| <= 1 and the Gauss rule for the others, see `summation.periodic_kernel`."""
    found = _images(pairs, period, (-1.0, 0.0, 1.0))
    for place, weight in zip(*replaced_images(), strict=True):
        found += weight * _images(pairs, period, (-place, place))
    return found


def _images(pairs: Pairs, period: float, places: Sequence[float]) -> Array:
    step = period * np.eye(3)[_AXIS]
    return np.sum([slow.free(pairs, place * step) for place in places], axis=0)


def _approximate(pairs: Pairs, period: float, name: str, reach: tuple[int, int]) -> Array:
    """Return |p| <= P as they are and, unless cut, P < |p| <= Q by moments, (point, 3)."""
    near, far = reach
    found = _images(pairs, period, np.arange(-near, near + 1.0).tolist())
    if name == "cut":
        return found
    moments = -pairs.sources.T @ pairs.forces  # S = int x_s F ds of (41), by parts
    weights = gauss_legendre(len(pairs.sources))[1]
    centre = np.zeros(3) if name == "midpoint" else weights @ pairs.sources
    p = np.concatenate([np.arange(-far, -near), np.arange(near + 1, far + 1)])
    r = pairs.targets[:, None] - centre + (p * period)[:, None] * np.eye(3)[_AXIS]
    r2 = np.einsum("tpi,tpi->tp", r, r)
    form = np.einsum("tpi,ij,tpj->tp", r, moments, r) / r2
    return found + np.einsum("tp,tpi->ti", (np.trace(moments) - 3.0 * form) * r2**-1.5, r)


def figure(data: xr.Dataset) -> Figure:
    """Draw errors against P on the paper's lines, and against the distance."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(1, 3, width=PAGE, height=2.4)[0]
    with style():
        _draw_reaches(axes[0], data)
        for ax, period in zip(axes[1:], (PERIODS[0], PERIODS[-1]), strict=True):
            _draw_distances(ax, data.sel(period=period))
            ax.set_title(f"$d = {period:g}$")
        drawn = axes[0].figure
        drawn.legend(handles=axes[1].get_lines(), loc="outside upper center", ncols=len(SUMS))
    return drawn


_LABELS = {
    "cut": r"$|p| \leq P$ alone",
    "midpoint": "with (42)",
    "centre": "with (42), centre of mass",
}
_NAMES = {
    "cut": "|p| <= 1 alone",
    "midpoint": "|p| <= 1 and (42), mid-point",
    "centre": "|p| <= 1 and (42), centre of mass",
}


def _draw_reaches(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import PALETTE

    dashes: tuple[Any, ...] = ("-", (0, (4, 2)), (0, (1, 1.2)))
    for name, colour in zip(SUMS, PALETTE, strict=False):
        for line, dash in zip(LINES, dashes, strict=True):
            one = data["error"].sel(period=PERIODS[0], sum=name).sel(x=line, method="nearest")
            ax.plot(data["reach"], one, color=colour, linestyle=dash, linewidth=0.8)
    ax.set(xscale="log", yscale="log", xlabel="$P$", ylabel="relative error")
    ax.set_title("$d = 2$; $x = 0.3, 0.6, 0.9$")


def _draw_distances(ax: Axes, data: xr.Dataset) -> None:
    from stokesfibers.plot.style import PALETTE

    for name, colour in zip(SUMS, PALETTE, strict=False):
        one = data["error"].sel(sum=name, reach=1)
        ax.plot(data["x"], one, color=colour, label=_LABELS[name])
    ax.set(yscale="log", xlabel="distance $x$", ylabel="relative error, $P = 1$")


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare the exact sums with each other, and the approximations with them and the paper."""
    rows = []
    for other in data["other"].to_numpy():
        off = float(data["between_exact_sums"].sel(other=other).max())
        rows.append(Row(f"Ewald sum against {other}, relative", off, high=1e-9))
    at = data.sel(period=PERIODS[0])
    for name in SUMS:
        for line in LINES:
            one = at["error_of_42"].sel(sum=name).sel(x=line, method="nearest")
            printed = _PRINTED.get(name) if line == LINES[-1] else None
            span = (0.5 * printed, 2.0 * printed) if printed else (None, None)
            quantity = f"error of {_NAMES[name]}, Q = {REACH}, x = {line}, %"
            rows.append(Row(quantity, 100.0 * float(one), printed, *span))
    return [*rows, *_orders(at)]


def _orders(at: xr.Dataset) -> list[Row]:
    rows = []
    p = at["reach"].to_numpy() + 0.5
    for name in SUMS:
        for line in LINES:
            one = at["error"].sel(sum=name).sel(x=line, method="nearest").to_numpy()
            order = float(np.log(one[-3] / one[-1]) / np.log(p[-1] / p[-3]))
            note = "Errors: " + ", ".join(f"{e:.1e}" for e in one) + "."
            what = _NAMES[name].replace("<= 1", "<= P")
            rows.append(Row(f"order in P of {what}, x = {line}", order, None, 1.8, 2.2, note))
    return rows
