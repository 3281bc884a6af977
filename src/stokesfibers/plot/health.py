"""Whether a run can be trusted, at a glance: length error, steps, cost, and largest curvature."""

from __future__ import annotations

import json
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.status import Status
from stokesfibers.plot import select
from stokesfibers.plot.series import draw_fibers
from stokesfibers.plot.style import COLUMN, new_panels, style
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_MANY = 20.0  # a step size that changes by more than this factor is drawn on a log scale
_FEW_STAGES = 5


def health(data: xr.DataTree) -> NDArray[Any]:
    """Draw length error, step size, wall time per step and largest curvature against time.

    What the run did not store is said in its panel. The title is the run's status.

    Parameters
    ----------
    data
        The stored run.

    Returns
    -------
    ndarray of Axes : (4,)
    """
    axes = new_panels(4, 1, width=COLUMN, height=5.4)[:, 0]
    with style():
        _length_error(axes[0], data)
        _step_size(axes[1], data)
        _wall_time(axes[2], data)
        _curvature(axes[3], data)
        axes[3].set_xlabel(select.time_label(data))
        _common_time(axes)
        text, colour = _status(data)
        if text:
            figure = axes[0].figure
            figure.suptitle(textwrap.fill(text, 72), color=colour, x=0.02, ha="left")
        axes[0].figure.align_ylabels(list(axes))
    return axes


def _length_error(ax: Axes, data: xr.DataTree) -> None:
    if _missing(ax, data, "observables", "length_error"):
        return
    array = abs(select.read(data, "observables", "length_error"))
    # Zero has no place on a log scale.
    draw_fibers(ax, data, array.where(array > 0.0))
    if bool((array > 0.0).any()):
        ax.set_yscale("log")
    _small_legend(ax)


def _step_size(ax: Axes, data: xr.DataTree) -> None:
    if _missing(ax, data, "numerics", "step_size"):
        return
    time = select.numbers(data, "numerics", "time")
    size = select.numbers(data, "numerics", "step_size")
    # A step is stored with the time at its end, so its size holds back to the point before.
    ax.plot(time, size, color=theme().palette[0], drawstyle="steps-pre")
    if select.has(data, "numerics", "rejected"):
        redone = select.numbers(data, "numerics", "rejected") > 0
        if redone.any():
            ax.plot(
                time[redone],
                size[redone],
                ".",
                color=theme().palette[1],
                markersize=3,
                label="after rejection",
            )
    positive = size[size > 0.0]
    if positive.size and positive.max() > _MANY * positive.min():
        ax.set_yscale("log")
    else:
        ax.set_ylim(bottom=0.0, top=1.15 * float(np.nanmax(size)))
    _small_legend(ax)


def _wall_time(ax: Axes, data: xr.DataTree) -> None:
    if _missing(ax, data, "numerics", "wall_time"):
        return
    time = select.numbers(data, "numerics", "time")
    array = select.read(data, "numerics", "wall_time").transpose("step", ...)
    total = select.values(select.total_over_rest(array, "step"))
    # broad and pale below the stages, the slowest of which lies upon it
    ax.plot(time, total, color=theme().bands[0], linewidth=2.0, label="all stages")
    if "stage" in array.dims and 1 < array.sizes["stage"] <= _FEW_STAGES:
        names = array["stage"].to_numpy()
        for number, line in enumerate(select.values(array).T):
            label = str(names[number]).replace("_", " ")
            ax.plot(time, line, color=theme().palette[1 + number], linewidth=0.4, label=label)
    if np.nanmax(total, initial=0.0) > 0.0:
        ax.set_yscale("log")
        _plain_log_ticks(ax)
    _small_legend(ax)


def _curvature(ax: Axes, data: xr.DataTree) -> None:
    if _missing(ax, data, "observables", "largest_curvature"):
        return
    draw_fibers(ax, data, select.read(data, "observables", "largest_curvature"))
    ax.set_ylim(bottom=0.0)
    _small_legend(ax)


def _missing(ax: Axes, data: xr.DataTree, group: str, name: str) -> bool:
    """Label the panel; where nothing is stored, say so in it and return True."""
    ax.set_ylabel(select.axis_label(select.describe(data, group, name), longest=18))
    there = select.has(data, group, name) and select.has(data, group, "time")
    if there and bool(np.isfinite(select.numbers(data, group, name)).any()):
        return False
    ax.text(
        0.5,
        0.5,
        "not recorded",
        color=theme().faint,
        ha="center",
        va="center",
        transform=ax.transAxes,
    )
    ax.set_yticks([])
    return True


def _small_legend(ax: Axes) -> None:
    count = len(ax.get_legend_handles_labels()[1])
    if count > 1 or (count == 1 and len(ax.get_lines()) > 1):
        # Above the panel, where no line is hidden.
        legend = ax.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=min(count, 4),
            columnspacing=1.0,
            fontsize=6.5,
        )
        for line in legend.get_lines():
            line.set_linewidth(max(1.0, line.get_linewidth()))  # the colour of a thin one is lost


def _common_time(axes: NDArray[Any]) -> None:
    """Give all panels the time range of the data drawn; number it on the last one only."""
    drawn = [line.get_xdata() for ax in axes for line in ax.get_lines()]
    for ax in axes:
        if drawn:
            ax.set_xlim(min(np.min(x) for x in drawn), max(np.max(x) for x in drawn))
        else:
            ax.set_xticks([])
        if ax is not axes[-1]:
            ax.tick_params(labelbottom=False)


def _plain_log_ticks(ax: Axes) -> None:
    """Number 1 and 3 of each decade: wall times often stay within one decade."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    ax.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    ax.yaxis.set_minor_formatter(NullFormatter())


def _status(data: xr.DataTree) -> tuple[str, str]:
    """Return the run's status as text and its colour; the store may hold it as JSON."""
    held: Any = data.attrs.get("status", "")
    if isinstance(held, str):
        try:
            held = json.loads(held)
        except json.JSONDecodeError:
            return held, theme().ink
    try:
        status = Status.from_dict(held)
    except (AttributeError, TypeError):
        return str(held), theme().ink
    return str(status), theme().alarm if status.code in ("failed", "interrupted") else theme().ink
