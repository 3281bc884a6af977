"""What a reader of a sweep's figure should know: values that tell little, or cannot be trusted."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

    from stokesfibers.plot.sweep_along import Along

Floats = NDArray[np.float64]
ALIKE = 1e-6  # relative; less is noise at any tolerance of a run
_AT_END = 1e-9  # relative
_SEEN = 0.01  # of the range of all values: a change that an eye sees
_JUMP = 0.25  # of a run's time, from one value along a line to the next


def alike(values: Floats) -> bool:
    """Return whether values are the same to a part in a million: how they differ is noise."""
    return np.isfinite(values).sum() > 1 and spread(values) <= ALIKE


def spread(values: Floats) -> float:
    """Return by how much values differ, over the largest of them; 0 for fewer than two."""
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite) / (np.abs(finite).max() or 1.0)) if finite.size > 1 else 0.0


def at_an_end(data: xr.Dataset, name: str) -> Iterator[str]:
    """Say of how many cases the largest or smallest value is the first one, or the last."""
    when = data.get(f"{name}_time")
    if when is None:
        return
    known = when.notnull()
    first = json.loads(data.attrs.get("collect", "{}")).get("after") or 0.0
    last = data["time_reached"] * (1.0 - _AT_END) if "time_reached" in data else np.inf
    for there, what in ((when <= first, "first"), (when >= last, "last")):
        count = int((known & there).sum())
        if count:
            yield f"{count} of {int(known.sum())} values are those of the {what} time"


def jumps(
    share: Floats, places: Floats, values: Floats, named: tuple[Along, Along | None, Along | None]
) -> Iterator[str]:
    """Say where along a line the time of an extremum jumps: another bend is the largest there.

    Parameters
    ----------
    share : (panel, line, x)
        Times of the extrema over those of the runs.
    places : (panel, line, x)
        Values of the parameter along the axis.
    values : (panel, line, x)
        The extrema; where they hardly change, nothing is said.
    named
        The horizontal axis, the lines and the panels.
    """
    known = (share > 0.0) & (share < 1.0 - _AT_END) & np.isfinite(places)
    inside = np.where(known & ~alike(values), share, np.nan)
    order = np.argsort(places, axis=-1)
    times, taken = (np.take_along_axis(one, order, axis=-1) for one in (inside, values))
    far = np.abs(np.diff(times, axis=-1)) > _JUMP
    far &= np.abs(np.diff(taken, axis=-1)) > _SEEN * np.ptp(values[np.isfinite(values)])
    if not far.any():
        return
    panel, line, k = map(int, np.argwhere(far)[0])
    ends = np.take_along_axis(places, order, axis=-1)[panel, line, k : k + 2]
    count = int(far.any(axis=-1).sum())
    axis, *others = named
    where = f"{axis.parameter} = {ends[0]:.4g} and {ends[1]:.4g}"
    at = [one.plainly(j) for one, j in zip(others, (line, panel), strict=True) if one is not None]
    where += f" ({', '.join(at)})" if at else ""
    lines = "" if count == 1 else f", and in {count - 1} other line{'s' * (count > 2)}"
    yield f"between {where} another moment of the run gives the value{lines}; a kink may be that"


def alike_ones(values: Floats, name: str) -> Iterator[str]:
    """Say if values (panel, line, x) are the same, or those along some of the lines."""
    if alike(values):
        yield f"all values of {name} are the same to a part in a million"
        return
    lines = values.reshape(-1, values.shape[-1])
    flat = sum(map(alike, lines))
    if flat:
        yield f"along {flat} of {len(lines)} lines values are the same to a part in a million"


def doubtful_ones(values: Floats, doubtful: NDArray[np.bool_], series: bool) -> Iterator[str]:
    """Say how many results cannot be trusted.

    Parameters
    ----------
    values, doubtful : (..., x)
        What is drawn where it is known, and what of it cannot be trusted.
    series
        Whether x is the time: a line is one result then.
    """
    known = np.isfinite(values)
    shown = known.any(axis=-1) if series else known
    odd = shown & (doubtful.any(axis=-1) if series else doubtful)
    if odd.any():
        drawn = "dashed" if series else "hollow"
        count = f"{odd.sum()} of {shown.sum()} results drawn"
        yield f"{count} cannot be trusted, lack a seed or have not settled; they are {drawn}"
