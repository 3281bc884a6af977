"""The figure of `accuracy`: error against cost, steps and nodes, all runs on the same axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.experiments.accuracy_rows import GOALS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SCHEME = {"marker": "s", "markersize": 3.2, "linewidth": 0.8, "linestyle": (0, (1, 1.2))}
_ENGINE = {"marker": "o", "markersize": 3.2, "linewidth": 0.9}


def figure(data: xr.Dataset) -> Figure:
    """Draw error against wall time, steps and nodes; one colour per case."""
    from matplotlib.ticker import NullFormatter

    from stokesfibers.plot.style import PAGE, new_panels, style

    axes = new_panels(1, 3, width=PAGE, height=2.9)[0]
    unit = data.attrs["unit_smallest"]
    with style():
        for k in range(data.sizes["case"]):
            _draw_case(axes, data.isel(case=k), _look(data, k), unit)
        cost, steps, nodes = axes
        first = data.isel(case=0)
        aimed = {"marker": "*", "markersize": 7, "linestyle": "", "color": _look(data, 0)["color"]}
        aimed |= {"markeredgecolor": "white", "markeredgewidth": 0.4, "zorder": 4}
        cost.loglog(first["aim_whole"] / first["aim_unit"], first["aim_error"], **aimed)
        steps.loglog(first["aim_steps"], first["aim_error"], **aimed)
        nodes.semilogy(first["aim_nodes"], first["aim_error"], **aimed)
        if not data.attrs["quick"]:
            _draw_goals(cost)
        cost.set(xlabel="wall time / LAPACK solve of size 603", ylabel="largest error of the shape")
        steps.set(xlabel="steps")
        nodes.set(xlabel="nodes, or intervals, per fiber", xscale="log")
        ticks = [20, 30, 50, 100, 200]
        nodes.set_xticks(ticks, [str(t) for t in ticks])
        nodes.minorticks_off()
        lowest = 0.4 * min(float(data[f"{n}_error"].min()) for n in ("rtol", "space"))
        highest = 1.5 * max(float(data[n].max()) for n in ("space_error", "paper_shape"))
        low, high = steps.get_xlim()
        counts = [n for n in (100, 300, 1000, 3000, 10000) if low < n < high]
        steps.set_xticks(counts, [str(n) for n in counts])
        for ax in (cost, steps):
            ax.xaxis.set_minor_formatter(NullFormatter())
        for ax, letter in zip(axes, "abc", strict=True):
            ax.set_ylim(lowest, highest)
            ax.set_title(f"({letter})", loc="left")
        _legend(axes[0].figure, data)
    return axes[0].figure


def _look(data: xr.Dataset, k: int) -> dict[str, Any]:
    """Return the colour of a case; (16) has hollow markers, a run in space half ones."""
    from stokesfibers.plot.style import PALETTE

    mu_bars = list(dict.fromkeys(data["mu_bar"].to_numpy().tolist()))
    one = data.isel(case=k)
    look: dict[str, Any] = {"color": PALETTE[mu_bars.index(float(one["mu_bar"]))]}
    if str(one["regularization"].values) == "paper":
        look |= {"markerfacecolor": "white", "markeredgewidth": 0.8, "zorder": 1.5}
    if float(one["skew"]):
        look |= {"fillstyle": "left", "zorder": 1.5}
    return look


def _draw_case(axes: Any, case: xr.Dataset, look: dict[str, Any], unit: float) -> None:
    cost, steps, nodes = axes
    cost.loglog(case["rtol_whole"] / case["rtol_unit"], case["rtol_error"], **_ENGINE, **look)
    cost.loglog(case["paper_whole"] / unit, case["paper_shape"], **_SCHEME, **look)
    steps.loglog(case["rtol_steps"], case["rtol_error"], **_ENGINE, **look)
    steps.loglog(case["paper_steps"], case["paper_shape"], **_SCHEME, **look)
    nodes.loglog(case["nodes"], case["space_error"], **_ENGINE, **look)
    nodes.loglog(case["intervals"], case["paper_shape"], **_SCHEME, **look)


def _draw_goals(ax: Any) -> None:
    """Mark the goals as corners: to be met from the left and below."""
    from stokesfibers.plot.style import FAINT

    for error, cost in GOALS.items():
        ax.plot([cost / 3.0, cost, cost], [error, error, error / 5.0], color=FAINT, linewidth=0.8)


def _legend(drawn: Any, data: xr.Dataset) -> None:
    from matplotlib.lines import Line2D

    from stokesfibers.plot.style import FAINT, INK

    lines = []
    for k in range(data.sizes["case"]):
        one = data.isel(case=k)
        power = int(np.log10(float(one["mu_bar"])))
        text = rf"$\bar\mu = {float(one['mu_bar']) / 10**power:g} \times 10^{power}$"
        if str(one["regularization"].values) == "paper":
            text += ", (16)"
        if float(one["skew"]):
            text += ", in 3D"
        lines.append(Line2D([], [], **(_ENGINE | {"linestyle": ""}), **_look(data, k), label=text))
    lines.append(Line2D([], [], **_ENGINE, color=INK, label="high order"))
    lines.append(Line2D([], [], **_SCHEME, color=INK, label="paper's scheme"))
    fixed = {"marker": "*", "markersize": 7, "linestyle": "", "color": INK}
    lines.append(Line2D([], [], **fixed, label="high order, nodes given"))
    if not data.attrs["quick"]:
        lines.append(Line2D([], [], color=FAINT, linewidth=0.8, label="goals"))
    drawn.legend(handles=lines, loc="outside upper center", ncols=4)
