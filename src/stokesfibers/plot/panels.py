"""Centreline shapes of a stored run, one small panel per time (the paper's Figs. 2-4)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stokesfibers.plot import select
from stokesfibers.plot.case import offset, periods
from stokesfibers.plot.geometry import wrapped
from stokesfibers.plot.shapes import axis_labels, centrelines, follow, joined, limits
from stokesfibers.plot.style import COLUMN, PAGE, new_panels, style
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

_ACROSS, _ACROSS_WIDE = 8, 4  # most panels in a row
_LOWEST = 1.2  # inches, so that the label beside low panels is whole
_WIDE = 0.6  # height over width below which a panel is wide
_NARROW = 1.2  # width in inches below which there is room for two or three numbers
_SMALL = 6.5  # points, of numbers in narrow panels
_PAD = 0.07  # inches beside wide panels, whose numbers may stand at their very ends
_PLAIN = (1e-3, 1e4)  # ends of axes that are written without a power of ten


def shape_panels(
    data: xr.DataTree, *, times: ArrayLike | None = None, plane: str = "xy"
) -> NDArray[Any]:
    """Draw one small panel per time, all to the same scale, as the paper's Figs. 2-4.

    Up to eight fibers have a colour each. In a periodic cell, whose outline is drawn as sheared
    as it is, fibers are shown whole with their middles in the cell. In free space, where fibers
    go so far that no shape could be seen, each panel is drawn about their own centre, and the axes
    say so.

    Parameters
    ----------
    data
        The stored run.
    times
        Times to draw; the nearest stored record stands for each and its time is the title.
        Default: as `shapes`.
    plane
        The two directions to draw, horizontal first.

    Returns
    -------
    ndarray of Axes : (panel,)

    Raises
    ------
    InputError
        If a time lies outside the stored range, or a direction does not exist.
    """
    directions = select.plane_directions(plane)[:2]
    chosen = select.choose(data, times)
    whole, outlines = _in_cell(data, chosen, directions)
    points = whole[..., directions]
    follows = not outlines and follow(points)
    box = limits(np.concatenate([points.reshape(-1, 2), *outlines]))
    grid = _grid(len(chosen.times), box)
    axes = grid.ravel()
    with style():
        for number, (ax, time) in enumerate(zip(axes, chosen.times, strict=False)):
            for line in outlines[number : number + 1]:
                ax.plot(*line.T, color=theme().faint, linewidth=0.6, zorder=0, clip_on=False)
            _draw(ax, points[number])
            ax.set_aspect("equal", adjustable="box")
            ax.set_title(select.at_time(data, time))
        _number(grid, box)
        for spare in axes[len(chosen.times) :]:
            spare.remove()
        across, up = axis_labels(data, plane, follows=follows)
        axes[0].figure.supxlabel(across, fontsize=8.5)
        if len(grid) == 1:
            axes[0].set_ylabel(up)
        else:
            axes[0].figure.supylabel(up, fontsize=8.5)
    return axes[: len(chosen.times)]


def _in_cell(
    data: xr.DataTree, chosen: select.Chosen, directions: list[int]
) -> tuple[Floats, list[Floats]]:
    """Return fibers (record, fiber, node, 3) and the cell's outlines, (5, 2), if there is one."""
    points, lengths = centrelines(data, chosen.records), periods(data)
    if not np.any(lengths[directions] > 0.0):
        return points, []
    slides = [offset(data, float(time)) for time in chosen.times]
    for number, slid in enumerate(slides):
        points[number] = wrapped(points[number], lengths, slid)
    slanted = set(directions) == {0, 1}
    if not slanted:  # seen along the slant: images along x bring fibers into an upright box
        rest = np.where(np.arange(3) == 1, 0.0, lengths)
        points = np.stack([wrapped(record, rest) for record in points])
    every = points.reshape(-1, 3)
    low = np.where(lengths > 0.0, 0.0, np.nanmin(every, axis=0))[directions]
    high = np.where(lengths > 0.0, lengths, np.nanmax(every, axis=0))[directions]
    corners = low + np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) * (high - low)
    outlines = []
    for slid in slides:
        outline = corners.copy()
        if slanted and slid:
            across, up = directions.index(0), directions.index(1)
            outline[:, across] += slid * corners[:, up] / lengths[1]
        outlines.append(outline)
    return points, outlines


def _draw(ax: Axes, points: Floats) -> None:
    """Draw the fibers (fiber, node, 2) of one record: few in a colour each, many in one."""
    if len(points) > select.MOST_FIBERS:
        ax.plot(*joined(points), color=theme().palette[0], linewidth=0.6, clip_on=False)
        return
    for line, colour in zip(points, theme().palette, strict=False):
        ax.plot(line[:, 0], line[:, 1], color=colour, clip_on=False)


def _grid(count: int, box: Floats) -> NDArray[Any]:
    """Return axes (row, column) for `count` panels that show the box to one scale."""
    ratio = (box[1, 1] - box[1, 0]) / (box[0, 1] - box[0, 0])
    rows = -(-count // (_ACROSS_WIDE if ratio < _WIDE else _ACROSS))
    columns = -(-count // rows)
    width = COLUMN if columns <= 3 else PAGE
    height = max(rows * (min(ratio * (width - 0.5) / columns, 3.0) + 0.2) + 0.4, _LOWEST)
    return new_panels(rows, columns, width=width, height=height, shared_scale=True)


def _number(grid: NDArray[Any], box: Floats) -> None:
    """Set limits and ticks, which all panels share: few and short numbers, alike on both axes."""
    ax = grid[0, 0]
    ax.set(xlim=box[0], ylim=box[1])
    narrow = ax.figure.get_figwidth() / grid.shape[1] < _NARROW
    ax.locator_params(nbins=2 if narrow else 3, min_n_ticks=2)
    if not narrow:
        ax.figure.get_layout_engine().set(w_pad=_PAD)
    for one in grid.flat if narrow else ():
        one.tick_params(labelsize=_SMALL)
    if _PLAIN[0] <= np.abs(box).max() <= _PLAIN[1]:
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter("{x:g}")  # narrow panels: 0, not 0.00
