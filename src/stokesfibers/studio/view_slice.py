"""The fluid's velocity in a plane, found from a run for the viewer: a coloured sheet and arrows.

A run holds no velocity of the fluid. It is computed from the recorded shapes and tensions, at a
few times only, because that takes seconds for each where there are a thousand fibers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.case import stored_case
from stokesfibers.plot.plane import Plane, plane_of
from stokesfibers.plot.slice import speed_label, top_speed
from stokesfibers.problem.tables import problem_from_tables
from stokesfibers.run.velocity import velocity_from_run
from stokesfibers.studio.view_scale import Scale

if TYPE_CHECKING:
    import xarray as xr

    from stokesfibers.problem.problem import Problem

Floats = NDArray[np.float64]

PATH = "space/velocity"
"""Where the plane is in the recording."""
_MOST_POINTS = 200
_MOST_TIMES = 1000
_ARROWS = 12  # along the longer side
_INK = (70, 70, 70)
_MAP = "Purples"  # no colour of it stands for a tension or a curvature
_ENDS = (0.06, 0.72)


@dataclass(frozen=True)
class VelocitySlice:
    """A plane in which the viewer shows the fluid's velocity.

    Attributes
    ----------
    plane
        Its two directions, e.g. ``"xy"``.
    at
        Where it cuts the third direction [length]; default the middle of the cell where that is
        periodic, else of the fibers.
    points
        Points along its longer side.
    most
        At how many of the shown records it is computed, evenly spread, the first and the last
        among them. Between them the one before stays; its label tells its time.
    disturbance
        Whether the background flow is left out.
    allow_python
        Whether a flow or load from a user's file may run.
    """

    plane: str = "xy"
    at: float | None = None
    points: int = 32
    most: int = 20
    disturbance: bool = False
    allow_python: bool = False

    def __post_init__(self) -> None:
        select.plane_directions(self.plane)
        if self.at is not None:
            checks.finite("at", self.at)
        checks.whole("points", self.points, 5, _MOST_POINTS)
        checks.whole("most", self.most, 1, _MOST_TIMES)

    def picked(self, shown: Sequence[int]) -> list[int]:
        """Return at which of the shown records the velocity is computed."""
        count = min(self.most, len(shown))
        if count == 1:
            return [shown[-1]]
        where = np.rint(np.linspace(0.0, len(shown) - 1.0, count)).astype(int)
        return [shown[k] for k in where]

    def said(self, shown: Sequence[int]) -> str:
        """Return what is shown, in one line."""
        count = len(self.picked(shown))
        what = "velocity without the background flow" if self.disturbance else "velocity"
        normal = "xyz"[select.plane_directions(self.plane)[2]]
        where = "in the middle" if self.at is None else f"at {normal} = {self.at:.6g}"
        return f"{what} in the {self.plane} plane {where}, at {count} of the times shown"

    def problem(self, data: xr.DataTree) -> Problem:
        """Return the problem of the run, which gives its flow and its sums.

        Raises
        ------
        InputError
            If the run does not tell it, or it holds Python that is not allowed.
        """
        tables = stored_case(data)
        if not tables:
            raise InputError("RUN", "a run that holds its case", "none")
        return problem_from_tables(dict(tables), allow_python=self.allow_python)


@dataclass(frozen=True)
class Cut:
    """The velocity in the plane at one record.

    Attributes
    ----------
    record
        Its number.
    grid
        The plane and its points.
    velocity : (ny, nx, 3)
        In space; NaN inside a fiber.
    """

    record: int
    grid: Plane
    velocity: Floats

    @property
    def speed(self) -> Floats:
        """Size of the velocity, (ny, nx)."""
        return np.linalg.norm(self.velocity, axis=-1)


def plane_velocity(
    data: xr.DataTree, problem: Problem, grid: Plane, *, disturbance: bool = False
) -> Floats:
    """Return the fluid's velocity in space at the points of a plane, (ny, nx, 3).

    Parameters
    ----------
    data
        The stored run.
    problem
        Its problem.
    grid
        The plane, with its time.
    disturbance
        Whether the background flow is left out.
    """
    velocity = velocity_from_run(data, grid.points, time=grid.time, problem=problem)
    return velocity - problem.flow.velocity(grid.points, grid.time) if disturbance else velocity


def cuts(
    data: xr.DataTree, chosen: VelocitySlice, problem: Problem, numbers: Sequence[int]
) -> Iterator[Cut]:
    """Yield the velocity in the chosen plane at the records of these numbers."""
    times = select.numbers(data, "trajectory", "time")
    for number in numbers:
        time = float(times[number])
        grid = plane_of(data, axes=chosen.plane, at=chosen.at, time=time, points=chosen.points)
        velocity = plane_velocity(data, problem, grid, disturbance=chosen.disturbance)
        yield Cut(number, grid, velocity)


def speed_scale(made: Sequence[Cut], *, disturbance: bool) -> Scale:
    """Return the colours of the speed, the same for all times."""
    top, over = top_speed(np.concatenate([cut.speed.ravel() for cut in made]))
    label = speed_label(disturbance=disturbance)
    return Scale(_colours(), 0.0, top, label, "max" if over else "neither")


def _colours() -> Any:
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps[_MAP](np.linspace(*_ENDS, 256)))


def log_cuts(
    rr: Any, stream: Any, made: Sequence[Cut], *, scale: Scale, at: Callable[[Cut], None]
) -> None:
    """Log the sheets with their arrows, and the scale of their colours.

    Parameters
    ----------
    rr
        The package rerun.
    stream
        The recording.
    made
        What is shown.
    scale
        Its colours; arrows of the scale's end are as long as they are apart.
    at
        Called before each one: sets the time in the recording.
    """
    picture = rr.EncodedImage(contents=scale.picture(), media_type="image/png")
    stream.log("speed", picture, static=True)
    for cut in made:
        at(cut)
        stream.log(f"{PATH}/speed", _sheet(rr, cut, scale))
        stream.log(f"{PATH}/arrows", _arrows(rr, cut, scale.high))
        line, label = _rim(rr, cut)
        stream.log(f"{PATH}/rim", line)
        stream.log(f"{PATH}/time", label)


def _sheet(rr: Any, cut: Cut, scale: Scale) -> Any:
    """Return the coloured plane, with holes inside fibers."""
    rows, columns = cut.speed.shape
    corner = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    known = np.isfinite(cut.speed).ravel()
    return rr.Mesh3D(
        vertex_positions=cut.grid.points.reshape(-1, 3).astype(np.float32),
        triangle_indices=triangles[known[triangles].all(axis=1)].astype(np.uint32),
        vertex_colors=scale.rgba(cut.speed.ravel()),
    )


def _arrows(rr: Any, cut: Cut, top: float) -> Any:
    """Return arrows at each few points; none is longer than they are apart."""
    step = -(-max(cut.speed.shape) // _ARROWS)
    some = (slice(step // 2, None, step), slice(step // 2, None, step))
    origins = cut.grid.points[some].reshape(-1, 3)
    moved = cut.velocity[some].reshape(-1, 3)
    known = np.isfinite(moved).all(axis=1)
    origins, moved = origins[known], moved[known]
    apart = step * float(cut.grid.x[1] - cut.grid.x[0])
    size = np.linalg.norm(moved, axis=1, keepdims=True)
    vectors = apart * moved / np.maximum(size, top)
    return rr.Arrows3D(
        origins=origins.astype(np.float32),
        vectors=vectors.astype(np.float32),
        radii=0.025 * apart,
        colors=[_INK],
    )


def _rim(rr: Any, cut: Cut) -> tuple[Any, Any]:
    """Return the outline, and a label at its corner with the time it is of."""
    corners = cut.grid.points[[0, 0, -1, -1, 0], [0, -1, -1, 0, 0]].astype(np.float32)
    normal = "xyz"[cut.grid.directions[2]]
    text = f"fluid at t = {cut.grid.time:.6g}, {normal} = {cut.grid.at:.4g}"
    wide = 0.002 * float(np.ptp(corners, axis=0).max())
    line = rr.LineStrips3D([corners], radii=wide, colors=[_INK])
    label = rr.Points3D(corners[:1], radii=wide, colors=[_INK], labels=[text], show_labels=True)
    return line, label
