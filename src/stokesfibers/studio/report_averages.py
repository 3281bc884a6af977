"""Averages over the second half of a run, with error bars by blocks, for report and figure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import Variable, lookup
from stokesfibers.observe.averages import block_average, flow_period
from stokesfibers.plot import Averaged, select

if TYPE_CHECKING:
    import xarray as xr

LEAST_VALUES = 16
"""Fewest records an average is taken over by itself."""
_SCALARS = ("shear_stress", "first_normal_stress_difference", "intrinsic_viscosity")
_PER_VOLUME = (
    (r"\Sigma^p_{12}", "shear stress per volume", (0, 1), None),
    (r"N^p_1", "first normal stress difference per volume", (0, 0), (1, 1)),
    (r"N^p_2", "second normal stress difference per volume", (1, 1), (2, 2)),
)


def run_averages(
    data: xr.DataTree, *, after: float | None = None, block: float | None = None
) -> list[Averaged]:
    """Return averages of the stresses: per volume where the cell has one, else of all fibers.

    Parameters
    ----------
    data
        The stored run.
    after
        Time from which on to average; default the middle of what is recorded.
    block
        Length of a block in time; by default found from the values.

    Raises
    ------
    InputError
        If fewer than four values or blocks lie in that time, or whole periods of a flow that
        oscillates; or if `after` is not finite.
    """
    time = select.numbers(data, "observables", "time")
    start = 0.5 * float(time[0] + time[-1]) if after is None else checks.finite("after", after)
    late, period = time >= start, flow_period(data)
    found = []
    for variable, values in _series(data):
        if not np.isfinite(values).all():
            continue
        try:
            one = block_average(time[late], values[late], block=block, period=period)
        except InputError as error:
            if error.where == "block":
                raise
            if period is not None and late.sum() >= LEAST_VALUES:
                expected = f"times with {error.expected}"
                raise InputError("after", expected, error.got, error.hint) from None
            shown = f"{start:.6g}, with {int(late.sum())} records after it"
            raise InputError("after", "a time with four records after it", shown) from None
        found.append(Averaged(variable, time, values, one.after, one.mean, one.error, one.settled))
    return found


def has_averages(data: xr.DataTree) -> bool:
    """Return whether the run has a stress per volume, and enough records for its averages."""
    if not select.has(data, "observables", "particle_stress"):
        return False
    time = select.numbers(data, "observables", "time")
    return int((time >= 0.5 * (time[0] + time[-1])).sum()) >= LEAST_VALUES


def _series(data: xr.DataTree) -> Iterator[tuple[Variable, Array]]:
    if select.has(data, "observables", "particle_stress"):
        stress = select.numbers(data, "observables", "particle_stress")
        whole = select.describe(data, "observables", "particle_stress")
        for symbol, meaning, plus, minus in _PER_VOLUME:
            values = stress[:, *plus] - (0.0 if minus is None else stress[:, *minus])
            yield replace(whole, symbol=symbol, meaning=meaning), values
        names: tuple[str, ...] = ("specific_viscosity",)
    else:
        names = _SCALARS
    for name in names:
        if select.has(data, "observables", name):
            yield lookup("observables", name), select.numbers(data, "observables", name)
