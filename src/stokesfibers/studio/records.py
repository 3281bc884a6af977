"""A run record by record: shapes are read in blocks, so that no run is too large to look at."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.case import offset, periods, stored_case

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]

_BLOCK_BYTES = 4 * 2**20


@dataclass(frozen=True)
class RunFacts:
    """What does not change during a run.

    Attributes
    ----------
    lengths : (3,)
        Periods of the cell, 0 in free directions.
    arclength : (fiber, node)
        Arclength of the stored points.
    radius : (fiber, node) or None
        Radius of the surface, ``r(s) = 2 eps sqrt(s (L - s))``; None if the run does not tell.
    times : (record,)
        Times of the shapes.
    """

    lengths: Floats
    arclength: Floats
    radius: Floats | None
    times: Floats

    @property
    def fiber_length(self) -> Floats:
        """Length of each fiber, (fiber,)."""
        return self.arclength[:, -1]


@dataclass(frozen=True)
class Record:
    """The shapes of one time.

    Attributes
    ----------
    number
        Number of the record in the run.
    time
        Its time.
    position : (fiber, node, 3)
        Centrelines, unwrapped.
    tension : (fiber, node)
        Line tension.
    velocity : (fiber, node, 3) or None
        Velocity of the centrelines, if the run stores it.
    offset
        How far the image one period up in y is displaced along x.
    """

    number: int
    time: float
    position: Floats
    tension: Floats
    velocity: Floats | None
    offset: float


def facts_of(data: xr.DataTree) -> RunFacts:
    """Return what does not change during the run.

    Raises
    ------
    InputError
        If the run holds no shapes yet.
    """
    times = select.numbers(data, "trajectory", "time")
    arclength = select.numbers(data, "trajectory", "arclength")
    eps = _slenderness(data, len(arclength))
    radius = None
    if eps is not None:
        length = arclength[:, -1:]
        inside = np.clip(arclength * (length - arclength), 0.0, None)
        radius = 2.0 * eps[:, None] * np.sqrt(inside)
    return RunFacts(periods(data), arclength, radius, times)


def count_of(facts: RunFacts, every: int) -> int:
    """Return how many records `records` gives for `every`."""
    return len(range(0, len(facts.times), every))


def records(data: xr.DataTree, facts: RunFacts, *, every: int = 1) -> Iterator[Record]:
    """Yield each `every`-th record, from the first on.

    Raises
    ------
    InputError
        If `every` is not a whole number above 0.
    """
    step = checks.whole("every", every, 1)
    trajectory = data["trajectory"].to_dataset()
    names = [n for n in ("position", "tension", "velocity") if n in trajectory]
    block = step * max(1, _block_length(trajectory["position"]) // step)
    for start in range(0, len(facts.times), block):
        stop = min(start + block, len(facts.times))
        read = {n: _values(trajectory[n][start:stop:step], n) for n in names}
        for k, number in enumerate(range(start, stop, step)):
            time = float(facts.times[number])
            velocity = read["velocity"][k] if "velocity" in read else None
            shape, tension = read["position"][k], read["tension"][k]
            yield Record(number, time, shape, tension, velocity, offset(data, time))


def _values(array: xr.DataArray, name: str) -> Floats:
    last = () if name == "tension" else ("space",)
    return select.values(array.transpose("time", "fiber", "node", *last))


def _block_length(position: xr.DataArray) -> int:
    """Return how many records to read at once: whole chunks of the store, a few megabytes."""
    chunk = int(position.encoding.get("preferred_chunks", {}).get("time", 1))
    record_bytes = 8 * int(np.prod(position.shape[1:]))
    return chunk * max(1, _BLOCK_BYTES // (chunk * record_bytes))


def _slenderness(data: xr.DataTree, fibers: int) -> Floats | None:
    """Return eps of each fiber, or None if the stored case does not tell it."""
    kinds: Any = stored_case(data).get("fiber", [])
    try:
        eps = [
            float(kind["slenderness"] if "slenderness" in kind else kind["radius"] / kind["length"])
            for kind in (kinds if isinstance(kinds, list) else [kinds])
            for _ in range(int(kind.get("count", 1)))
        ]
    except (AttributeError, KeyError, TypeError, ValueError):
        return None
    return np.array(eps) if len(eps) == fibers else None


@dataclass(frozen=True)
class PerFiber:
    """An observable of each fiber, read row by row.

    Attributes
    ----------
    time : (n,)
        Times it is recorded at.
    values
        The stored array (time, fiber), not loaded.
    """

    time: Floats
    values: xr.DataArray

    def at(self, time: float) -> Floats:
        """Return the values (fiber,) at `time`; between recorded times they are interpolated."""
        after = int(np.clip(np.searchsorted(self.time, time), 0, len(self.time) - 1))
        before = max(after - 1, 0)
        span = self.time[after] - self.time[before]
        share = (time - self.time[before]) / span if span > 0.0 else 1.0
        # weights of 0 and 1 would turn an infinity beside a recorded time into NaN
        if share <= 0.0 or share >= 1.0:
            return select.values(self.values[before if share <= 0.0 else after])
        low, high = select.values(self.values[before : after + 1])
        return (1.0 - share) * low + share * high


def per_fiber(data: xr.DataTree, name: str) -> PerFiber | None:
    """Return the observable `name` of each fiber; None if the run does not store it."""
    if not select.has(data, "observables", name):
        return None
    stored = select.read(data, "observables", name).transpose("time", "fiber")
    return PerFiber(select.numbers(data, "observables", "time"), stored)


def needs_shapes(data: xr.DataTree) -> None:
    """Refuse a run without a single recorded shape.

    Raises
    ------
    InputError
        If there is none.
    """
    if not select.has(data, "trajectory", "position"):
        raise InputError("RUN", "a run with at least one recorded shape", "none so far")
