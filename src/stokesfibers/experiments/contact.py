"""Filaments down to contact of their surfaces: the error of V + (eps^2/2) W alone, by four rules.

Two filaments lie parallel, parallel and displaced along each other, crossed, and one along the
outside of a strongly bent one, with gaps between the surfaces from 10 radii to 0.1 radius. What one
induces at the other's nodes is held against the integrals to rounding. The blend of Section 3.3.3
is off: it is a model, not a rule. Beside it, how many points ways of integrating there need.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array, Points
from stokesfibers.experiments import contact_own, contact_points, contact_rows
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.contact_rules import PAPER_RULES, SpectralSource, by_paper
from stokesfibers.experiments.contact_scenes import (
    Arrangement,
    arrangements,
    exact_velocity,
    rough_force,
    smooth_force,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INTERVALS = 100
"""Of the paper's engine."""
_PAPER_TARGETS = 21  # of its nodes
_FORCES = ("smooth", "rough")


@dataclass(frozen=True)
class Plan:
    """What is measured.

    Attributes
    ----------
    epsilons
        Radii at mid-length over the length.
    nodes
        Of the high-order engine.
    tolerances
        Of its rule.
    gaps
        Between the surfaces, in radii.
    counts
        Points of one rule.
    """

    epsilons: tuple[float, ...]
    nodes: tuple[int, ...]
    tolerances: tuple[float, ...]
    gaps: tuple[float, ...]
    counts: tuple[int, ...]


_SLOPES = (0.15, 0.08, 0.04)  # of the coil
_COUNTS = tuple(range(24, 129, 8))
_FULL = Plan(
    (10.0**-1.5, 1e-2, 10.0**-2.5, 1e-3),
    (24, 32, 48),
    (1e-4, 1e-6, 1e-8, 1e-10),
    tuple(float(g) for g in np.geomspace(0.1, 10.0, 9)),
    _COUNTS,
)
_QUICK = Plan((1e-3,), (32,), (1e-4, 1e-6, 1e-8), (0.1, 10.0), (32, 48, 64, 80, 96))


def run(settings: Settings) -> xr.Dataset:
    """Return errors by arrangement, rule and gap, and by points of a rule."""
    plan = _QUICK if settings.quick else _FULL
    places = arrangements()
    sizes = (len(places), len(plan.epsilons))
    paper = np.full((len(PAPER_RULES), *sizes, len(plan.gaps)), np.nan)
    plain = np.full((*sizes, len(plan.nodes), len(plan.gaps)), np.nan)
    ruled = np.full((len(_FORCES), *plain.shape[:3], len(plan.tolerances), len(plan.gaps)), np.nan)
    bound = np.zeros(len(places))
    for i, place in enumerate(places):
        if settings.progress:
            settings.progress(f"contact, {place.name}", i / len(places))
        for j, eps in enumerate(plan.epsilons):
            for m, gap in enumerate(plan.gaps):
                paper[:, i, j, m] = _paper_errors(place, eps, gap)
                for k, nodes in enumerate(plan.nodes):
                    found = _spectral_errors(place, eps, gap, (nodes, plan.tolerances))
                    plain[i, j, k, m], ruled[:, i, j, k, :, m] = found
        bound[i] = _reference_error(place, plan.epsilons[-1], min(plan.gaps))
    data = xr.Dataset(
        {
            "by_paper": (("paper_rule", "arrangement", "eps", "gap"), paper),
            "by_nodes": (("arrangement", "eps", "nodes", "gap"), plain),
            "by_rule": (("force", "arrangement", "eps", "nodes", "asked", "gap"), ruled),
            "reference_error": (("arrangement",), bound),
        },
        coords={
            "paper_rule": list(PAPER_RULES),
            "arrangement": [place.name for place in places],
            "eps": list(plan.epsilons),
            "nodes": list(plan.nodes),
            "asked": list(plan.tolerances),
            "gap": list(plan.gaps),
            "force": list(_FORCES),
        },
        attrs={"intervals": INTERVALS, "quick": int(settings.quick)},
    )
    points = contact_points.errors_by_points(plan.counts)
    return data.merge(points).merge(contact_own.own_errors(_SLOPES))


def _relative(found: Points, exact: Points) -> float:
    """Return the largest error over the largest velocity."""
    off = np.linalg.norm(found - exact, axis=1).max()
    return float(off / np.linalg.norm(exact, axis=1).max())


def _distance(eps: float, gap: float) -> float:
    return (2.0 + gap) * eps


def _paper_errors(place: Arrangement, eps: float, gap: float) -> list[float]:
    """Return the errors of the paper's two rules at some of the target's nodes."""
    s = np.linspace(0.0, 1.0, _PAPER_TARGETS)
    points = np.ascontiguousarray(place.target(s, _distance(eps, gap)).T)

    def position(at: Array) -> Array:
        return place.source.sample(at).x

    exact = exact_velocity(position, (smooth_force,), points, 0.5 * eps**2)[0]
    found = by_paper(place.source, points, eps=eps, intervals=INTERVALS)
    return [_relative(found[rule], exact) for rule in PAPER_RULES]


def _spectral_errors(
    place: Arrangement, eps: float, gap: float, sizes: tuple[int, tuple[float, ...]]
) -> tuple[float, Array]:
    """Return the error by the nodes alone, and by the rule, (force, tolerance).

    The reference integrates over the shape as the modes have it: only the rule errs.
    """
    nodes, tolerances = sizes
    source = SpectralSource.of(place.source, eps=eps, nodes=nodes)
    points = np.ascontiguousarray(place.target(source.fiber.sigma, _distance(eps, gap)).T)
    found = np.empty((len(_FORCES), len(tolerances)))
    forces = (smooth_force, rough_force(nodes))
    exact = exact_velocity(source.position, forces, points, 0.5 * eps**2)
    for f, force in enumerate(forces):
        for t, tolerance in enumerate(tolerances):
            found[f, t] = _relative(source.velocity(points, force, tolerance), exact[f])
    return _relative(source.velocity(points, smooth_force, None), exact[0]), found


def _reference_error(place: Arrangement, eps: float, gap: float) -> float:
    """Return what panels of another order change of the reference, relative."""
    points = np.ascontiguousarray(place.target(np.array([0.2, 0.56]), _distance(eps, gap)).T)

    def position(at: Array) -> Array:
        return place.source.sample(at).x

    one, other = (
        exact_velocity(position, (smooth_force,), points, 0.5 * eps**2, order=order)[0]
        for order in (16, 40)
    )
    return _relative(one, other)


def figure(data: xr.Dataset) -> Figure:
    """Draw errors against the gap for four arrangements, and against points for two places."""
    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(2, 3, width=PAGE, height=4.6)
    flat = axes.ravel()
    with style():
        for ax, name in zip(flat[[0, 1, 2, 3]], data["arrangement"].to_numpy(), strict=True):
            _draw_errors(ax, data, str(name))
        flat[0].set_ylabel("relative error of $V + (\\varepsilon^2/2)\\,W$")
        flat[3].set_ylabel("relative error of $V + (\\varepsilon^2/2)\\,W$")
        key = flat[0].legend(loc=(0.02, 0.25), fontsize=6.5, labelspacing=0.1, frameon=True)
        key.get_frame().set(facecolor="white", edgecolor="none", alpha=1.0)
        for ax, place in zip(flat[[4, 5]], data["place"].to_numpy(), strict=True):
            _draw_points(ax, data, str(place))
        flat[4].set_ylabel("error of a row")
        flat[4].legend(loc="upper right", fontsize=6.5, borderaxespad=0.0)
    return flat[0].figure


def _draw_errors(ax: Axes, data: xr.Dataset, name: str) -> None:
    from stokesfibers.plot.style import FAINT, INK, PALETTE

    picked = data.sel(arrangement=name).sel(eps=contact_rows.EPS)
    gap = data["gap"].to_numpy()
    for rule, colour in zip(data["paper_rule"].to_numpy(), (PALETTE[1], PALETTE[2]), strict=True):
        label = f"{rule}, {data.attrs['intervals']} intervals"
        ax.loglog(gap, picked["by_paper"].sel(paper_rule=rule), "-", color=colour, label=label)
    ax.loglog(gap, picked["by_nodes"].sel(nodes=32), "-", color=INK, label="32 nodes alone")
    for tolerance, dash in zip((1e-4, 1e-6, 1e-8), ("-", (0, (4, 1.5)), (0, (1, 1))), strict=True):
        found = picked["by_rule"].sel(force="smooth", nodes=32, asked=tolerance)
        label = f"rule, $10^{{{round(np.log10(tolerance))}}}$"
        ax.loglog(gap, found, color=PALETTE[0], linestyle=dash, label=label)
        ax.axhline(tolerance, color=FAINT, linewidth=0.5, zorder=0)
    ax.set(xlim=(0.1, 10.0), ylim=(1e-15, 1e2), title=f"{name}, $\\varepsilon = 10^{{-3}}$")
    ax.set_xlabel("gap / radius")
    ax.set_xticks((0.1, 1.0, 10.0), ["0.1", "1", "10"])


def _draw_points(ax: Axes, data: xr.Dataset, place: str) -> None:
    from stokesfibers.plot.style import PALETTE

    labels = {"sinh": "$s = a + b \\sinh t$", "swap": "singularity swap"}
    picked = data.sel(place=place)
    for (way, label), colour in zip(labels.items(), PALETTE, strict=False):
        found = picked["by_points"].sel(way=way)
        ax.semilogy(data["points"], found, "o-", color=colour, markersize=2.0, label=label)
    ax.semilogy(
        picked["panel_points"], picked["by_panels"], "o-", color=PALETTE[3], markersize=2.0,
        label="halved panels",
    )  # fmt: skip
    title = f"{place}, gap {contact_points.GAP} radius, $\\varepsilon = 10^{{-3}}$"
    ax.set(xlim=(0.0, 400.0), ylim=(1e-16, 1e2), xlabel="points", title=title)


def check(data: xr.Dataset) -> Sequence[Row]:
    """State errors over tolerances, errors of the other rules, and points needed."""
    return contact_rows.rows(data)
