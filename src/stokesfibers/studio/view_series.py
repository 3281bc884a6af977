"""What is drawn against time beside the fibers: energy, stress, distances, errors, steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from stokesfibers.plot import select

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]

_BLOCK_BYTES = 4 * 2**20


@dataclass(frozen=True)
class Curve:
    """One line in one panel.

    Attributes
    ----------
    panel
        Name of the panel, also a part of the path in the recording.
    group, name
        The stored array.
    label
        In the legend.
    over_fibers
        What is drawn of values that each fiber has.
    """

    panel: str
    group: str
    name: str
    label: str
    over_fibers: Literal["sum", "max"] = "max"

    @property
    def path(self) -> str:
        """Where it is in the recording."""
        return f"series/{self.panel}/{self.name}"


CURVES = (
    Curve("energy", "observables", "elastic_energy", "elastic, all fibers", "sum"),
    Curve("stress", "observables", "first_normal_stress_difference", "N1"),
    Curve("stress", "observables", "second_normal_stress_difference", "N2"),
    Curve("stress", "observables", "shear_stress", "shear"),
    Curve("distance", "observables", "smallest_gap", "surfaces"),
    Curve("distance", "observables", "smallest_distance", "centrelines"),
    Curve("error", "observables", "length_error", "largest"),
    Curve("step", "numerics", "step_size", "step"),
    Curve("solver", "numerics", "order", "order"),
    Curve("solver", "numerics", "iterations", "iterations"),
    Curve("solver", "numerics", "rejected", "rejected"),
)
_TITLES = {
    "energy": "energy",
    "stress": "stress",
    "distance": "distance",
    "error": "length error",
    "step": "step size",
    "solver": "steps",
}


def stored_curves(data: xr.DataTree) -> list[Curve]:
    """Return the curves that the run holds values of."""
    return [c for c in CURVES if select.has(data, c.group, c.name)]


def title(data: xr.DataTree, curve: Curve) -> str:
    """Return the title of the curve's panel, with its unit."""
    unit = select.describe(data, curve.group, curve.name).unit
    return _TITLES[curve.panel] + (f" [{unit}]" if unit != "1" else "")


def values_of(data: xr.DataTree, curve: Curve) -> Iterator[tuple[Floats, Floats]]:
    """Yield times and values of a curve in blocks; those that are not finite are left out."""
    times = select.numbers(data, curve.group, "time")
    stored = select.read(data, curve.group, curve.name)
    row = 8 * max(1, stored.size // max(1, len(times)))
    block = max(1, _BLOCK_BYTES // row)
    reduce = np.sum if curve.over_fibers == "sum" else np.max
    for start in range(0, len(times), block):
        values = select.values(stored[start : start + block])
        values = reduce(values.reshape(len(values), -1), axis=1)
        good = np.isfinite(values)
        if good.any():
            yield times[start : start + block][good], values[good]
