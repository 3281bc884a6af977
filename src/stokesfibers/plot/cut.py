"""What a plane shows of fibers that it cuts: their width, and no ragged holes around them.

A spheroid's centreline at the distance d from the plane shows the half-width sqrt(r^2 - d^2), r its
radius there; discs of that size along the centreline cover what the plane cuts off the fiber.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

_PER_RADIUS = 4  # discs; their outline is then even to 1 % of the radius
_FEWEST, _MOST = 50, 4000


@dataclass(frozen=True)
class Discs:
    """Discs in the plane.

    Attributes
    ----------
    middle : (disc, 2)
    half : (disc,)
        Radii.
    """

    middle: Floats
    half: Floats


def discs_of(lines: list[Floats]) -> Discs:
    """Return the discs that cover what the plane cuts off fibers.

    Parameters
    ----------
    lines : each (node, 2), (node, 3) or (node, 4)
        Place in the plane, distance from it, radius; those without a radius give none.
    """
    found = [np.empty((0, 3))]
    for line in lines:
        if line.shape[1] < 4 or not line[:, 3].max() > 0.0:
            continue
        steps = np.linalg.norm(np.diff(line[:, :3], axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        count = np.clip(_PER_RADIUS * along[-1] / line[:, 3].max(), _FEWEST, _MOST)
        fine = np.linspace(0.0, along[-1], int(count))
        x, y, off, radius = (np.interp(fine, along, column) for column in line.T)
        left = radius**2 - off**2
        cut = left > 0.0
        found.append(np.stack([x, y, np.sqrt(np.where(cut, left, 0.0))], axis=1)[cut])
    every = np.concatenate(found)
    return Discs(every[:, :2], every[:, 2])


def filled(values: Floats, across: Floats, up: Floats, discs: Discs) -> Floats:
    """Return values (ny, nx) with those of the nearest point in holes (NaN) that discs cover."""
    from scipy.ndimage import distance_transform_edt
    from scipy.spatial import KDTree

    holes = np.isnan(values)
    rows, columns = np.nonzero(holes)
    if not len(rows) or not len(discs.half):
        return values
    distance, nearest = KDTree(discs.middle).query(np.stack([across[columns], up[rows]], axis=1))
    step = float(np.hypot(across[1] - across[0], up[1] - up[0]))
    covered = distance <= discs.half[nearest] + step
    where = np.asarray(distance_transform_edt(holes, return_distances=False, return_indices=True))
    rows, columns = rows[covered], columns[covered]
    whole = values.copy()
    whole[rows, columns] = values[where[0][rows, columns], where[1][rows, columns]]
    return whole


def draw_discs(ax: Axes, discs: Discs, colour: str) -> None:
    """Draw them without outlines, in one colour."""
    from matplotlib.collections import EllipseCollection

    if not len(discs.half):
        return
    size = 2.0 * discs.half
    drawn = EllipseCollection(
        size,
        size,
        np.zeros_like(size),
        units="xy",
        offsets=discs.middle,
        offset_transform=ax.transData,
        facecolors=colour,
        linewidths=0.0,
        zorder=3,
    )
    ax.add_collection(drawn, autolim=False)
