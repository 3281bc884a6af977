"""Time averages with error bars from one run, whose successive values are correlated.

Values are averaged in blocks; if blocks are longer than the memory of the run their means are
independent, and the error of the mean is their scatter over the root of their number. Without a
given length blocks are doubled (Flyvbjerg & Petersen 1989) until the number b of values in one
passes ``b^3 > 2 n (error_b / error_1)^4``, n values in all (Lee et al., Phys. Rev. E 83 (2011)
066706): long enough to be independent, not so long that too few remain. A mean whose two halves
differ by more than three times the error that this has, twice that of the mean, is not settled.

In a flow that oscillates the values follow it, and a mean over part of a period says nothing.
There the mean of each whole period stands for its values, the last period ending with the last of
them, and blocks hold whole periods.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from math import floor
from typing import TYPE_CHECKING

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, as_float
from stokesfibers.core.errors import InputError
from stokesfibers.flow.period import period_of

if TYPE_CHECKING:
    import xarray as xr

_LEAST_BLOCKS = 4
LEAST_IN_A_PERIOD = 8
"""Fewest values in a period of the flow that tell its mean."""
_ROUNDING = 1e-6  # of a period
_NO_SPREAD = 1e-13  # of the largest value: what differs less is the same
_HALVES = 6.0  # times the error: three of the standard errors of the difference of both halves


@dataclass(frozen=True)
class Average:
    """The mean of a quantity over time.

    Attributes
    ----------
    mean
        Over all values.
    error
        One standard error of the mean, from whole blocks, the last ones.
    blocks
        How many blocks the error comes from.
    block
        Length of a block in time.
    settled
        Whether blocks are long enough to be independent and both halves agree, as far as the
        values tell. If not, the error is too small: run longer.
    after
        Time of the first value that counts.
    """

    mean: float
    error: float
    blocks: int
    block: float
    settled: bool
    after: float


def block_average(
    time: Array, values: Array, *, block: float | None = None, period: float | None = None
) -> Average:
    """Return the time average of `values` (n,) recorded at even `time` (n,).

    Parameters
    ----------
    block
        Length of a block in time; default as in the module's text.
    period
        Period of the flow, if it oscillates; only the last whole number of them counts.

    Raises
    ------
    InputError
        If there are fewer than four blocks or periods, or values that are not finite.
    """
    time, values = as_float(time), as_float(values)
    if values.ndim != 1 or values.shape != time.shape or len(values) < _LEAST_BLOCKS:
        expected = f"at least {_LEAST_BLOCKS} times and as many values"
        raise InputError("values", expected, f"shapes {time.shape}, {values.shape}")
    if not np.isfinite(values).all():
        raise InputError("values", "finite numbers", "others")
    spacing = float(time[-1] - time[0]) / (len(time) - 1)
    after = float(time[0])
    if period is not None:
        after, values = _by_period(time, values, spacing, period)
        spacing = period
    if block is None:
        return _doubled(values, spacing, after)
    size = max(1, round(checks.positive("block", block) / spacing))
    if len(values) // size < _LEAST_BLOCKS:
        most = spacing * (len(values) // _LEAST_BLOCKS)
        raise InputError("block", f"a time up to {most:.6g}, four blocks", block)
    return _in_blocks(values, size, spacing, after)


def average_of(
    data: xr.DataTree, name: str, *, after: float = 0.0, block: float | None = None
) -> Average:
    """Return the average of a scalar observable of a run over its times from `after` on.

    If the flow oscillates, over the last whole periods in that time.

    Raises
    ------
    InputError
        As `block_average`; or if the run does not hold `name` as a scalar.
    """
    observables = data["observables"].to_dataset()
    if name not in observables or observables[name].dims != ("time",):
        raise InputError("name", "a scalar observable of the run", repr(name))
    time = observables["time"].to_numpy()
    late = time >= after
    values = observables[name].to_numpy()[late]
    return block_average(time[late], values, block=block, period=flow_period(data))


def flow_period(data: xr.DataTree) -> float | None:
    """Return the period of the flow of a stored run; None if it is steady or not known."""
    case = data.attrs.get("case")
    return period_of(json.loads(case).get("flow", {})) if isinstance(case, str) else None


def _by_period(time: Array, values: Array, spacing: float, period: float) -> tuple[float, Array]:
    """Return the time of the first value in the last whole periods, and the mean of each."""
    count = floor((float(time[-1] - time[0]) + spacing) / period + _ROUNDING)
    if count < _LEAST_BLOCKS:
        span = f"{time[-1] - time[0]:.6g}, {count} of {period:.6g}"
        expected = f"at least {_LEAST_BLOCKS} whole periods of the flow"
        raise InputError("values", expected, span, "Run longer.")
    if period < LEAST_IN_A_PERIOD * spacing * (1.0 - _ROUNDING):
        expected = f"at least {LEAST_IN_A_PERIOD} values in each period of the flow, {period:.6g}"
        raise InputError("values", expected, f"one each {spacing:.6g}", "Record more often.")
    # the value at the end of a period belongs to it, that at its start to the one before
    number = np.ceil((time - time[-1]) / period + count - _ROUNDING).astype(int) - 1
    within = number >= 0
    each = np.bincount(number[within], minlength=count)
    sums = np.bincount(number[within], weights=values[within], minlength=count)
    if not each.all():
        raise InputError("time", "even times", "a gap longer than a period of the flow")
    return float(time[within][0]), as_float(sums / each)


def _doubled(values: Array, spacing: float, after: float) -> Average:
    size = 1
    while not _long_enough(values, size) and len(values) // (2 * size) >= _LEAST_BLOCKS:
        size *= 2
    return _in_blocks(values, size, spacing, after)


def _long_enough(values: Array, size: int) -> bool:
    plain = _error(values, 1)
    if plain == 0.0:
        return True
    return size**3 > 2.0 * len(values) * (_error(values, size) / plain) ** 4


def _halves_agree(values: Array, error: float) -> bool:
    half = len(values) // 2
    return abs(values[-half:].mean() - values[:half].mean()) <= _HALVES * error


def _means(values: Array, size: int) -> Array:
    count = len(values) // size
    return values[len(values) - count * size :].reshape(count, size).mean(axis=1)


def _error(values: Array, size: int) -> float:
    means = _means(values, size)
    return float(means.std(ddof=1) / np.sqrt(len(means)))


def _in_blocks(values: Array, size: int, spacing: float, after: float) -> Average:
    error = _error(values, size)
    same = float(np.ptp(values)) <= _NO_SPREAD * float(np.abs(values).max())
    settled = same or (_long_enough(values, size) and _halves_agree(values, error))
    mean, blocks = float(values.mean()), len(values) // size
    return Average(mean, error, blocks, size * spacing, bool(settled), after)
