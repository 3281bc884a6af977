"""Streamlines with an arrow each, at places that do not line up from one to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

_WIDTH, _HEAD = 0.45, 5.5  # points: of the lines, and of the arrows' heads
_GOLDEN = 0.618034  # steps of this share never gather in columns
_FIRST, _LAST = 0.2, 0.8  # shares of a line's length between which its arrow lies


def draw_streams(ax: Axes, across: Floats, up: Floats, u: Floats) -> None:
    """Draw streamlines of u (ny, nx, 2 or more), none where it is NaN.

    Parameters
    ----------
    ax
        The axes.
    across : (nx,)
    up : (ny,)
        The grid's coordinates.
    u
        Velocities: horizontal, vertical.
    """
    density = (1.2, float(np.clip(1.2 * len(up) / len(across), 0.4, 2.0)))
    streams = (np.ma.masked_invalid(u[..., 0]), np.ma.masked_invalid(u[..., 1]))
    before = set(ax.patches)
    drawn = ax.streamplot(
        across, up, *streams, color=theme().ink, linewidth=_WIDTH, density=density
    )
    for arrow in set(ax.patches) - before:  # all at the middles of their lines
        arrow.remove()
    lines = sorted(_joined(drawn.lines.get_segments()), key=lambda line: float(line[:, 1].mean()))
    for number, line in enumerate(lines):
        _draw_arrow(ax, line, _FIRST + (_LAST - _FIRST) * ((number * _GOLDEN) % 1.0))


def _joined(segments: list[Floats]) -> list[Floats]:
    """Return one array (n, 2) for each line: some versions give its pieces, others the whole."""
    lines: list[list[Floats]] = []
    for segment in segments:
        if lines and np.array_equal(lines[-1][-1][-1], segment[0]):
            lines[-1].append(segment[1:])
        else:
            lines.append([segment])
    return [np.concatenate(line) for line in lines]


def _draw_arrow(ax: Axes, line: Floats, share: float) -> None:
    """Draw a head on the line at a share of its length."""
    from matplotlib.patches import FancyArrowPatch

    along = np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))
    if not along[-1] > 0.0:
        return
    at = int(np.searchsorted(along, share * along[-1]))
    tail, ahead = line[at], 0.5 * (line[at] + line[at + 1])
    head = FancyArrowPatch(
        (float(tail[0]), float(tail[1])),
        (float(ahead[0]), float(ahead[1])),
        arrowstyle="-|>",
        mutation_scale=_HEAD,
        color=theme().ink,
        linewidth=_WIDTH,
        zorder=2,
    )
    ax.add_patch(head)
