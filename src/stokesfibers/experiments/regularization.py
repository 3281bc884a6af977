"""Three choices of delta(s): smallest eigenvalues, closeness to the bare theory, trajectories.

For each choice the smallest eigenvalue of -c + S_delta along a straight filament against the
number of nodes; the largest change of S_delta[g], g smooth, from S_0[g] against eps; and what the
choice does to the buckling filament of Figs. 4 and 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import accuracy_plan, regularization_rows, runs
from stokesfibers.experiments.accuracy import integral_of_n1
from stokesfibers.experiments.accuracy_plan import Case
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.engine_runs import largest_distance, shapes
from stokesfibers.numerics.legendre import gauss_legendre
from stokesfibers.slender.mobility import NonLocal, slenderness_constant
from stokesfibers.slender.regularization import (
    AbstractRegularization,
    ConstantRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)
from stokesfibers.slender.spectral import mobility_weights
from stokesfibers.slender.spectrum import smallest_eigenvalue

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHOICES: tuple[AbstractRegularization, ...] = (
    SpheroidalRegularization(),
    PaperRegularization(),
    ConstantRegularization(),
)
_LABELS = {"spheroidal": "spheroidal", "paper": "(16)", "constant": "constant"}
_CHANGED_AT = (4e-2, 2e-2, 1e-2, 5e-3, 2.5e-3, 1e-3, 3e-4, 1e-4)
_PANEL = 20  # Gauss-Legendre points on a panel of unit length
_NEAREST, _TARGETS = 1e-8, 160


@dataclass(frozen=True)
class Plan:
    """What is computed.

    Attributes
    ----------
    epsilons
        Slendernesses whose eigenvalues are computed.
    legendre, uniform
        Numbers of nodes, and of equal intervals.
    """

    epsilons: tuple[float, ...]
    legendre: tuple[int, ...]
    uniform: tuple[int, ...]


_FULL = Plan((10.0**-1.5, 1e-2, 1e-3), (16, 32, 64, 128, 256, 512), (25, 50, 100, 200, 400, 800))
_QUICK = Plan((1e-2,), (16, 32, 64, 128), (25, 50, 100))


def run(settings: Settings) -> xr.Dataset:
    """Return eigenvalues, changes and differences of trajectories by choice of delta."""
    plan = _QUICK if settings.quick else _FULL
    legendre = _eigenvalues(plan, plan.legendre, on_legendre_nodes)
    uniform = _eigenvalues(plan, plan.uniform, on_uniform_grid)
    changes = [[largest_change(choice, eps) for eps in _CHANGED_AT] for choice in CHOICES]
    data = xr.Dataset(
        {
            "legendre": (("choice", "eps", "nodes"), legendre),
            "uniform": (("choice", "eps", "intervals"), uniform),
            "change": (("choice", "changed_at"), changes),
        },
        coords={
            "choice": [choice.kind for choice in CHOICES],
            "eps": list(plan.epsilons),
            "nodes": list(plan.legendre),
            "intervals": list(plan.uniform),
            "changed_at": list(_CHANGED_AT),
        },
    )
    shape, integral, chosen = _trajectories(settings)
    return data.assign(
        shape_difference=(("choice",), shape), integral=(("choice",), integral)
    ).assign_attrs(
        mu_bar=chosen.mu_bar,
        quick=int(settings.quick),
    )


def on_legendre_nodes(choice: AbstractRegularization, eps: float, nodes: int) -> float:
    """Return the smallest eigenvalue of -c + S_delta, collocated at Gauss-Legendre nodes."""
    weights = mobility_weights(NonLocal(choice), nodes, eps)
    operator = weights.finite - slenderness_constant(eps) * np.eye(nodes)
    return float(np.linalg.eigvals(operator).real.min())


def on_uniform_grid(choice: AbstractRegularization, eps: float, intervals: int) -> float:
    """Return the smallest eigenvalue of -c + S_delta of the paper's discretisation."""
    return smallest_eigenvalue(NonLocal(choice).weights(intervals, eps), eps)


def force(s: Array) -> Array:
    """Return a smooth force whose slope at the ends and curvature inside are not zero."""
    return np.cos(3.0 * s) + s


def largest_change(choice: AbstractRegularization, eps: float) -> float:
    """Return the largest ``|S_delta[force] - S_0[force]|`` over the fiber."""
    half = np.geomspace(_NEAREST, 0.5, _TARGETS)
    places = np.concatenate([half, 1.0 - half[::-1]])
    deltas = choice.delta(places, eps)
    found = [change(s, delta) for s, delta in zip(places.tolist(), deltas.tolist(), strict=True)]
    return float(np.abs(found).max())


def change(s: float, delta: float) -> float:
    """Return ``S_delta[force](s) - S_0[force](s)``.

    With s' = s + delta sinh t on the right, and likewise on the left, the integrand is
    ``-(force(s') - force(s)) 2 / (exp(2 t) - 1)``: smooth, so panels of unit length serve.
    """
    x, w = gauss_legendre(_PANEL)
    total = 0.0
    for side, room in ((1.0, 1.0 - s), (-1.0, s)):
        reach = float(np.arcsinh(room / delta))
        panels = max(1, int(np.ceil(reach)))
        t = ((np.arange(panels)[:, None] + x) * (reach / panels)).ravel()
        weight = np.tile(w * (reach / panels), panels)
        rise = force(s + side * delta * np.sinh(t)) - force(np.array(s))
        total -= float(weight @ (rise * 2.0 / np.expm1(2.0 * t)))
    return total


def _eigenvalues(plan: Plan, sizes: tuple[int, ...], smallest: Any) -> list[list[list[float]]]:
    return [[[smallest(c, eps, n) for n in sizes] for eps in plan.epsilons] for c in CHOICES]


def _trajectories(settings: Settings) -> tuple[list[float], list[float], Case]:
    """Return by choice the distance of shapes from the spheroidal choice's, and int N_1 dt."""
    chosen = accuracy_plan.plan(settings.quick)
    first = chosen.cases[0]
    cases = [replace(first, regularization=choice) for choice in CHOICES]
    trees = runs.finished([chosen.known(case, chosen.reference) for case in cases], settings)
    all_shapes = [shapes(tree, chosen.times, chosen.points) for tree in trees]
    apart = [largest_distance(x, all_shapes[0]) for x in all_shapes]
    return apart, [integral_of_n1(tree, chosen) for tree in trees], first


def check(data: xr.Dataset) -> Sequence[Row]:
    """Return eigenvalues against their bounds, slopes, and differences of trajectories."""
    return regularization_rows.rows(data)


def figure(data: xr.Dataset) -> Figure:
    """Draw eigenvalues on both kinds of nodes, and the change of the operator against eps."""
    from stokesfibers.plot.style import FAINT, INK, PAGE, PALETTE, new_panels, style

    axes = new_panels(1, 3, width=PAGE, height=2.75)[0]
    dashes = ("-", (0, (4, 1.5)), (0, (1, 1.2)))
    markers = ("o", "s", "^")
    with style():
        for k, kind in enumerate(data["choice"].values):
            look: dict[str, Any] = {"color": PALETTE[k], "marker": markers[k], "markersize": 2.6}
            look |= {"linewidth": 0.8, "zorder": 2.0 - 0.1 * k}
            for j in range(data.sizes["eps"]):
                for ax, name, size in zip(axes, ("legendre", "uniform"), _SIZES, strict=False):
                    ax.plot(data[size], data[name][k, j], linestyle=dashes[j], **look)
            axes[2].loglog(data["changed_at"], data["change"][k], **look, label=_LABELS[str(kind)])
        eps = np.array([_CHANGED_AT[-1], 1.2e-3])
        for power, factor in ((1, 0.9), (2, 25.0)):
            axes[2].loglog(eps, factor * eps**power, color=FAINT, linewidth=0.8)
        axes[2].text(1.2e-4, 3.2e-5, "slope 1", ha="left", color=INK)
        axes[2].text(4.5e-4, 2e-6, "slope 2", ha="left", color=INK)
        for ax, label in zip(axes, ("Gauss-Legendre nodes", "equal intervals"), strict=False):
            ax.axhline(0.0, color=INK, linewidth=0.5, zorder=0)
            ax.axhline(regularization_rows.BOUND, color=FAINT, linewidth=0.7, zorder=0)
            ax.set(xscale="log", xlabel=label, ylim=(-4.5, 2.3))
        for ax, size in zip(axes, _SIZES, strict=False):
            ax.set_xticks(data[size], [str(n) for n in data[size].to_numpy()])
            ax.minorticks_off()
        axes[0].set_ylabel(r"smallest eigenvalue of $-c + S_\delta$")
        axes[2].set(xlabel=r"$\varepsilon$", ylabel=r"largest $|S_\delta[g] - S_0[g]|$")
        _legend(axes[0].figure, data, (dashes, axes[2].get_legend_handles_labels()))
        for ax, letter in zip(axes, "abc", strict=True):
            ax.set_title(f"({letter})", loc="left")
    return axes[0].figure


_SIZES = ("nodes", "intervals")


def _legend(drawn: Any, data: xr.Dataset, parts: Any) -> None:
    from matplotlib.lines import Line2D

    from stokesfibers.plot.style import INK

    dashes, (handles, labels) = parts
    lines = []
    for j, eps in enumerate(data["eps"].to_numpy()):
        power = f"{np.log10(eps):.3g}"
        look = {"color": INK, "linewidth": 0.8, "linestyle": dashes[j]}
        lines.append(Line2D([], [], **look, label=rf"$\varepsilon = 10^{{{power}}}$"))
    texts = [*labels, *(line.get_label() for line in lines)]
    drawn.legend([*handles, *lines], texts, loc="outside upper center", ncols=6)
