"""The averages over time that ``stokesfibers show`` prints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from stokesfibers.cli.words import number

if TYPE_CHECKING:
    import xarray as xr

    from stokesfibers.core.arrays import Array

_LEAST_VALUES = 16  # recorded in the second half


def stress_averages(
    observables: xr.Dataset, period: float | None
) -> tuple[list[dict[str, Any]], str]:
    """Return block averages of the stress per volume, and why there are none if that is no matter.

    They are over the second half of what is recorded; in a flow with a period over the last whole
    periods of that.
    """
    import numpy as np

    from stokesfibers.core.errors import InputError
    from stokesfibers.observe.averages import block_average

    times = observables["time"].to_numpy() if "particle_stress" in observables else np.zeros(0)
    late = times >= 0.5 * times[-1] if len(times) else np.zeros(0, dtype=bool)
    if late.sum() < _LEAST_VALUES:
        return [], ""
    found = []
    for meaning, values in _series(observables.isel(time=late)):
        if np.isfinite(values).all():
            try:
                average = block_average(times[late], values, period=period)
            except InputError as error:
                return [], f"they take {error.expected}; there are {error.got}. {error.hint}"
            found.append({"meaning": meaning, **asdict(average)})
    return found, ""


def _series(late: xr.Dataset) -> Iterator[tuple[str, Array]]:
    p = late["particle_stress"].to_numpy()
    yield "shear stress per volume", p[:, 0, 1]
    yield "N_1 per volume", p[:, 0, 0] - p[:, 1, 1]
    yield "N_2 per volume", p[:, 1, 1] - p[:, 2, 2]
    if "specific_viscosity" in late:
        yield "specific viscosity", late["specific_viscosity"].to_numpy()


def average_row(average: dict[str, Any]) -> tuple[str, ...]:
    """Return an average as cells of a line."""
    note = "" if average["settled"] else "; not settled, the error is larger"
    blocks = f"{average['blocks']} blocks of {number(average['block'])}{note}"
    return average["meaning"], f"{average['mean']:.4g} +- {average['error']:.2g}", blocks
