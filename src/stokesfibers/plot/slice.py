"""Fluid velocity on a plane: streamlines over the speed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import lookup
from stokesfibers.plot import select
from stokesfibers.plot.style import COLUMN, INK, PALETTE, new_axes, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

_EVEN = 1e-6  # streamlines are followed on evenly spaced grids only


def velocity_slice(
    x: ArrayLike,
    y: ArrayLike,
    velocity: ArrayLike,
    *,
    fibers: Iterable[ArrayLike] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw streamlines of the velocity in a plane over its speed; return the axes.

    Points inside a fiber, where the velocity is NaN, are left grey. Set other axis labels on the
    axes returned if the plane is not that of x and y.

    Parameters
    ----------
    x : (nx,)
        Horizontal coordinates of the grid [length], growing in equal steps.
    y : (ny,)
        Vertical coordinates of the grid [length], likewise.
    velocity : (ny, nx, 2) or (ny, nx, 3)
        Velocity [length/time]: the horizontal component, the vertical one, and the one
        across the plane, which counts for the speed only.
    fibers : each (node, 2)
        Centrelines to draw, in the coordinates of the plane.
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
    lines = [_line(fiber) for fiber in fibers or ()]
    if ax is None:
        height = (up[-1] - up[0]) / (across[-1] - across[0]) * (COLUMN - 1.2) + 0.5
        ax = new_axes(height=float(np.clip(height, 1.5, 5.0)))
    with style():
        ax.set_facecolor("#BDBDBD")
        drawn = ax.pcolormesh(
            across, up, speed, cmap=_pale(), shading="nearest", rasterized=True, vmin=0.0
        )
        density = (1.2, float(np.clip(1.2 * len(up) / len(across), 0.4, 2.0)))
        streams = (np.ma.masked_invalid(u[..., 0]), np.ma.masked_invalid(u[..., 1]))
        ax.streamplot(
            across, up, *streams, color=INK, linewidth=0.45, arrowsize=0.55, density=density
        )
        for line in lines:
            ax.plot(line[:, 0], line[:, 1], color=PALETTE[1], linewidth=1.6, zorder=3)
        ax.set(xlim=(across[0], across[-1]), ylim=(up[0], up[-1]))
        ax.set_aspect("equal", adjustable="box")
        unit = select.unit_text(lookup("trajectory", "position"))
        ax.set(xlabel=f"$x${unit}", ylabel=f"$y${unit}")
        bar = ax.figure.colorbar(drawn, ax=ax, aspect=25, pad=0.02, shrink=0.9)
        bar.set_label(r"speed $|\mathbf{u}|$ [length time$^{-1}$]")
        bar.outline.set_linewidth(0.4)  # pyright: ignore[reportCallIssue]
    return ax


def _pale() -> Colormap:
    """Return a map from white to a blue on which dark streamlines still stand out."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps["Blues"](np.linspace(0.0, 0.72, 256)))


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
    if line.ndim != 2 or line.shape[1] != 2:
        raise InputError("fibers", "centrelines of shape (node, 2)", str(line.shape))
    return line
