"""Line tension along a fiber at several times (the paper's Fig. 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from stokesfibers.plot import select
from stokesfibers.plot.shapes import time_key
from stokesfibers.plot.style import drawing, time_colours
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def tension(
    data: xr.DataTree,
    *,
    times: ArrayLike | None = None,
    fiber: int = 0,
    ax: Axes | None = None,
) -> Axes:
    """Draw the line tension T(s) of one fiber at several times.

    A negative tension resists compression, a positive one extension (the paper's (44)).

    Parameters
    ----------
    data
        The stored run.
    times
        Times to draw; the nearest stored record stands for each. Default: as `shapes`.
    fiber
        Number of the fiber.
    ax
        Axes to draw on; default those of a new figure.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If a time lies outside the stored range or the fiber does not exist.
    """
    chosen = select.choose(data, times)
    array = select.read(data, "trajectory", "tension")
    number = int(select.pick_fibers(array.sizes["fiber"], fiber)[0])
    arclength = select.values(select.read(data, "trajectory", "arclength").isel(fiber=number))
    picked = array.isel(fiber=number).isel(time=chosen.records).transpose("time", "node")
    lines, colours = select.values(picked), time_colours(chosen.times)
    with drawing(ax) as ax:
        ax.axhline(0.0, color=theme().faint, linewidth=0.5, zorder=0)
        for line, time, colour in zip(lines, chosen.times, colours, strict=True):
            ax.plot(arclength, line, color=colour, label=select.number_text(time))
        if array.sizes["fiber"] > 1:
            ax.set_title(f"fiber {number}")
        ax.set_xlim(float(arclength[0]), float(arclength[-1]))
        ax.set_xlabel(select.axis_label(select.describe(data, "trajectory", "arclength")))
        ax.set_ylabel(select.axis_label(select.describe(data, "trajectory", "tension")))
        time_key(ax, data, chosen.times)
    return ax
