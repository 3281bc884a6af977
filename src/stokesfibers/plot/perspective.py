"""A snapshot of all fibers in three dimensions, in their periodic cell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stokesfibers.core.errors import InputError
from stokesfibers.plot import paint, select
from stokesfibers.plot.case import offset, periods
from stokesfibers.plot.geometry import wrapped
from stokesfibers.plot.solid import (
    Floats,
    cell_of,
    draw_cell,
    draw_fibers,
    fit,
    keep_whole,
    label_edges,
    on_page,
    solid_panels,
)
from stokesfibers.plot.style import PAGE, colour_bar, style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["perspective", "solid_panels"]


def perspective(
    data: xr.DataTree,
    *,
    time: float | None = None,
    colour: paint.Colour | None = "tension",
    ax: Axes | None = None,
) -> Axes:
    """Draw all fibers at one time in perspective: x to the right, y up, with equal scales.

    Fibers are shown whole, each shifted by periods so that its middle node lies in the cell, which
    starts at 0 and is drawn as sheared as it is. The box is the cell in periodic directions, whose
    faces are shaded, and what the fibers fill in free ones. Its edges are labelled with their
    limits. What lies in front is found for the present direction of view.

    Parameters
    ----------
    data
        The stored run.
    time
        Time to draw; the nearest stored record stands for it. Default: the last.
    colour
        What the colour shows: the line tension T, in a map centred at 0 (negative, blue:
        compressed); the curvature, by finite differences of the positions; the orientation, as
        the angle of each piece to the flow direction x; the fiber; None for one colour.
    ax
        Axes with ``projection="3d"`` to draw on; default those of a new figure.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the time lies outside the stored range, the colour is none of these, the axes are flat
        or the positions are not finite.
    """
    kind = paint.checked(colour)
    record, at = select.snapshot(data, time)
    lengths, slid = periods(data), offset(data, at)
    points = wrapped(select.positions(data, record), lengths, slid)
    cell = cell_of(points, lengths, slid / lengths[1] if slid else 0.0)
    if ax is None:
        ax = _new_axes_3d(cell.box)
    elif ax.name != "3d":
        raise InputError("ax", 'axes with projection="3d"', f"axes with projection {ax.name!r}")
    solid: Any = ax
    unit = select.unit_text(select.describe(data, "trajectory", "position"))
    with style():
        colours = _colours(solid, data, record, kind)
        _settle(solid)
        corners = np.concatenate([cell.corners(), points.reshape(-1, 3)])
        fit(solid, corners.min(axis=0), corners.max(axis=0), shown=corners)
        keep_whole(solid, corners)
        draw_cell(solid, cell)
        label_edges(solid, cell, unit)
        draw_fibers(solid, points, colours)
        top = float(np.max(on_page(solid, cell.box)[:, 1])) + 0.04
        solid.text2D(0.5, top, select.at_time(data, at), ha="center", transform=solid.transAxes)
    return ax


def _colours(
    solid: Any, data: xr.DataTree, record: int, kind: paint.Colour | None
) -> Floats | None:
    """Return the colours of the segments, and add their key."""
    if kind is None:
        return None
    tension = None
    if kind == "tension":
        array = select.read(data, "trajectory", "tension").isel(time=record)
        tension = select.values(array.transpose("fiber", "node"))
    values = paint.node_values(kind, select.positions(data, record), tension)
    painted = paint.paint(data, kind, float(np.nanmax(np.abs(values), initial=0.0)))
    if kind != "fiber":
        key = {"shrink": 0.5, "aspect": 22, "pad": 0.06, "fraction": 0.05}
        colour_bar(solid, painted.mappable(), painted.label, **key)
    return painted.of_segments(values)


def _settle(solid: Any) -> None:
    """Let the colour bar take its room now, before the size is chosen."""
    engine = solid.figure.get_layout_engine()
    if engine is not None:
        engine.execute(solid.figure)


def _new_axes_3d(box: Floats) -> Axes:
    span = box[:, 1] - box[:, 0]
    height = float(np.clip(PAGE * 0.8 * (span[1] + 0.35 * span[2]) / (span[0] + span[2]), 2.6, 5.5))
    return solid_panels(1, width=0.8 * PAGE, height=height)[0]
