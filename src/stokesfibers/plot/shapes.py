"""Centreline shapes of a stored run over one another, coloured by time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.style import COLUMN, colour_bar, drawing, time_colours
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_LEGEND_ROWS = 10  # more times than this get a colour bar instead of a legend
_FEW = 3  # fibers drawn by themselves of many
_DRIFT = 4.0  # paths this many times as long as what moves along them hide its shape


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

    One line per time holds all its fibers, separated by NaN. Where they go so far, as falling
    fibers do, that no shape could be seen, each time is drawn about the fibers' own centre, and
    the axes say so.

    Parameters
    ----------
    data
        The stored run.
    times
        Times to draw; the nearest stored record stands for each. Default: up to 8 records where
        the elastic energy is largest, or spread over the run if fibers are bent from the start
        or not at all.
    fibers
        Numbers of the fibers to draw; default all of up to 8, and the first 3 of more, which over
        one another could not be told apart.
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
    fibers, title = _few(data, fibers)
    points = centrelines(data, chosen.records, fibers)[..., select.plane_directions(plane)[:2]]
    follows = follow(points)
    points[..., 0] += offset * np.arange(len(points))[:, None, None]
    box = limits(points)
    colours = time_colours(chosen.times)
    with drawing(ax, height=_height(box)) as ax:
        for line, time, colour in zip(points, chosen.times, colours, strict=True):
            ax.plot(*joined(line), color=colour, label=select.number_text(time), clip_on=False)
        ax.set_aspect("equal", adjustable="box")
        ax.set(xlim=box[0], ylim=box[1])
        across, up = axis_labels(data, plane, follows=follows)
        moved = f", each record moved by {offset:.3g}" if offset else ""
        ax.set(xlabel=f"{across}{moved}", ylabel=up)
        ax.set_title(title, loc="left")
        time_key(ax, data, chosen.times)
    return ax


def _few(
    data: xr.DataTree, fibers: Sequence[int] | int | None
) -> tuple[Sequence[int] | int | None, str]:
    """Return the fibers to draw over one another, and what to say if these are not all."""
    count = select.read(data, "trajectory", "position").sizes["fiber"]
    if fibers is not None or count <= select.MOST_FIBERS:
        return fibers, ""
    return range(_FEW), f"fibers 0 to {_FEW - 1} of {count}"


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


def centrelines(
    data: xr.DataTree, records: select.Records, fibers: Sequence[int] | int | None = None
) -> NDArray[np.float64]:
    """Return a copy of the chosen positions: (record, fiber, node, 3)."""
    position = select.read(data, "trajectory", "position")
    picked = select.pick_fibers(position.sizes["fiber"], fibers)
    # One selection at a time: lazily indexed arrays take no two lists at once as a block.
    chosen = position.isel(time=records).isel(fiber=picked)
    return np.array(chosen.transpose("time", "fiber", "node", "space").to_numpy(), np.float64)


def follow(points: NDArray[np.float64]) -> bool:
    """Move each record (record, fiber, node, 2) to its centre if its path hides its shape.

    Returns whether they were moved.
    """
    # fmax and fmin pass over what is not finite, a whole record of it too
    low, high = np.fmin.reduce(points, axis=(1, 2)), np.fmax.reduce(points, axis=(1, 2))
    path = np.fmax.reduce(high) - np.fmin.reduce(low)
    far = bool(np.max(path) > _DRIFT * np.fmax.reduce(high - low, axis=None))
    if far:
        known = np.isfinite(points).sum(axis=(1, 2), keepdims=True)
        points -= np.nansum(points, axis=(1, 2), keepdims=True) / np.maximum(known, 1)
    return far


def axis_labels(data: xr.DataTree, plane: str, *, follows: bool) -> tuple[str, str]:
    """Return the labels of both axes; c is the fibers' common centre."""
    unit = select.unit_text(select.describe(data, "trajectory", "position"))
    if not follows:
        return f"${plane[0]}${unit}", f"${plane[1]}${unit}"
    across, up = (f"${d} - {d}_c$" for d in plane)
    return f"{across}{unit}", f"{up}\n{unit.strip()}"  # a low figure has no room for one line


def joined(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x and y of all fibers as one line, broken by NaN between fibers."""
    gap = np.full((points.shape[0], 1, 2), np.nan)
    line = np.concatenate([points, gap], axis=1).reshape(-1, 2)[:-1]
    return line[:, 0], line[:, 1]


def limits(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return limits ((left, right), (bottom, top)) with a margin, never a thin sliver.

    Raises
    ------
    InputError
        If no point (..., 2) is finite.
    """
    if not np.isfinite(points).any():
        raise InputError("trajectory.position", "finite positions", "none in these records")
    every = tuple(range(points.ndim - 1))
    low, high = np.nanmin(points, axis=every), np.nanmax(points, axis=every)
    centre, span = 0.5 * (low + high), high - low
    largest = float(np.max(span)) or 1.0
    half = 0.5 * np.maximum(span, 0.2 * largest) + 0.04 * largest
    return np.stack([centre - half, centre + half], axis=1)


def _height(box: NDArray[np.float64]) -> float:
    """Return the height in inches of a column-wide figure that the equal scales fill."""
    ratio = (box[1, 1] - box[1, 0]) / (box[0, 1] - box[0, 0])
    return float(np.clip(ratio * (COLUMN - 1.2) + 0.45, 1.7, 4.5))
