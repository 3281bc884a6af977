"""Colours of fibers in the viewer: what they show, one scale for the whole run, and its legend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.geometry import curvature
from stokesfibers.plot.style import PALETTE
from stokesfibers.studio.records import Record, RunFacts
from stokesfibers.studio.shapes import angle_to_x, tangents
from stokesfibers.studio.view_scale import Scale

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

COLOURS = ("tension", "curvature", "orientation", "fiber")
"""What the colour can show."""
_COMPRESSED_TO_STRETCHED = ("#08408A", "#3C8CCB", "#B9B9B9", "#E8743B", "#A31A0E")
# A run that starts abruptly peaks there; with that peak on the scale the rest would be one colour.
_USUAL = 0.98
_ROWS = 4096


@dataclass(frozen=True)
class Colouring:
    """How values become colours.

    Attributes
    ----------
    name
        One of `COLOURS`.
    values
        Gives the values (fiber, node) of a record.
    low, high
        Values at the ends of the scale; those beyond get the colour of the end.
    label
        Text of the scale, with matplotlib's formulas.
    said
        The same in one plain line.
    """

    name: str
    values: Callable[[Record], Floats]
    low: float
    high: float
    label: str
    said: str

    def rgba(self, record: Record) -> Bytes:
        """Return the colours (fiber, node, 4) of a record."""
        values = self.values(record)
        if self.name == "fiber":
            return _palette()[values.astype(np.intp) % len(PALETTE)]
        return self._scale.rgba(values)

    def legend(self) -> bytes:
        """Return a picture of the scale as the bytes of a PNG; empty for one colour a fiber."""
        return b"" if self.name == "fiber" else self._scale.picture()

    @property
    def _scale(self) -> Scale:
        ends = {"tension": "both", "curvature": "max"}.get(self.name, "neither")
        return Scale(_map(self.name), self.low, self.high, self.label, ends)


def colouring(
    data: xr.DataTree, facts: RunFacts, colour: str, *, limit: float | None = None
) -> Colouring:
    """Return how the fibers are coloured.

    Parameters
    ----------
    data
        The stored run.
    facts
        Of the run.
    colour
        ``"tension"``, with 0 in the middle (blue: compressed); ``"curvature"``;
        ``"orientation"``, the angle between tangent and x axis; ``"fiber"``, its number.
    limit
        Where the scale of tension or curvature ends; by default what 98 % of the recorded times
        do not exceed.

    Raises
    ------
    InputError
        If the colour is none of these, or the limit is not above 0 or does not fit the colour.
    """
    if colour not in COLOURS:
        raise InputError("color", f"one of {', '.join(COLOURS)}", repr(colour))
    if limit is not None:
        if colour not in ("tension", "curvature"):
            raise InputError("limit", "the colour tension or curvature", f"color {colour}")
        checks.positive("limit", limit)
    if colour == "tension":
        return _by_tension(data, limit)
    if colour == "curvature":
        return _by_curvature(data, limit)
    return _by_angle(facts) if colour == "orientation" else _by_number(facts)


def _by_tension(data: xr.DataTree, limit: float | None) -> Colouring:
    top = limit or _usual_peak(data, "largest_tension")
    about = select.describe(data, "trajectory", "tension")
    said = f"line tension from {-top:.3g} (blue: compressed) to {top:.3g} (red: stretched)"
    label, said = select.axis_label(about), _with_unit(said, about)
    return Colouring("tension", lambda r: r.tension, -top, top, label, said)


def _by_curvature(data: xr.DataTree, limit: float | None) -> Colouring:
    top = limit or _usual_peak(data, "largest_curvature")
    about = select.describe(data, "observables", "largest_curvature")
    about = replace(about, symbol=r"\kappa", meaning="curvature")
    said = _with_unit(f"curvature from 0 (light) to {top:.3g} (dark)", about)
    label = select.axis_label(about)
    return Colouring("curvature", lambda r: curvature(r.position), 0.0, top, label, said)


def _by_angle(facts: RunFacts) -> Colouring:
    def values(record: Record) -> Floats:
        return angle_to_x(tangents(record.position, facts.arclength))

    label = "angle between tangent and $x$ axis [degrees]"
    said = "angle between tangent and x axis, from 0 (dark) to 90 degrees (light)"
    return Colouring("orientation", values, 0.0, 90.0, label, said)


def _by_number(facts: RunFacts) -> Colouring:
    shape = facts.arclength.shape
    number = np.broadcast_to(np.arange(float(shape[0]))[:, None], shape)
    said = f"number of the fiber; {len(PALETTE)} colours, again and again"
    return Colouring("fiber", lambda _: number, 0.0, 1.0, "fiber", said)


def _with_unit(said: str, about: Any) -> str:
    return f"{said} [{about.unit}]" if about.unit != "1" else said


def _usual_peak(data: xr.DataTree, name: str) -> float:
    """Return what the largest value over fibers seldom exceeds; 1 where nothing tells."""
    if not select.has(data, "observables", name):
        return 1.0
    stored = select.read(data, "observables", name).transpose("time", "fiber")
    peaks = [
        np.nanmax(select.values(stored[k : k + _ROWS]), axis=1, initial=0.0)
        for k in range(0, stored.sizes["time"], _ROWS)
    ]
    every = np.concatenate(peaks)
    every = every[np.isfinite(every)]
    top = float(np.quantile(every, _USUAL)) if len(every) else 0.0
    return top if top > 0.0 else 1.0


def _map(name: str) -> Any:
    import matplotlib
    from matplotlib.colors import LinearSegmentedColormap, ListedColormap

    if name == "tension":
        return LinearSegmentedColormap.from_list("tension", _COMPRESSED_TO_STRETCHED)
    if name == "curvature":
        return ListedColormap(matplotlib.colormaps["viridis_r"](np.linspace(0.12, 1.0, 256)))
    return matplotlib.colormaps["cividis"]


def _palette() -> Bytes:
    from matplotlib.colors import to_rgba_array

    return (255.0 * to_rgba_array(PALETTE) + 0.5).astype(np.uint8)
