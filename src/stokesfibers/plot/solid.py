"""The parts of a picture in perspective: view, cell, labels of its edges, and fibers.

They take plain arrays, so that snapshots and movies share them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.plot.geometry import slanted
from stokesfibers.plot.style import style
from stokesfibers.plot.theme import theme

Floats = NDArray[np.float64]

ELEVATION, AZIMUTH = 16.0, 24.0
"""Of the view, in degrees: x to the right, y up, a little from above and from the right."""
_LINE, _HALO = 1.9, 3.4  # widths in points
# How far behind its line lies the rim that parts crossing fibers, of the whole depth; far
# enough that it hides no neighbour on a fiber seen from its end.
_BEHIND = 0.15
_DIRECTIONS = np.array([d for d in product(range(-2, 3), repeat=3) if any(d)], dtype=np.float64)
_TEXT = 7.5
_WORD = 8.5 * _TEXT  # width in points of the longest label, with some air


@dataclass(frozen=True)
class Cell:
    """The box that is drawn.

    Attributes
    ----------
    box : (3, 2)
        Limits: the cell where periodic, what the fibers fill where free.
    lengths : (3,)
        Periods, 0 in free directions.
    slant
        Displacement along x over height in y.
    """

    box: Floats
    lengths: Floats
    slant: float = 0.0

    def corners(self) -> Floats:
        """Return the eight corners, slanted, (8, 3)."""
        return slanted(np.array(list(product(*self.box))), self.slant)


def cell_of(points: Floats, lengths: Floats, slant: float = 0.0) -> Cell:
    """Return the cell where periodic, and around `points` (..., 3) where free."""
    every = tuple(range(points.ndim - 1))
    low, high = points.min(axis=every), points.max(axis=every)
    least = 0.3 * max(float(np.max(high - low)), float(np.max(lengths)))
    centre, half = 0.5 * (low + high), 0.5 * np.maximum(high - low, least or 1.0)
    periodic = lengths > 0.0
    first = np.where(periodic, 0.0, centre - half)
    last = np.where(periodic, lengths, centre + half)
    return Cell(np.stack([first, last], axis=1), lengths, slant)


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
            look(solid)
    return panels


def look(solid: Any, azimuth: float = AZIMUTH) -> None:
    """Set the direction of view; the azimuth in degrees grows as the camera goes to the right."""
    solid.set_proj_type("persp", focal_length=1.2)
    solid.view_init(elev=ELEVATION, azim=azimuth, vertical_axis="y")


def fit(
    solid: Any, low: Floats, high: Floats, *, margin: bool = True, shown: Floats | None = None
) -> float:
    """Show what lies between two corners (3,), with equal scales, as large as labels allow.

    Returns the zoom.

    Parameters
    ----------
    solid
        The axes.
    low, high : (3,)
    margin
        Leave room for the labels of the edges, which are as large whatever the axes' size is.
    shown : (n, 3)
        Points that are to be seen; default the corners of the box, which may be far from them.
    """
    corners = np.array(list(product(*np.stack([low, high], axis=1)))) if shown is None else shown
    solid.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    solid.set_box_aspect(high - low, zoom=1.0)
    # matplotlib makes the axes square; what is drawn may reach out of them, up to their panel
    panel = solid.get_position(original=True).size * solid.figure.get_size_inches() * 72.0
    words = np.array([_WORD, 3.0 * _TEXT]) if margin else np.zeros(2)
    half = np.maximum(0.5 * panel - words, 0.2 * panel)
    seen = seen_at(solid, corners) - 0.5
    zoom = float(np.min(half / (np.abs(seen).max(axis=0) * panel.min())))
    # perspective: what comes nearer grows more than in proportion
    solid.set_box_aspect(high - low, zoom=zoom)
    seen = seen_at(solid, corners) - 0.5
    zoom *= float(np.min(half / (np.abs(seen).max(axis=0) * panel.min())))
    solid.set_box_aspect(high - low, zoom=zoom)
    solid.set_axis_off()
    solid.computed_zorder = False  # the box stays behind the fibers, whatever the view
    return zoom


def outermost(points: Floats) -> Floats:
    """Return the points (n, 3) that lie farthest in one of many directions."""
    far = np.unique(np.argmax(points @ _DIRECTIONS.T, axis=0))
    return points[far]


def on_page(solid: Any, box: Floats) -> Floats:
    """Return the corners of a box (3, 2) in units of the axes' width and height, (8, 2)."""
    return seen_at(solid, np.array(list(product(*box))))


def seen_at(solid: Any, points: Floats) -> Floats:
    """Return where points (..., 3) are seen, in units of the axes' width and height, (..., 2)."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    x, y, z = points.reshape(-1, 3).T
    across, up, _ = proj_transform(x, y, z, solid.get_proj())
    to_axes = solid.transData - solid.transAxes
    flat = to_axes.transform(np.stack([across, up], axis=1))
    return flat.reshape(*points.shape[:-1], 2)


def keep_whole(solid: Any, points: Floats) -> None:
    """Let a figure that is saved reach around `points` (n, 3): it sees nothing solid by itself."""
    from matplotlib.lines import Line2D

    seen = seen_at(solid, points)
    wide = _HALO * solid.figure.dpi / 72.0 / np.asarray(solid.bbox.size)  # of a line's end
    ends = np.stack([seen.min(axis=0) - wide, seen.max(axis=0) + wide])
    frame = Line2D(*ends.T, alpha=0.0, clip_on=False, transform=solid.transAxes)
    solid.add_artist(frame)


def draw_cell(solid: Any, cell: Cell) -> list[Any]:
    """Draw the edges, and the faces across periodic directions shaded; return what was drawn."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    corners = np.array(list(product(*cell.box)))
    edges = [(a, b) for a, b in combinations(corners, 2) if np.count_nonzero(a != b) == 1]
    lines = Line3DCollection(
        slanted(np.array(edges), cell.slant), colors=theme().faint, linewidths=0.5, clip_on=False
    )
    drawn: list[Any] = [lines]
    for direction in np.flatnonzero(cell.lengths > 0.0):
        first, second = (d for d in range(3) if d != direction)
        for side in cell.box[direction]:
            face = np.empty((4, 3))
            face[:, direction] = side
            face[:, first] = cell.box[first][[0, 1, 1, 0]]
            face[:, second] = cell.box[second][[0, 0, 1, 1]]
            shade = Poly3DCollection(
                [slanted(face, cell.slant)],
                facecolors=theme().ink,
                alpha=0.05,
                linewidths=0.0,
                clip_on=False,
            )
            drawn.append(shade)
    for part in drawn:
        part.set_zorder(1)
        solid.add_collection3d(part, autolim=False)
    return drawn


def label_edges(solid: Any, cell: Cell, unit: str) -> list[Any]:
    """Write each direction, its unit and limits beside one edge of the box; return the texts."""
    written = []
    box = cell.box
    centre = box.mean(axis=1)
    gap = 0.06 * float(np.max(box[:, 1] - box[:, 0]))
    # Below the front lower edge, left of the left front edge, beside the right lower edge.
    low, high = box[:, 0], box[:, 1]
    places = (
        (centre[0], low[1] - 1.4 * gap, high[2] + gap),
        (low[0] - 0.6 * gap, centre[1], high[2]),
        (high[0] + 0.4 * gap, low[1] - gap, centre[2]),
    )
    for direction, place in enumerate(places):
        end = ("center", "right", "left")[direction]
        word = " (period)" if cell.lengths[direction] > 0.0 else ""
        text = f"${'xyz'[direction]}${unit}\n{_from_to(*box[direction])}{word}"
        x, y = seen_at(solid, slanted(np.array(place), cell.slant))
        # flat text: saving a figure cuts off what it does not see, and it sees no solid text
        # over its own ground: a fiber may reach out of the cell there
        ground = {"facecolor": theme().ground, "alpha": 0.75, "linewidth": 0.0, "pad": 0.5}
        look = {"ha": end, "va": "center", "fontsize": _TEXT, "color": theme().ink, "bbox": ground}
        written.append(solid.text2D(x, y, text, transform=solid.transAxes, **look))
    return written


def _from_to(low: float, high: float) -> str:
    """Return two limits with as many digits as tell them apart well."""
    span = high - low
    if 1e-3 <= span < 1e5:
        digits = max(0, 2 - int(np.floor(np.log10(span))))
        words = [f"{v + 0.0:.{digits}f}" for v in np.round([low, high], digits)]
        words = [w.rstrip("0").rstrip(".") if digits else w for w in words]
    else:
        words = [f"{v:.3g}" for v in (low, high)]
    return " to ".join(words).replace("-", "−")


def draw_fibers(solid: Any, points: Floats, colours: Floats | None, scale: float = 1.0) -> Any:
    """Draw the segments from back to front, each with a rim in the ground's colour behind it.

    Parameters
    ----------
    solid
        The axes.
    points : (fiber, node, 3)
    colours : (fiber * (node - 1), 4)
        Of the segments; None for one colour.
    scale
        Factor on the lines' widths.
    """
    from matplotlib.colors import to_rgba
    from mpl_toolkits.mplot3d.art3d import Line3DCollection
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    segments = np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 3)
    if colours is None:
        colours = np.tile(to_rgba(theme().palette[0]), (len(segments), 1))
    x, y, z = segments.mean(axis=1).T
    depth = np.asarray(proj_transform(x, y, z, solid.get_proj())[2])
    keys = np.concatenate([depth + _BEHIND * np.ptp(depth), depth])
    back_to_front = np.argsort(-keys, kind="stable")
    widths = np.repeat([scale * _HALO, scale * _LINE], len(segments))
    rims = np.tile(to_rgba(theme().ground), (len(segments), 1))
    lines = Line3DCollection(
        np.concatenate([segments, segments])[back_to_front],
        colors=np.concatenate([rims, colours])[back_to_front],
        linewidths=widths[back_to_front],
        capstyle="round",
        clip_on=False,
    )
    lines.set_zorder(2)
    solid.add_collection3d(lines, autolim=False)
    return lines
