"""Time averages with error bars from one run, whose successive values are correlated.

Values are averaged in blocks; if blocks are longer than the memory of the run their means are
independent, and the error of the mean is their scatter over the root of their number. Without a
given length blocks are doubled (Flyvbjerg & Petersen 1989) until the number b of values in one
passes ``b^3 > 2 n (error_b / error_1)^4``, n values in all (Lee et al., Phys. Rev. E 83 (2011)
066706): long enough to be independent, not so long that too few remain. A mean whose two halves
differ by more than three times the error that this has, twice that of the mean, is not settled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array, as_float
from stokesfibers.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

_LEAST_BLOCKS = 4
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
    """

    mean: float
    error: float
    blocks: int
    block: float
    settled: bool


def block_average(time: Array, values: Array, *, block: float | None = None) -> Average:
    """Return the time average of `values` (n,) recorded at even `time` (n,).

    Parameters
    ----------
    block
        Length of a block in time; default as in the module's text.

    Raises
    ------
    InputError
        If there are fewer than four blocks, or values that are not finite.
    """
    time, values = as_float(time), as_float(values)
    if values.ndim != 1 or values.shape != time.shape or len(values) < _LEAST_BLOCKS:
        expected = f"at least {_LEAST_BLOCKS} times and as many values"
        raise InputError("values", expected, f"shapes {time.shape}, {values.shape}")
    if not np.isfinite(values).all():
        raise InputError("values", "finite numbers", "others")
    spacing = float(time[-1] - time[0]) / (len(time) - 1)
    if block is None:
        return _doubled(values, spacing)
    size = max(1, round(checks.positive("block", block) / spacing))
    if len(values) // size < _LEAST_BLOCKS:
        most = spacing * (len(values) // _LEAST_BLOCKS)
        raise InputError("block", f"a time up to {most:.6g}, four blocks", block)
    return _in_blocks(values, size, spacing)


def average_of(
    data: xr.DataTree, name: str, *, after: float = 0.0, block: float | None = None
) -> Average:
    """Return the average of a scalar observable of a run over its times from `after` on.

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
    return block_average(time[late], observables[name].to_numpy()[late], block=block)


def _doubled(values: Array, spacing: float) -> Average:
    size = 1
    while not _long_enough(values, size) and len(values) // (2 * size) >= _LEAST_BLOCKS:
        size *= 2
    return _in_blocks(values, size, spacing)


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


def _in_blocks(values: Array, size: int, spacing: float) -> Average:
    error = _error(values, size)
    settled = _long_enough(values, size) and _halves_agree(values, error)
    mean, blocks = float(values.mean()), len(values) // size
    return Average(mean, error, blocks, size * spacing, bool(settled))
