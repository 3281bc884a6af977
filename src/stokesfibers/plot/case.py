"""What a figure needs of the case stored with a run: the cell, and flow reversals."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_MOST_MARKS = 40  # more reversals than this would fill the axes


def stored_case(data: xr.DataTree) -> Mapping[str, Any]:
    """Return the tables of the run's resolved case; empty if it was stored without one.

    Raises
    ------
    InputError
        If what is stored is no case.
    """
    held: Any = data.attrs.get("case", "{}")
    try:
        case = json.loads(held)
    except (TypeError, json.JSONDecodeError):
        case = None
    if not isinstance(case, dict):
        raise InputError("case", "tables written as JSON", str(held)[:60])
    return case


def periods(data: xr.DataTree) -> NDArray[np.float64]:
    """Return the periods of the cell, (3,), zero in free directions. The cell starts at 0."""
    domain = stored_case(data).get("domain", {})
    return np.asarray(domain.get("periods", (0.0, 0.0, 0.0)), dtype=np.float64)


def offset(data: xr.DataTree, time: float) -> float:
    """Return how far images one period up in y are displaced along x at `time`, in +- Lx / 2.

    Zero but in a sheared cell. Between recorded observables the strain is interpolated.
    """
    if not select.has(data, "observables", "strain"):
        return 0.0
    strain = select.numbers(data, "observables", "strain")
    lx, ly, _ = periods(data)
    shift = ly * float(np.interp(time, select.numbers(data, "observables", "time"), strain))
    return shift - lx * round(shift / lx)


def radii(data: xr.DataTree) -> NDArray[np.float64]:
    """Return r(s) = 2 eps sqrt(s (L - s)) at the nodes, (fiber, node); 0 if the case is missing."""
    s = select.numbers(data, "trajectory", "arclength")
    length = s[:, -1:]
    held = stored_case(data).get("fiber", [])
    groups = [held] if isinstance(held, Mapping) else held
    eps = [_slenderness(group) for group in groups for _ in range(int(group.get("count", 1)))]
    if len(eps) != len(s):
        return np.zeros_like(s)
    return 2.0 * np.array(eps)[:, None] * np.sqrt(np.clip(s * (length - s), 0.0, None))


def _slenderness(group: Mapping[str, Any]) -> float:
    if group.get("slenderness") is not None:
        return float(group["slenderness"])
    return float(group.get("radius") or 0.0) / float(group["length"])


def reversals(data: xr.DataTree, first: float, last: float) -> NDArray[np.float64]:
    """Return the times strictly between `first` and `last` when the flow changes its sign.

    The oscillating shear sin(2 pi frequency t) y does so every half period, at
    t = k / (2 frequency). Other flows give none.
    """
    flow = stored_case(data).get("flow", {})
    if flow.get("kind") != "oscillatory_shear":
        return np.empty(0)
    half = 0.5 / float(flow["frequency"])
    # A record at a reversal is off by rounding; a mark on the frame tells nothing.
    slack = 1e-9 * half
    low = np.floor((first + slack) / half) + 1
    high = np.ceil((last - slack) / half) - 1
    return half * np.arange(low, high + 1)


def mark_reversals(ax: Axes, data: xr.DataTree, time: NDArray[np.float64]) -> bool:
    """Draw a thin dashed vertical line at each flow reversal; return whether there are any.

    Parameters
    ----------
    ax
        Axes with time on the horizontal axis.
    data
        The stored run.
    time : (n,)
        Times drawn; only reversals between the first and the last are marked, and none if there
        are more than 40.
    """
    marks = reversals(data, float(time[0]), float(time[-1]))
    if not 0 < len(marks) <= _MOST_MARKS:
        return False
    for number, mark in enumerate(marks):
        ax.axvline(
            mark,
            color=theme().faint,
            linewidth=0.5,
            linestyle=(0, (5, 3)),
            zorder=0,
            label="" if number else "flow reverses",
        )
    return True


def time_axis(ax: Axes, data: xr.DataTree, time: NDArray[np.float64]) -> bool:
    """Mark flow reversals, label and fit the time axis; return whether there are marks."""
    marked = mark_reversals(ax, data, time)
    ax.set_xlabel(select.time_label(data))
    ax.margins(x=0.0)
    return marked
