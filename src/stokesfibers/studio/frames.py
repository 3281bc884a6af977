"""One frame of a movie: a figure that is made once and then shows one moment after another.

It takes plain arrays only, so that the processes that draw need neither the run nor the solver.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.plot import solid as parts
from stokesfibers.plot.paint import Paint
from stokesfibers.plot.style import ink_ticks, style
from stokesfibers.plot.theme import THEMES, on, theme

Floats = NDArray[np.float64]

_STRIP = 1.3  # height in inches of the series below, with its labels
_BELOW = 0.45  # height in inches of the numbers and the label of a flat picture
_ROOM = 1.0  # side in inches of the picture below which strip or colour bar are left out
_LEFT, _RIGHT, _BAR = 0.75, 0.35, 1.05  # margins in inches; the right one with a colour bar
_TOP = 0.3
_LEAST = 0.5  # side in inches of the smallest picture
_LABELLED = 3.6  # width in inches of a picture in perspective whose edges have labels
_TRIED = 24  # azimuths tried for the size of what the camera goes round
_WIDEST = 2.6  # width in points of a single fiber's line


@dataclass(frozen=True)
class Strip:
    """The series below the picture: all of it, over which a marker moves."""

    time: Floats
    values: Floats
    label: str
    time_label: str


@dataclass(frozen=True)
class Scene:
    """What all frames share.

    Attributes
    ----------
    size
        Width and height in pixels.
    dpi
        Pixels per inch: how large text and lines are.
    ground
        Name of the theme.
    plane
        The two directions of a flat picture, or None for perspective.
    low, high : (3,)
        Limits of what is shown in all frames.
    hull : (n, 3)
        Outermost points of all frames, which are to be seen.
    lengths : (3,)
        Periods, 0 in free directions.
    paint
        What the colours show.
    unit
        Of lengths, as text with a space before it.
    strip
        The series below.
    turns
        Whether the camera moves.
    """

    size: tuple[int, int]
    dpi: int
    ground: str
    plane: str | None
    low: Floats
    high: Floats
    hull: Floats
    lengths: Floats
    paint: Paint | None
    unit: str
    strip: Strip | None
    turns: bool


@dataclass(frozen=True)
class Shot:
    """One moment: whole fibers (fiber, node, 3) in the cell, and the values to colour them by."""

    time: float
    title: str
    points: Floats
    values: Floats | None
    slant: float
    azimuth: float


def most_dpi(size: tuple[int, int]) -> int:
    """Return how many pixels per inch leave a frame some room beside its margins."""
    return int(min(size[0] / (_LEFT + _RIGHT + _LEAST), size[1] / (_BELOW + _TOP + _LEAST)))


def has_room(size: tuple[int, int], dpi: int) -> tuple[bool, bool]:
    """Return whether a frame has room for the series below, and for a colour bar."""
    width, height = size[0] / dpi, size[1] / dpi
    strip = height - _STRIP - _BELOW - _TOP >= _ROOM
    return strip, width - _LEFT - _BAR >= _ROOM


class Stage:
    """Draws the shots of a scene."""

    def __init__(self, scene: Scene) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self._scene = scene
        self._moving: list[Any] = []
        self._zoom, self._labelled = 1.0, False
        inches = (scene.size[0] / scene.dpi, scene.size[1] / scene.dpi)
        with on(THEMES[scene.ground]), style():
            self._figure = Figure(figsize=inches, dpi=scene.dpi)
            self._canvas = FigureCanvasAgg(self._figure)
            self._room = has_room(scene.size, scene.dpi)
            self._marker = self._add_strip(inches) if scene.strip and self._room[0] else None
            self._axes = self._add_axes(inches)
            where = (0.5 * _LEFT / inches[0], 1.0 - 0.5 * _TOP / inches[1])
            self._title = self._figure.text(*where, "", va="center", fontsize=10.0)

    def draw(self, shot: Shot) -> bytes:
        """Return the frame as (height, width, 3) bytes, red green blue."""
        with on(THEMES[self._scene.ground]), style():
            for part in self._moving:
                part.remove()
            self._title.set_text(shot.title)
            draw = self._draw_solid if self._scene.plane is None else self._draw_flat
            self._moving = draw(shot)
            if self._marker is not None and self._scene.strip is not None:
                line, dot = self._marker
                line.set_xdata([shot.time, shot.time])
                strip = self._scene.strip
                dot.set_data([shot.time], [np.interp(shot.time, strip.time, strip.values)])
            self._canvas.draw()
        return np.ascontiguousarray(np.asarray(self._canvas.buffer_rgba())[..., :3]).tobytes()

    def _add_axes(self, inches: tuple[float, float]) -> Any:
        scene = self._scene
        bottom = _STRIP if self._marker else 0.0
        right = _RIGHT
        if scene.paint is not None and scene.paint.kind != "fiber" and self._room[1]:
            right = _BAR
            self._add_bar(scene.paint, inches, bottom)
        if scene.plane is None:
            low = bottom or 0.1
            box = (0.1, low, inches[0] - right - 0.1, inches[1] - low - 0.15)
            self._labelled = not scene.turns and box[2] >= _LABELLED
            axes = self._figure.add_axes(self._box(box), projection="3d")
            axes.patch.set_visible(False)
            self._look(axes)
            return axes
        low = bottom + _BELOW
        box = (_LEFT, low, inches[0] - right - _LEFT, inches[1] - low - _TOP)
        axes = self._figure.add_axes(self._box(box))
        across, up = ("xyz".index(letter) for letter in scene.plane)
        axes.set_aspect("equal", adjustable="box")
        axes.set(xlim=(scene.low[across], scene.high[across]))
        axes.set(ylim=(scene.low[up], scene.high[up]))
        axes.set(xlabel=f"${scene.plane[0]}${scene.unit}", ylabel=f"${scene.plane[1]}${scene.unit}")
        ink_ticks(axes)
        return axes

    def _add_bar(self, paint: Paint, inches: tuple[float, float], bottom: float) -> None:
        height = 0.6 * (inches[1] - bottom - _TOP)
        low = bottom + 0.5 * (inches[1] - bottom - _TOP - height) + 0.1
        axes = self._figure.add_axes(self._box((inches[0] - _BAR + 0.25, low, 0.1, height)))
        bar = self._figure.colorbar(paint.mappable(), cax=axes)
        bar.set_label(paint.label)
        bar.outline.set_linewidth(0.4)  # pyright: ignore[reportCallIssue]
        ink_ticks(axes)
        # the label may be longer than the bar, but never than the picture beside it
        label = axes.yaxis.label
        long = label.get_window_extent(self._canvas.get_renderer()).height / self._scene.dpi
        most = 2.0 * min(low + 0.5 * height - bottom, inches[1] - low - 0.5 * height) - 0.05
        if long > most:
            label.set_fontsize(float(label.get_fontsize()) * most / long)

    def _box(self, inches: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        width, height = self._figure.get_size_inches()
        x, y, dx, dy = inches
        return x / width, y / height, max(dx, 0.1) / width, max(dy, 0.1) / height

    def _look(self, axes: Any) -> None:
        """Choose the size: with a camera that moves, what fits from all sides."""
        scene = self._scene
        zooms = []
        for azimuth in np.linspace(0.0, 360.0, _TRIED, endpoint=False) if scene.turns else [None]:
            parts.look(axes, parts.AZIMUTH if azimuth is None else float(azimuth))
            limits = (scene.low, scene.high)
            zooms.append(parts.fit(axes, *limits, margin=self._labelled, shown=scene.hull))
        self._zoom = min(zooms)

    def _add_strip(self, inches: tuple[float, float]) -> tuple[Any, Any]:
        strip = self._scene.strip
        assert strip is not None
        box = (_LEFT, 0.42, inches[0] - _LEFT - _RIGHT, _STRIP - 0.72)
        axes = self._figure.add_axes(self._box(box))
        axes.plot(strip.time, strip.values, color=theme().palette[0], linewidth=0.9)
        axes.set_title(strip.label, loc="left")
        axes.set_xlabel(strip.time_label)
        axes.margins(x=0.0)
        axes.locator_params(axis="y", nbins=3)
        ink_ticks(axes)
        line = axes.axvline(strip.time[0], color=theme().faint, linewidth=0.7)
        (dot,) = axes.plot([], [], "o", color=theme().palette[1], markersize=4, clip_on=False)
        return line, dot

    def _colours(self, shot: Shot) -> Any:
        paint = self._scene.paint
        return None if paint is None or shot.values is None else paint.of_segments(shot.values)

    def _draw_flat(self, shot: Shot) -> list[Any]:
        from matplotlib.collections import LineCollection

        directions = ["xyz".index(letter) for letter in self._scene.plane or "xy"]
        flat = shot.points[..., directions]
        segments = np.stack([flat[:, :-1], flat[:, 1:]], axis=2).reshape(-1, 2, 2)
        colours = self._colours(shot)
        lines = LineCollection(
            list(segments),
            colors=theme().palette[0] if colours is None else colours,
            linewidths=_WIDEST,
            capstyle="round",
            clip_on=False,
        )
        self._axes.add_collection(lines, autolim=False)
        return [lines]

    def _draw_solid(self, shot: Shot) -> list[Any]:
        scene, axes = self._scene, self._axes
        if scene.turns:
            parts.look(axes, shot.azimuth)
            axes.set_box_aspect(scene.high - scene.low, zoom=self._zoom)
        box = np.stack([scene.low, scene.high], axis=1)
        box[scene.lengths > 0.0] = np.stack([0.0 * scene.lengths, scene.lengths], 1)[
            scene.lengths > 0.0
        ]
        cell = parts.Cell(box, scene.lengths, shot.slant)
        drawn = parts.draw_cell(axes, cell)
        if self._labelled:
            drawn += parts.label_edges(axes, cell, scene.unit)
        return [*drawn, parts.draw_fibers(axes, shot.points, self._colours(shot))]
