"""Block averages: errors of correlated values against what is known of them."""

from __future__ import annotations

import json

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


def _waves(end: float, spacing: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(0.0, end + 0.5 * spacing, spacing)
    return time, np.sin(2.0 * np.pi * time / 2.0)


@pytest.mark.parametrize("end", [8.0, 8.5, 9.3, 11.99])
def test_averages_over_whole_periods_of_a_wave_are_exact(end):
    time, wave = _waves(end)
    plain = block_average(time, wave)
    assert plain.error > 0.01
    found = block_average(time, wave, period=2.0)
    assert abs(found.mean) < 1e-12
    assert found.error < 1e-12
    squares = block_average(time, 3.0 + wave**2, period=2.0)
    assert_close(squares.mean, 3.5, rtol=1e-12)
    count = int((end + 0.01) // 2.0)
    assert squares.blocks == count
    # the value at the end of a period belongs to it
    assert_close(1.0 + squares.after, 1.01 + time[-1] - 2.0 * count, rtol=1e-9)


def test_what_changes_from_period_to_period_is_the_error():
    time, wave = _waves(16.0)
    level = np.array([5.0, -1.0, 2.0, 0.0, 1.0, 4.0, -3.0, 0.0])
    values = wave + level[np.minimum(np.ceil(time / 2.0 - 1e-9).astype(int) - 1, 7)]
    found = block_average(time, values, period=2.0, block=2.0)
    assert_close([found.mean, found.block], [1.0, 2.0], rtol=1e-12)
    assert_close(found.error, level.std(ddof=1) / np.sqrt(8.0), rtol=1e-12)
    pairs = block_average(time, values, period=2.0, block=4.0)
    assert_close(pairs.error, level.reshape(4, 2).mean(axis=1).std(ddof=1) / 2.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("end", "spacing", "said"),
    [
        (7.9, 0.01, "at least 4 whole periods of the flow, got 7.9, 3 of 2"),
        (80.0, 0.3, "at least 8 values in each period of the flow, 2, got one each 0.3"),
    ],
)
def test_too_few_periods_or_values_in_one_are_refused(end, spacing, said):
    with pytest.raises(InputError, match=said):
        block_average(*_waves(end, spacing), period=2.0)


def test_a_runs_flow_tells_the_period():
    time, wave = _waves(11.0)
    shear = {"kind": "oscillatory_shear", "amplitude": 1.0, "frequency": 0.5}
    for flow in (shear, {"kind": "sum", "flows": [{"kind": "shear", "rate": 1.0}, shear]}):
        data = xr.DataTree.from_dict(
            {"observables": xr.Dataset({"shear_stress": ("time", wave)}, {"time": time})}
        )
        data.attrs["case"] = json.dumps({"flow": flow})
        assert abs(average_of(data, "shear_stress", after=1.0).mean) < 1e-12
    data.attrs["case"] = json.dumps({"flow": {"kind": "shear", "rate": 1.0}})
    assert abs(average_of(data, "shear_stress", after=1.0).mean) < 0.1
    assert average_of(data, "shear_stress", after=1.0).error > 0.01


def test_periods_that_are_alike_have_settled():
    time = np.arange(0.0, 4.0, 0.1)
    found = block_average(time, 1.0 + np.sin(2.0 * np.pi * time), period=1.0)
    assert found.settled
    assert not block_average(time, time + np.sin(2.0 * np.pi * time), period=1.0).settled


def test_a_gap_longer_than_a_period_is_refused():
    time = np.concatenate([np.arange(0.0, 2.0, 0.1), np.arange(5.0, 8.0, 0.1)])
    with pytest.raises(InputError, match="a gap longer than a period"):
        block_average(time, time, period=1.3)
