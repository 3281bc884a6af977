"""Block averages: errors of correlated values against what is known of them."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from stokesfibers.core.errors import InputError
from stokesfibers.observe.averages import average_of, block_average
from support import assert_close


def _correlated(count, memory, seed):
    """An autoregressive series of unit variance; the error of its mean is known."""
    random = np.random.default_rng(seed)
    keep = np.exp(-1.0 / memory)
    noise = np.sqrt(1.0 - keep**2) * random.normal(size=count)
    values = np.empty(count)
    values[0] = random.normal()
    for k in range(1, count):
        values[k] = keep * values[k - 1] + noise[k]
    return values, np.sqrt((1.0 + keep) / (1.0 - keep) / count)


def test_the_error_of_independent_values_is_their_scatter():
    values = np.random.default_rng(0).normal(3.0, 2.0, 4096)
    found = block_average(np.arange(4096.0), values, block=1.0)
    assert_close(found.error, values.std(ddof=1) / 64.0, rtol=1e-12)
    assert_close(found.mean, values.mean(), rtol=1e-12)


@pytest.mark.parametrize("memory", [5.0, 20.0])
def test_errors_of_correlated_values_are_found(memory):
    found, means = [], []
    for seed in range(30):
        values, known = _correlated(8192, memory, seed)
        average = block_average(0.1 * np.arange(8192), values)
        assert average.settled
        assert average.block > 0.1 * memory
        found.append(average.error)
        means.append(average.mean)
    assert_close(np.mean(found), known, rtol=0.15)
    assert_close(np.sqrt(np.mean(np.square(means))), known, rtol=0.35)
    assert block_average(np.arange(8192.0), values, block=1.0).error < 0.5 * known


def test_a_drift_is_not_taken_for_settled():
    time = np.linspace(0.0, 1.0, 257)
    assert not block_average(time, time).settled


def test_a_constant_has_no_error():
    average = block_average(np.arange(16.0), np.full(16, 2.5))
    assert (average.mean, average.error, average.settled) == (2.5, 0.0, True)


def test_the_start_of_a_run_can_be_left_out():
    time = np.arange(0.0, 10.0, 0.1)
    values = np.where(time < 5.0, 100.0, 1.0 + 0.1 * (-1.0) ** np.arange(100))
    data = xr.DataTree.from_dict(
        {"observables": xr.Dataset({"shear_stress": ("time", values)}, {"time": time})}
    )
    assert_close(average_of(data, "shear_stress", after=4.99, block=0.2).mean, 1.0, rtol=1e-12)
    with pytest.raises(InputError, match="scalar observable"):
        average_of(data, "stress")


@pytest.mark.parametrize("block", [4.0, -1.0, np.nan])
def test_blocks_that_are_too_long_are_refused(block):
    with pytest.raises(InputError, match="block"):
        block_average(np.arange(12.0), np.arange(12.0), block=block)


def test_too_few_or_bad_values_are_refused():
    with pytest.raises(InputError, match="values"):
        block_average(np.arange(3.0), np.arange(3.0))
    with pytest.raises(InputError, match="finite"):
        block_average(np.arange(5.0), np.array([1.0, np.nan, 1.0, 1.0, 1.0]))
