"""Orientation of a suspension: angles to the flow direction, orientation tensor, order."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.case import time_axis
from stokesfibers.plot.style import drawing, time_colours
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_FEWEST_BINS, _MOST_BINS = 4, 18
_ROUNDING = 1e-9


def orientation(
    data: xr.DataTree, *, times: ArrayLike | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the distribution of the angle between end-to-end vectors and the flow direction x.

    A fiber has no head, so the angle theta lies between 0 (along the flow) and pi/2. The
    histogram is a density: its integral over theta is 1. Fibers turned every way alike have
    the density sin(theta), drawn dashed. The number of bins is 2 n^(1/3) for n fibers.

    Parameters
    ----------
    data
        The stored run.
    times
        Times to draw; the nearest stored record stands for each. Default: the first and the last.
    ax
        Axes to draw on; default those of a new figure.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If a time lies outside the stored range, or no end-to-end vector has a length.
    """
    stored = select.numbers(data, "trajectory", "time")
    asked = [stored[0], stored[-1]] if times is None else times
    chosen = select.choose(data, asked)
    angles = _angles(data, chosen.records)
    count = angles.shape[1]
    bins = int(np.clip(round(2.0 * count ** (1.0 / 3.0)), _FEWEST_BINS, _MOST_BINS))
    edges = np.linspace(0.0, 0.5 * np.pi, bins + 1)
    colours = time_colours(chosen.times)
    with drawing(ax) as ax:
        theta = np.linspace(0.0, 0.5 * np.pi, 101)
        # Thinner from one time to the next, so that none hides another where they agree.
        widths = np.linspace(2.6, 1.0, len(angles)) if len(angles) > 1 else [1.2]
        for line, time, colour, width in zip(angles, chosen.times, colours, widths, strict=True):
            density, _ = np.histogram(line[np.isfinite(line)], edges, density=True)
            label = select.at_time(data, time)
            ax.stairs(density, edges, baseline=None, color=colour, linewidth=width, label=label)
        ax.plot(
            theta,
            np.sin(theta),
            color=theme().ink,
            linewidth=0.8,
            linestyle="--",
            label=r"$\sin\theta$",
        )
        _angle_axis(ax)
        ax.set_ylabel(r"density of fibers $p(\theta)$ [rad$^{-1}$]")
        title = "1 fiber" if count == 1 else f"{count} fibers"
        ax.legend(title=title, loc="upper left", bbox_to_anchor=(1.0, 1.0), alignment="left")
    return ax


def _angle_axis(ax: Axes) -> None:
    ax.set_xlim(0.0, 0.5 * np.pi)
    ax.set_ylim(bottom=0.0)
    ax.set_xticks(
        np.pi * np.arange(5) / 8, ["$0$", r"$\pi/8$", r"$\pi/4$", r"$3\pi/8$", r"$\pi/2$"]
    )
    ax.set_xlabel(r"angle to the flow direction $\theta$ [rad]")


def order(data: xr.DataTree, ax: Axes | None = None) -> Axes:
    """Draw the orientation tensor and the nematic order parameter against time.

    The tensor is the mean over fibers of p p, p the unit end-to-end vector. Its diagonal is
    drawn solid, and dashed what is off it and not zero to rounding; 1/3, dotted, is the diagonal
    of fibers turned every way alike. The order parameter S, the largest eigenvalue of
    (3 <p p> - 1) / 2, is drawn thick. Flow reversals are marked.

    Parameters
    ----------
    data
        The stored run.
    ax
        Axes to draw on; default those of a new figure.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the run does not hold the orientation tensor.
    """
    tensor = select.values(
        select.read(data, "observables", "orientation_tensor").transpose("time", "i", "j")
    )
    time = select.numbers(data, "observables", "time")
    with drawing(ax) as ax:
        ax.axhline(0.0, color=theme().faint, linewidth=0.5, zorder=0)
        ax.axhline(1.0 / 3.0, color=theme().faint, linewidth=0.6, linestyle=":", zorder=0)
        for number, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]):
            line = tensor[:, i, j]
            if i != j and not np.nanmax(np.abs(line), initial=0.0) > _ROUNDING:
                continue
            ax.plot(
                time,
                line,
                color=theme().palette[number],
                linestyle="-" if i == j else (0, (4, 1.5)),
                linewidth=1.0 if i == j else 0.8,
                label=rf"$\langle p_{'xyz'[i]} p_{'xyz'[j]} \rangle$",
            )
        ax.plot(time, _largest(tensor), color=theme().ink, linewidth=1.4, label="$S$")
        label = select.axis_label(select.describe(data, "observables", "orientation_tensor"))
        ax.set_ylabel(f"{label},\norder parameter $S$")
        time_axis(ax, data, time)
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def _largest(tensor: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the largest eigenvalue of (3 <p p> - 1) / 2 at each time, NaN where unknown.

    Found from the tensor rather than read: runs stored before it was recorded have it too.
    """
    known = np.isfinite(tensor).all(axis=(1, 2))
    nematic = 1.5 * np.where(np.expand_dims(known, (1, 2)), tensor, 0.0) - 0.5 * np.eye(3)
    return np.where(known, np.linalg.eigvalsh(nematic)[:, -1], np.nan)


def _angles(data: xr.DataTree, records: select.Records) -> NDArray[np.float64]:
    """Return the angle of each end-to-end vector to the x axis, (record, fiber), NaN without."""
    array = select.read(data, "trajectory", "position").isel(time=records)
    ends = array.isel(node=[0, -1]).transpose("node", "time", "fiber", "space")
    first, last = select.values(ends)
    across = np.hypot(last[..., 1] - first[..., 1], last[..., 2] - first[..., 2])
    along = np.abs(last[..., 0] - first[..., 0])
    angles = np.where(across + along > 0.0, np.arctan2(across, along), np.nan)
    if not np.isfinite(angles).any(axis=1).all():
        raise InputError(
            "trajectory.position", "fibers whose ends lie apart", "none in one of these records"
        )
    return angles
