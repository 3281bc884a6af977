"""Fluid velocity on a plane: streamlines over the speed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import Variable, lookup
from stokesfibers.plot import select
from stokesfibers.plot.cut import Discs, discs_of, draw_discs, filled
from stokesfibers.plot.streams import draw_streams
from stokesfibers.plot.style import COLUMN, colour_bar, drawing
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_EVEN = 1e-6  # streamlines are followed on evenly spaced grids only
_FINER = 10  # parts of an interval, to find where a fiber is near the plane
_USUAL = 0.99
_PER_INCH = 16  # characters that fit beside a colour bar


def velocity_slice(
    x: ArrayLike,
    y: ArrayLike,
    velocity: ArrayLike,
    *,
    fibers: Iterable[ArrayLike] | None = None,
    within: float | None = None,
    axes: str = "xy",
    disturbance: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Draw streamlines of the velocity in a plane over its speed; return the axes.

    Points inside a fiber, where the velocity is NaN, are left grey unless the fiber's radius is
    given: then it is drawn as wide as the plane cuts it. The colours end at the largest speed;
    where 1 % of the points are more than twice as fast as the rest, as they are beside fibers,
    they end at the rest's largest speed, with a pointed colour bar.

    Parameters
    ----------
    x : (nx,)
        Horizontal coordinates of the grid [length], growing in equal steps.
    y : (ny,)
        Vertical coordinates of the grid [length], likewise.
    velocity : (ny, nx, 2) or (ny, nx, 3)
        Velocity [length/time]: the horizontal component, the vertical one, and the one
        across the plane, which counts for the speed only.
    fibers : each (node, 2), (node, 3) or (node, 4)
        Centrelines to draw, in the coordinates of the plane; the third column is the distance
        from the plane, the fourth the fiber's radius.
    within
        Distance from the plane up to which fibers are drawn boldly; beyond they are thin and
        dashed. Default: all are bold.
    axes
        Names of the two directions, horizontal first.
    disturbance
        Whether the background flow is left out of `velocity`; the colour bar says so.
    ax
        Axes to draw on; default those of a new figure.

    Raises
    ------
    InputError
        If the grid is not evenly spaced, shapes do not fit, or no velocity is finite.
    """
    across, up = _even("x", x), _even("y", y)
    u = _velocity(velocity, len(up), len(across))
    speed = np.sqrt(np.sum(u**2, axis=-1))
    lines, height = [_line(fiber) for fiber in fibers or ()], _height(across, up)
    discs = discs_of(lines)
    with drawing(ax, height=height) as ax:
        ax.set_facecolor(theme().hidden)
        label = speed_label(disturbance=disturbance, longest=int(_PER_INCH * (height - 0.5)))
        _draw_speed(ax, across, up, filled(speed, across, up, discs), label=label)
        draw_streams(ax, across, up, u)
        _draw_fibers(ax, lines, discs, within)
        _frame(ax, across, up, axes)
    return ax


def top_speed(speed: ArrayLike) -> tuple[float, bool]:
    """Return where the colours of speeds end, and whether some speeds are beyond.

    It is the largest; where 1 % of the points are more than twice as fast as the rest, as they are
    beside fibers, it is the rest's largest. 1 where nothing moves. NaN are left out.
    """
    known = np.asarray(speed, dtype=np.float64)
    largest = float(np.nanmax(known))
    usual = float(np.nanquantile(known, _USUAL))
    over = 0.0 < usual < 0.5 * largest
    return (usual if over else largest) or 1.0, over


def speed_label(*, disturbance: bool = False, longest: int = 40) -> str:
    """Return the label of a scale of speeds; its unit is that of a position over a time.

    Parameters
    ----------
    disturbance
        Whether the background flow U is left out.
    longest
        Characters on one line; a longer label takes two.
    """
    length, time = (lookup("trajectory", name).unit for name in ("position", "time"))
    symbol = r"|\mathbf{u}-\mathbf{U}|" if disturbance else r"|\mathbf{u}|"
    meaning = "disturbance speed" if disturbance else "fluid speed"
    speed = Variable("speed", "observables", (), f"{length} {time}^-1", symbol, meaning)
    return select.axis_label(speed, longest=longest)


def _height(across: NDArray[np.float64], up: NDArray[np.float64]) -> float:
    """Return the height of the figure in inches, which equal scales fill."""
    ratio = (up[-1] - up[0]) / (across[-1] - across[0])
    return float(np.clip(ratio * (COLUMN - 1.2) + 0.5, 1.5, 5.0))


def _frame(ax: Axes, across: NDArray[np.float64], up: NDArray[np.float64], names: str) -> None:
    ax.set(xlim=(across[0], across[-1]), ylim=(up[0], up[-1]))
    ax.set_aspect("equal", adjustable="box")
    unit = select.unit_text(lookup("trajectory", "position"))
    ax.set(xlabel=f"${names[0]}${unit}", ylabel=f"${names[1]}${unit}")


def _draw_speed(
    ax: Axes,
    across: NDArray[np.float64],
    up: NDArray[np.float64],
    speed: NDArray[np.float64],
    *,
    label: str,
) -> None:
    top, over = top_speed(speed)
    drawn = ax.pcolormesh(
        across,
        up,
        speed,
        cmap=theme().map_of(theme().pale),
        shading="nearest",
        rasterized=True,
        vmin=0.0,
        vmax=top,
    )
    colour_bar(ax, drawn, label, extend="max" if over else "neither")


def _draw_fibers(
    ax: Axes, lines: list[NDArray[np.float64]], discs: Discs, within: float | None
) -> None:
    for line in lines:
        _draw_line(ax, line, within)
    draw_discs(ax, discs, theme().palette[1])


def _draw_line(ax: Axes, line: NDArray[np.float64], within: float | None) -> None:
    """Draw a centreline; with distances from the plane, boldly only where it is near."""
    if within is None or line.shape[1] == 2:
        ax.plot(line[:, 0], line[:, 1], color=theme().palette[1], linewidth=1.6, zorder=3)
        return
    off_plane = {"linewidth": 0.5, "linestyle": (0, (5, 2)), "alpha": 0.75}
    ax.plot(line[:, 0], line[:, 1], color=theme().palette[1], zorder=3, **off_plane)
    # between nodes too, or a fiber that cuts the plane steeply would miss it
    nodes = np.arange(len(line))
    fine = np.linspace(0, len(line) - 1, _FINER * (len(line) - 1) + 1)
    x, y, off = (np.interp(fine, nodes, column) for column in line.T[:3])
    near = np.abs(off) <= within * (1.0 + 1e-9)
    if near.any():
        bold = np.where(near, [x, y], np.nan)
        ax.plot(*bold, color=theme().palette[1], linewidth=1.8, zorder=3)


def _even(name: str, given: ArrayLike) -> NDArray[np.float64]:
    grid = np.asarray(given, dtype=np.float64)
    expected = "at least 3 numbers that grow in equal steps"
    if grid.ndim != 1 or len(grid) < 3:
        raise InputError(name, expected, f"an array of shape {grid.shape}")
    steps = np.diff(grid)
    mean = (grid[-1] - grid[0]) / (len(grid) - 1)
    if not mean > 0.0 or not np.all(np.abs(steps - mean) <= _EVEN * mean):
        raise InputError(name, expected, f"steps from {steps.min():.6g} to {steps.max():.6g}")
    return np.linspace(grid[0], grid[-1], len(grid))


def _velocity(given: ArrayLike, rows: int, columns: int) -> NDArray[np.float64]:
    u = np.array(given, dtype=np.float64)
    if u.shape not in ((rows, columns, 2), (rows, columns, 3)):
        expected = f"shape ({rows}, {columns}, 2) or ({rows}, {columns}, 3): y first, then x"
        raise InputError("velocity", expected, str(u.shape))
    bad = ~np.isfinite(u).all(axis=-1)
    if bad.all():
        raise InputError("velocity", "some finite velocities", "none")
    u[bad] = np.nan
    return u


def _line(given: ArrayLike) -> NDArray[np.float64]:
    line = np.asarray(given, dtype=np.float64)
    if line.ndim != 2 or line.shape[1] not in (2, 3, 4) or len(line) < 2:
        raise InputError("fibers", "centrelines of shape (node, 2), 3 or 4", str(line.shape))
    return line
