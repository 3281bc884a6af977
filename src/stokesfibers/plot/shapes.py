"""Centreline shapes of a stored run, overlaid or one panel per time (the paper's Figs. 2-4)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.style import (
    COLUMN,
    PAGE,
    colour_bar,
    drawing,
    new_panels,
    style,
    time_colours,
)
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_LEGEND_ROWS = 10  # more times than this get a colour bar instead of a legend
_ACROSS, _ACROSS_WIDE = 8, 4  # most panels in a row
_WIDE = 0.6  # height over width below which a panel is wide


def shapes(
    data: xr.DataTree,
    *,
    times: ArrayLike | None = None,
    fibers: Sequence[int] | int | None = None,
    plane: str = "xy",
    ax: Axes | None = None,
    offset: float = 0.0,
) -> Axes:
    """Draw centreline shapes over one another, coloured by time, with equal scales.

    One line per time holds all its fibers, separated by NaN.

    Parameters
    ----------
    data
        The stored run.
    times
        Times to draw; the nearest stored record stands for each. Default: up to 8 records where
        the elastic energy is largest, or spread over the run.
    fibers
        Numbers of the fibers to draw; default all.
    plane
        The two directions to draw, horizontal first, e.g. ``"xy"`` or ``"xz"``.
    ax
        Axes to draw on; default those of a new figure.
    offset
        Distance by which each record is moved to the right of the one before it.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If a time lies outside the stored range, or a fiber or direction does not exist.
    """
    chosen = select.choose(data, times)
    points = _points(data, chosen.records, fibers, plane)
    points[..., 0] += offset * np.arange(len(points))[:, None, None]
    box = _box(points)
    colours = time_colours(chosen.times)
    with drawing(ax, height=_height(box)) as ax:
        for line, time, colour in zip(points, chosen.times, colours, strict=True):
            ax.plot(*_joined(line), color=colour, label=f"{time:.6g}", clip_on=False)
        ax.set_aspect("equal", adjustable="box")
        ax.set(xlim=box[0], ylim=box[1])
        unit = select.unit_text(select.describe(data, "trajectory", "position"))
        moved = f", each record moved by {offset:.3g}" if offset else ""
        ax.set(xlabel=f"${plane[0]}${unit}{moved}", ylabel=f"${plane[1]}${unit}")
        time_key(ax, data, chosen.times)
    return ax


def shape_panels(
    data: xr.DataTree, *, times: ArrayLike | None = None, plane: str = "xy"
) -> NDArray[Any]:
    """Draw one small panel per time, all to the same scale, as the paper's Figs. 2-4.

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
    chosen = select.choose(data, times)
    points = _points(data, chosen.records, None, plane)
    box = _box(points)
    ratio = (box[1, 1] - box[1, 0]) / (box[0, 1] - box[0, 0])
    rows = -(-len(chosen.times) // (_ACROSS_WIDE if ratio < _WIDE else _ACROSS))
    columns = -(-len(chosen.times) // rows)
    width = COLUMN if columns <= 3 else PAGE
    height = rows * (min(ratio * (width - 0.5) / columns, 3.0) + 0.2) + 0.4
    grid = new_panels(rows, columns, width=width, height=height, shared_scale=True)
    axes = grid.ravel()
    with style():
        for ax, line, time in zip(axes, points, chosen.times, strict=False):
            ax.plot(*_joined(line), color=theme().palette[0], clip_on=False)
            ax.set_aspect("equal", adjustable="box")
            ax.set_title(select.at_time(data, time))
            ax.locator_params(nbins=3, min_n_ticks=2)
            ax.xaxis.set_major_formatter("{x:g}")  # narrow panels: 0, not 0.00
        axes[0].set(xlim=box[0], ylim=box[1])
        for spare in axes[len(chosen.times) :]:
            spare.remove()
        unit = select.unit_text(select.describe(data, "trajectory", "position"))
        grid[0, 0].figure.supxlabel(f"${plane[0]}${unit}", fontsize=8.5)
        for ax in grid[:, 0]:
            ax.set_ylabel(f"${plane[1]}${unit}")
    return axes[: len(chosen.times)]


def time_key(ax: Axes, data: xr.DataTree, times: NDArray[np.float64]) -> None:
    """Say which colour is which time: a legend beside the axes, or a colour bar if many."""
    if len(times) <= _LEGEND_ROWS:
        ax.legend(
            title=select.time_label(data),
            loc="upper left",
            bbox_to_anchor=(1.02, 1.0),
            alignment="left",
        )
        return
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    scale = Normalize(float(np.min(times)), float(np.max(times)))
    colours = theme().map_of(theme().passing)
    colour_bar(ax, ScalarMappable(scale, colours), select.time_label(data))


def _points(
    data: xr.DataTree, records: select.Records, fibers: Sequence[int] | int | None, plane: str
) -> NDArray[np.float64]:
    """Return a copy of the chosen positions: (record, fiber, node, 2)."""
    position = select.read(data, "trajectory", "position")
    space = select.plane_directions(plane)[:2]
    picked = select.pick_fibers(position.sizes["fiber"], fibers)
    # One selection at a time: lazily indexed arrays take no two lists at once as a block.
    chosen = position.isel(time=records).isel(fiber=picked).isel(space=space)
    return np.array(chosen.transpose("time", "fiber", "node", "space").to_numpy(), np.float64)


def _joined(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x and y of all fibers as one line, broken by NaN between fibers."""
    gap = np.full((points.shape[0], 1, 2), np.nan)
    line = np.concatenate([points, gap], axis=1).reshape(-1, 2)[:-1]
    return line[:, 0], line[:, 1]


def _box(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return limits ((left, right), (bottom, top)) with a margin, never a thin sliver."""
    if not np.isfinite(points).any():
        raise InputError("trajectory.position", "finite positions", "none in these records")
    low = np.nanmin(points, axis=(0, 1, 2))
    high = np.nanmax(points, axis=(0, 1, 2))
    centre, span = 0.5 * (low + high), high - low
    largest = float(np.max(span)) or 1.0
    half = 0.5 * np.maximum(span, 0.2 * largest) + 0.04 * largest
    return np.stack([centre - half, centre + half], axis=1)


def _height(box: NDArray[np.float64]) -> float:
    """Return the height in inches of a column-wide figure that the equal scales fill."""
    ratio = (box[1, 1] - box[1, 0]) / (box[0, 1] - box[0, 0])
    return float(np.clip(ratio * (COLUMN - 1.2) + 0.45, 1.7, 4.5))
