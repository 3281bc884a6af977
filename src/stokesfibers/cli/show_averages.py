"""The averages over time that ``stokesfibers show`` prints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from stokesfibers.cli.words import number

if TYPE_CHECKING:
    import xarray as xr

_LEAST_VALUES = 16  # recorded in the second half


def stress_averages(observables: xr.Dataset, period: float | None) -> Iterator[dict[str, Any]]:
    """Yield block averages of the stress per volume over the second half of what is recorded.

    In a flow with a period over the last whole periods of that, if there are enough of them.
    """
    import numpy as np

    from stokesfibers.core.errors import InputError
    from stokesfibers.observe.averages import block_average

    if "particle_stress" not in observables:
        return
    times = observables["time"].to_numpy()
    late = times >= 0.5 * times[-1] if len(times) else np.zeros(0, dtype=bool)
    if late.sum() < _LEAST_VALUES:
        return
    p = observables["particle_stress"].to_numpy()[late]
    series = {
        "shear stress per volume": p[:, 0, 1],
        "N_1 per volume": p[:, 0, 0] - p[:, 1, 1],
        "N_2 per volume": p[:, 1, 1] - p[:, 2, 2],
    }
    if "specific_viscosity" in observables:
        series["specific viscosity"] = observables["specific_viscosity"].to_numpy()[late]
    for meaning, values in series.items():
        if np.isfinite(values).all():
            try:
                average = block_average(times[late], values, period=period)
            except InputError:
                return
            yield {"meaning": meaning, **asdict(average)}


def average_row(average: dict[str, Any]) -> tuple[str, ...]:
    """Return an average as cells of a line."""
    note = "" if average["settled"] else "; not settled, the error is larger"
    blocks = f"{average['blocks']} blocks of {number(average['block'])}{note}"
    return average["meaning"], f"{average['mean']:.4g} +- {average['error']:.2g}", blocks
