"""A snapshot of all fibers in three dimensions, in their periodic cell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import Variable
from stokesfibers.plot import select
from stokesfibers.plot.case import offset, periods
from stokesfibers.plot.geometry import curvature, slanted, wrapped
from stokesfibers.plot.style import FAINT, INK, PAGE, PALETTE, style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable

Floats = NDArray[np.float64]

_ELEVATION, _AZIMUTH = 16.0, 24.0
_FILLED = 0.46  # half the width that the corners take of the axes' own
_LINE, _HALO = 1.9, 3.4  # widths in points
# How far behind its line lies the white rim that parts crossing fibers, of the whole depth; far
# enough that it hides no neighbour on a fiber seen from its end.
_BEHIND = 0.15
_COMPRESSED_TO_STRETCHED = ("#08408A", "#3C8CCB", "#B9B9B9", "#E8743B", "#A31A0E")


@dataclass(frozen=True)
class _Scale:
    """What the colour shows: values at the nodes (fiber, node), their map, and their label."""

    values: Floats
    mappable: ScalarMappable
    label: str


def perspective(
    data: xr.DataTree,
    *,
    time: float | None = None,
    colour: Literal["tension", "curvature"] | None = "tension",
    ax: Axes | None = None,
) -> Axes:
    """Draw all fibers at one time in perspective: x to the right, y up, with equal scales.

    Fibers are shown whole, each shifted by periods so that its middle node lies in the cell, which
    starts at 0 and is drawn as sheared as it is. The box is the cell in periodic directions, whose
    faces are shaded, and what the fibers fill in free ones. Its edges are labelled with their
    lengths. What lies in front is found for the present direction of view.

    Parameters
    ----------
    data
        The stored run.
    time
        Time to draw; the nearest stored record stands for it. Default: the last.
    colour
        What the colour shows: the line tension T, in a map centred at 0 (negative, blue:
        compressed); the curvature, by finite differences of the positions; None for one colour.
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
    stored = select.numbers(data, "trajectory", "time")
    record = int(select.pick_records(data, [stored[-1] if time is None else time])[0])
    position = _positions(data, record)
    lengths = periods(data)
    slid = offset(data, float(stored[record]))
    points = wrapped(position, lengths, slid)
    box = _box(points, lengths)
    slant = slid / lengths[1] if slid else 0.0
    scale = _scale(data, record, position, colour)
    if ax is None:
        ax = _new_axes_3d(box)
    elif ax.name != "3d":
        raise InputError("ax", 'axes with projection="3d"', f"axes with projection {ax.name!r}")
    unit = select.unit_text(select.describe(data, "trajectory", "position"))
    symbol = select.describe(data, "trajectory", "time").symbol
    with style():
        _set_view(ax, points, box, slant)
        _draw_box(ax, box, lengths, slant)
        _label_edges(ax, box, lengths, unit=unit, slant=slant)
        _draw_fibers(ax, points, scale)
        _add_key(ax, box, scale, f"${symbol} = {stored[record]:.6g}$")
    return ax


def _positions(data: xr.DataTree, record: int) -> Floats:
    array = select.read(data, "trajectory", "position").isel(time=record)
    position = select.values(array.transpose("fiber", "node", "space"))
    if not np.isfinite(position).all():
        raise InputError("trajectory.position", "finite positions", "others in this record")
    return position


def _set_view(solid: Any, points: Floats, box: Floats, slant: float) -> None:
    """Show the box and whole fibers, which may reach out of it, with equal scales."""
    corners = slanted(np.array(list(product(*box))), slant)
    low = np.minimum(corners.min(axis=0), points.min(axis=(0, 1)))
    high = np.maximum(corners.max(axis=0), points.max(axis=(0, 1)))
    solid.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    _fit(solid, low, high)
    solid.set_axis_off()
    solid.computed_zorder = False  # the box stays behind the fibers, whatever the view


def _add_key(solid: Any, box: Floats, scale: _Scale | None, title: str) -> None:
    """Add the title and, if there is a scale, its colour bar."""
    height = _title_height(solid, box)
    solid.text2D(0.5, height, title, ha="center", transform=solid.transAxes)
    if scale is not None:
        bar = solid.figure.colorbar(
            scale.mappable, ax=solid, shrink=0.5, aspect=22, pad=0.06, fraction=0.05
        )
        bar.set_label(scale.label)
        bar.outline.set_linewidth(0.4)


def _scale(data: xr.DataTree, record: int, position: Floats, colour: str | None) -> _Scale | None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    if colour is None:
        return None
    if colour == "tension":
        array = select.read(data, "trajectory", "tension").isel(time=record)
        values = select.values(array.transpose("fiber", "node"))
        most = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
        colours = LinearSegmentedColormap.from_list("tension", _COMPRESSED_TO_STRETCHED)
        label = select.axis_label(select.describe(data, "trajectory", "tension"))
        return _Scale(values, ScalarMappable(Normalize(-most, most), colours), label)
    if colour == "curvature":
        values = curvature(position)
        most = float(np.max(values, initial=0.0)) or 1.0
        colours = _seen_on_white()
        largest = select.describe(data, "observables", "largest_curvature")
        label = select.axis_label(_local(largest))
        return _Scale(values, ScalarMappable(Normalize(0.0, most), colours), label)
    raise InputError("colour", '"tension", "curvature" or None', colour)


def _local(largest: Variable) -> Variable:
    """Return the curvature along a fiber, with the unit of the largest one."""
    return replace(largest, name="curvature", symbol=r"\kappa", meaning="curvature")


def _seen_on_white() -> Any:
    """Return viridis from light to dark, without the lightest part: bends stand out."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps["viridis_r"](np.linspace(0.12, 1.0, 256)))


def _box(points: Floats, lengths: Floats) -> Floats:
    """Return the limits (3, 2): the cell where periodic, what the fibers fill where free."""
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    least = 0.3 * max(float(np.max(high - low)), float(np.max(lengths)))
    centre, half = 0.5 * (low + high), 0.5 * np.maximum(high - low, least or 1.0)
    periodic = lengths > 0.0
    return np.stack(
        [np.where(periodic, 0.0, centre - half), np.where(periodic, lengths, centre + half)], axis=1
    )


def solid_panels(count: int, *, width: float, height: float) -> list[Any]:
    """Return three-dimensional axes side by side on one new figure, seen as `perspective` does.

    Parameters
    ----------
    count
        Number of panels.
    width, height
        Size of the figure in inches.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with style():
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        panels: list[Any] = [
            figure.add_subplot(1, count, k + 1, projection="3d") for k in range(count)
        ]
        for solid in panels:
            solid.set_proj_type("persp", focal_length=1.2)
            solid.view_init(elev=_ELEVATION, azim=_AZIMUTH, vertical_axis="y")
    return panels


def _new_axes_3d(box: Floats) -> Axes:
    span = box[:, 1] - box[:, 0]
    height = float(np.clip(PAGE * 0.8 * (span[1] + 0.35 * span[2]) / (span[0] + span[2]), 2.6, 5.5))
    return solid_panels(1, width=0.8 * PAGE, height=height)[0]


def _fit(solid: Any, low: Floats, high: Floats) -> None:
    """Give the axes equal scales, and the size that leaves a margin for the labels."""
    solid.set_box_aspect(high - low, zoom=1.0)
    seen = _on_page(solid, np.stack([low, high], axis=1))
    solid.set_box_aspect(high - low, zoom=_FILLED / float(np.max(np.abs(seen - 0.5))))


def _title_height(solid: Any, box: Floats) -> float:
    return float(np.max(_on_page(solid, box)[:, 1])) + 0.04


def _on_page(solid: Any, box: Floats) -> Floats:
    """Return the corners of a box in units of the axes' width and height, (8, 2)."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    x, y, z = np.array(list(product(*box))).T
    across, up, _ = proj_transform(x, y, z, solid.get_proj())
    to_axes = solid.transData - solid.transAxes
    return to_axes.transform(np.stack([across, up], axis=1))


def _draw_box(solid: Any, box: Floats, lengths: Floats, slant: float) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    corners = np.array(list(product(*box)))
    edges = [(a, b) for a, b in combinations(corners, 2) if np.count_nonzero(a != b) == 1]
    lines = Line3DCollection(slanted(np.array(edges), slant), colors=FAINT, linewidths=0.5)
    lines.set_zorder(1)
    solid.add_collection3d(lines)
    for direction in np.flatnonzero(lengths > 0.0):
        first, second = (d for d in range(3) if d != direction)
        for side in box[direction]:
            face = np.empty((4, 3))
            face[:, direction] = side
            face[:, first] = box[first][[0, 1, 1, 0]]
            face[:, second] = box[second][[0, 0, 1, 1]]
            shade = Poly3DCollection(
                [slanted(face, slant)], facecolors=INK, alpha=0.05, linewidths=0.0
            )
            shade.set_zorder(1)
            solid.add_collection3d(shade)


def _label_edges(solid: Any, box: Floats, lengths: Floats, *, unit: str, slant: float) -> None:
    """Write each direction and its extent beside one edge of the box."""
    span, centre = box[:, 1] - box[:, 0], box.mean(axis=1)
    gap = 0.06 * float(np.max(span))
    # Below the front lower edge, above the left front edge, beside the right lower edge.
    low, high = box[:, 0], box[:, 1]
    places = (
        (centre[0], low[1] - 1.4 * gap, high[2] + gap),
        (low[0] - gap, high[1] + 2.0 * gap, high[2]),
        (high[0] + 0.4 * gap, low[1] - gap, centre[2]),
    )
    for direction, place in enumerate(places):
        word = "period" if lengths[direction] > 0.0 else "extent"
        end = ("center", "center", "left")[direction]
        text = f"${'xyz'[direction]}$, {word}\n{span[direction]:.3g}{unit}"
        solid.text(*slanted(np.array(place), slant), text, ha=end, va="center", fontsize=7.5)


def _draw_fibers(solid: Any, points: Floats, scale: _Scale | None) -> None:
    """Draw the segments from back to front, each with a white rim a little behind it."""
    from matplotlib.colors import to_rgba
    from mpl_toolkits.mplot3d.art3d import Line3DCollection
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    segments = np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 3)
    if scale is None:
        colours = np.tile(to_rgba(PALETTE[0]), (len(segments), 1))
    else:
        middle = 0.5 * (scale.values[:, :-1] + scale.values[:, 1:])
        colours = scale.mappable.to_rgba(middle.ravel())
    x, y, z = segments.mean(axis=1).T
    depth = np.asarray(proj_transform(x, y, z, solid.get_proj())[2])
    keys = np.concatenate([depth + _BEHIND * np.ptp(depth), depth])
    back_to_front = np.argsort(-keys, kind="stable")
    widths = np.repeat([_HALO, _LINE], len(segments))
    white = np.ones_like(colours)
    lines = Line3DCollection(
        np.concatenate([segments, segments])[back_to_front],
        colors=np.concatenate([white, colours])[back_to_front],
        linewidths=widths[back_to_front],
        capstyle="round",
    )
    lines.set_zorder(2)
    solid.add_collection3d(lines, autolim=False)
