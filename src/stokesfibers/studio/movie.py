"""Movies of a run: its fibers, coloured, over the course of a series such as the elastic energy."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.plot import paint, select
from stokesfibers.plot.case import offset, periods
from stokesfibers.plot.geometry import wrapped
from stokesfibers.plot.solid import AZIMUTH, Cell, Floats, outermost
from stokesfibers.plot.theme import THEMES
from stokesfibers.studio.frames import Scene, Shot, Strip, has_room, most_dpi
from stokesfibers.studio.movie_files import write_frames, writer
from stokesfibers.studio.movie_workers import frames

if TYPE_CHECKING:
    import xarray as xr

Watch = Callable[[int, int], None]
"""Called with the number of frames written and that of all."""

_LONGEST = 20.0  # seconds, if no duration is given
_FLAT = 1e-6  # extent across a plane, over the largest, below which shapes lie in it
_MARGIN = 0.06
_FRAMES_EACH = 12  # fewer frames than this are not worth a process
_SMALLEST, _LARGEST = 160, 4096
_USUAL_DPI, _USUAL_PIXELS = 150, 1280 * 720
_LEAST_DPI = 72  # text of 7.5 points is then 7.5 pixels high


@dataclass(frozen=True)
class Film:
    """How a movie is made.

    Attributes
    ----------
    fps
        Frames per second.
    duration
        Length in seconds. Default: a frame for each record, up to 20 s.
    size
        Width and height in pixels, even numbers.
    dpi
        Pixels per inch: how large text and lines are. Default: 150 at 1280 x 720, and as the root
        of the number of pixels, but at least 72, so that text stays legible. In a picture that is
        too small for them the series below and the colour bar are left out.
    colour
        What colours show: tension, curvature, orientation, fiber, or None.
    first, last
        Times to begin and end with; default all that is recorded.
    view
        ``"plane"`` for two directions with equal scales, ``"3d"`` for perspective with the cell;
        default plane for a few fibers whose shapes stay in one.
    orbit
        Degrees that the camera turns about the y axis during a movie in perspective.
    series
        Observable drawn below, ``"none"`` for none. Default: the elastic energy if fibers bend,
        else the first normal stress difference.
    ground
        ``"light"`` or ``"dark"``.
    workers
        Processes that draw; default one for each core, fewer for short movies.
    """

    fps: float = 25.0
    duration: float | None = None
    size: tuple[int, int] = (1280, 720)
    dpi: int | None = None
    colour: paint.Colour | None = "tension"
    first: float | None = None
    last: float | None = None
    view: str = "auto"
    orbit: float = 0.0
    series: str = "auto"
    ground: str = "light"
    workers: int | None = None

    def __post_init__(self) -> None:
        checks.positive("fps", self.fps)
        if self.duration is not None:
            checks.positive("duration", self.duration)
        for side in self.size:
            if checks.whole("size", side, _SMALLEST) % 2 or side > _LARGEST:
                raise InputError("size", f"even numbers from {_SMALLEST} to {_LARGEST}", self.size)
        if self.dpi is not None:
            checks.whole("dpi", self.dpi, 40)
            if self.dpi > (most := most_dpi(self.size)):
                width, height = self.size
                raise InputError("dpi", f"at most {most} for {width}x{height} pixels", self.dpi)
        checks.finite("orbit", self.orbit)
        paint.checked(self.colour)
        for name, known in (("view", ("auto", "plane", "3d")), ("ground", tuple(THEMES))):
            if getattr(self, name) not in known:
                raise InputError(name, f"one of {', '.join(known)}", repr(getattr(self, name)))
        if self.workers is not None:
            checks.whole("workers", self.workers, 1)

    @property
    def resolution(self) -> int:
        """Pixels per inch, chosen by the size if they are not given."""
        pixels = self.size[0] * self.size[1]
        usual = round(_USUAL_DPI * (pixels / _USUAL_PIXELS) ** 0.5)
        return self.dpi or min(max(_LEAST_DPI, usual), most_dpi(self.size))


def movie(
    data: xr.DataTree, path: str | Path, film: Film | None = None, *, watch: Watch | None = None
) -> Path:
    """Write a movie of a run and return its path.

    Frames show the nearest record; nothing is interpolated. Fibers are shown whole, with their
    middles in the cell, which slants as it is sheared. Colours and scales are those of the
    whole movie.

    Parameters
    ----------
    data
        The run, from `open_run` or a result.
    path
        File to write, .mp4 (needs the extra ``movie``) or .gif; replaced if it exists, once the
        new one is whole.
    film
        How it is made.
    watch
        Told how far it is, after each frame.

    Raises
    ------
    InputError
        If a choice does not fit the run, or the file's name or folder.
    MissingExtraError
        If ffmpeg is needed and not installed.
    """
    film = film or Film()
    target = Path(path)
    writer(target)
    records = _records(data, film)
    scene = _scene(data, film, records)
    count = len(records)
    most = min(os.cpu_count() or 1, count // _FRAMES_EACH)
    workers = min(film.workers, count) if film.workers else max(1, most)

    def watched() -> Iterator[bytes]:
        for number, frame in enumerate(frames(scene, _shots(data, film, records), workers), 1):
            yield frame
            if watch is not None:
                watch(number, count)

    write_frames(target, watched(), film.size, film.fps)
    return target


def _records(data: xr.DataTree, film: Film) -> list[int]:
    """Return the number of the record of each frame."""
    time = select.numbers(data, "trajectory", "time")
    first = float(time[0]) if film.first is None else film.first
    last = float(time[-1]) if film.last is None else film.last
    if not first < last and len(time) > 1:
        raise InputError("from", f"a time below {last:.6g}, the end", first)
    low, high = (int(k) for k in select.pick_records(data, [first, last])[[0, -1]])
    there = high - low + 1
    count = there
    if film.duration is not None:
        count = max(1, round(film.duration * film.fps))
    elif there > _LONGEST * film.fps:
        count = round(_LONGEST * film.fps)
    if count == there:
        return list(range(low, high + 1))
    wanted = np.linspace(time[low], time[high], count)
    return [low + int(np.argmin(np.abs(time[low : high + 1] - t))) for t in wanted]


def _shots(data: xr.DataTree, film: Film, records: list[int]) -> Iterator[Shot]:
    time = select.numbers(data, "trajectory", "time")
    lengths = periods(data)
    for number, record in enumerate(records):
        at = float(time[record])
        slid = offset(data, at)
        position = select.positions(data, record)
        turned = film.orbit * number / max(1, len(records) - 1)
        yield Shot(
            at,
            select.at_time(data, at),
            wrapped(position, lengths, slid),
            _values(data, film, record, position),
            slid / lengths[1] if slid else 0.0,
            AZIMUTH + turned,
        )


def _values(data: xr.DataTree, film: Film, record: int, position: Floats) -> Floats | None:
    if film.colour is None:
        return None
    tension = None
    if film.colour == "tension":
        array = select.read(data, "trajectory", "tension").isel(time=record)
        tension = select.values(array.transpose("fiber", "node"))
    return paint.node_values(film.colour, position, tension)


def _scene(data: xr.DataTree, film: Film, records: list[int]) -> Scene:
    """Return what all frames share; limits and colours are found in one pass over the records."""
    lengths = periods(data)
    hull, slants, largest, count = np.empty((0, 3)), (0.0, 0.0), 0.0, 0
    for shot in _shots(data, film, sorted(set(records))):
        hull = outermost(np.concatenate([hull, shot.points.reshape(-1, 3)]))
        slants = (min(slants[0], shot.slant), max(slants[1], shot.slant))
        count = len(shot.points)
        if shot.values is not None:
            largest = max(largest, float(np.nanmax(np.abs(shot.values), initial=0.0)))
    low, high = hull.min(axis=0), hull.max(axis=0)
    plane = _plane(film, low, high, flat=count <= select.MOST_FIBERS and not lengths.any())
    corners = _cells(*_roomy(low, high, lengths, flat=plane is not None), lengths, slants)
    hull = np.concatenate([hull, corners])
    low, high = hull.min(axis=0), hull.max(axis=0)
    return Scene(
        film.size,
        film.resolution,
        film.ground,
        plane,
        low,
        high,
        hull,
        lengths,
        None if film.colour is None else paint.paint(data, film.colour, largest),
        select.unit_text(select.describe(data, "trajectory", "position")),
        _strip(data, film),
        film.orbit != 0.0,
    )


def _cells(low: Floats, high: Floats, lengths: Floats, slants: tuple[float, float]) -> Floats:
    """Return the corners of the cell, between the limits where free, at the slants."""
    first, last = np.where(lengths > 0.0, 0.0, low), np.where(lengths > 0.0, lengths, high)
    box = np.stack([first, last], axis=1)
    return np.concatenate([Cell(box, lengths, slant).corners() for slant in slants])


def _plane(film: Film, low: Floats, high: Floats, *, flat: bool) -> str | None:
    extent = high - low
    across = int(np.argmin(extent))
    within = flat and bool(extent[across] <= _FLAT * extent.max())
    if film.view == "3d" or (film.view == "auto" and not (within and film.orbit == 0.0)):
        return None
    return "xyz".replace("xyz"[across], "") if within else "xy"


def _roomy(low: Floats, high: Floats, lengths: Floats, *, flat: bool) -> tuple[Floats, Floats]:
    """Return limits with a margin in free directions, and never a thin sliver."""
    most = float(np.max(high - low)) or 1.0
    centre, half = 0.5 * (low + high), 0.5 * (high - low)
    half = np.maximum(half, 0.15 * most) + (_MARGIN * most if flat else 0.0)
    free = lengths == 0.0
    return np.where(free, centre - half, low), np.where(free, centre + half, high)


def _strip(data: xr.DataTree, film: Film) -> Strip | None:
    name = film.series
    if name not in ("auto", "none") and not has_room(film.size, film.resolution)[0]:
        width, height = film.size
        hint = "Make it higher, text smaller (dpi), or leave the series out (series none)."
        raise InputError("size", "room for the series below", f"{width}x{height} pixels", hint)
    if name == "auto":
        stored = select.numbers(data, "trajectory", "time")
        bends = select.energy_at(data, stored) is not None
        name = "elastic_energy" if bends else "first_normal_stress_difference"
        if not select.has(data, "observables", name):
            return None
    if name == "none":
        return None
    array = select.read(data, "observables", name)
    if not set(array.dims) <= {"time", "fiber"}:
        raise InputError("series", "a scalar observable, or one per fiber", repr(name))
    total = array.sum("fiber", skipna=False) if name == "elastic_energy" else array
    values = select.values(total.max("fiber") if "fiber" in total.dims else total)
    time = select.numbers(data, "observables", "time")
    if film.first is not None or film.last is not None:
        inside = (time >= (film.first or time[0])) & (time <= (film.last or time[-1]))
        time, values = time[inside], values[inside]
    variable = select.describe(data, "observables", name)
    return Strip(time, values, select.axis_label(variable, longest=99), select.time_label(data))
