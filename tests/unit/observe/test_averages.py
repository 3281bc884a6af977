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


@pytest.mark.parametrize("seed", [3, 12, 21, 24])
def test_blocks_are_doubled_until_b_cubed_passes_twice_n_times_the_fourth_power(seed):
    """b^3 > 2 n (error_b / error_1)^4, found anew from the series of means."""
    values, _ = _correlated(2048, 6.0, seed)
    found = block_average(0.25 * np.arange(2048), values)

    def error(size):
        means = values.reshape(-1, size).mean(axis=1)
        return np.sqrt(np.sum((means - means.mean()) ** 2) / (len(means) * (len(means) - 1)))

    sizes = 2 ** np.arange(10)
    passed = [b**3 > 2 * 2048 * (error(b) / error(1)) ** 4 for b in sizes]
    size = sizes[passed.index(True)]
    assert (found.blocks, found.settled) == (2048 // size, True)
    assert_close([found.block, found.error], [0.25 * size, error(size)], rtol=1e-12)


def test_the_mean_is_that_of_all_values_and_the_error_that_of_whole_blocks_at_the_end():
    values = np.array([100.0, -50.0, *range(12)])
    found = block_average(2.0 * np.arange(14), values, block=6.0)
    assert_close([found.mean, found.block], [116.0 / 14.0, 6.0], rtol=1e-14)
    assert found.blocks == 4
    assert_close(found.error, np.std([1.0, 4.0, 7.0, 10.0], ddof=1) / 2.0, rtol=1e-14)


@pytest.mark.parametrize("count", [67, 127, 181, 256])
def test_no_part_of_the_window_is_left_out_of_the_mean(count):
    """A transient at the start, of a length that blocks do not divide."""
    time = np.linspace(0.0, 9.0, count)
    values = 300.0 - 500.0 * np.exp(-2.0 * time)
    assert_close(block_average(time, values).mean, values.mean(), rtol=1e-13)


def test_a_drift_is_not_taken_for_settled():
    time = np.linspace(0.0, 1.0, 257)
    assert not block_average(time, time).settled


def test_halves_that_differ_are_not_taken_for_settled():
    """Values jump once: blocks scatter little, but for those of the other half."""
    values = np.random.default_rng(1).normal(size=1024)
    time = np.arange(1024.0)
    assert block_average(time, values).settled
    assert not block_average(time, values + np.where(time < 512.0, 0.0, 0.5)).settled


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
    from_there = average_of(data, "shear_stress", after=time[60], block=0.2)
    assert from_there.blocks == 20, "the time itself counts"
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
