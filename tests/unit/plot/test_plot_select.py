"""Which records and fibers are drawn, and how axes are labelled."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import Variable, lookup
from stokesfibers.plot import select

TIMES = np.linspace(0.0, 10.0, 41)
PEAK = 6.0


def without(run: xr.DataTree, group: str, *names: str) -> xr.DataTree:
    copy = run.copy()
    copy[group] = xr.DataTree(run[group].to_dataset().drop_vars(names))
    return copy


def test_the_nearest_record_stands_for_a_time_once_in_the_order_asked(run):
    picked = select.pick_records(run, [5.13, 2.4, 5.2, 10.0])
    assert picked.tolist() == [21, 10, 40]
    assert select.pick_records(run, 0.12).tolist() == [0]


@pytest.mark.parametrize("times", [[-0.1], [3.0, 10.01], [np.nan], []])
def test_times_outside_the_stored_range_are_refused(times, run):
    with pytest.raises(InputError, match="between 0 and 10") as caught:
        select.pick_records(run, times)
    assert caught.value.where == "times"


def test_rounding_of_the_last_time_is_forgiven(run):
    assert select.pick_records(run, [10.0 * (1 + 1e-12)]).tolist() == [40]


def test_default_records_cover_the_bending_and_hold_its_peak(run):
    picked = select.pick_records(run, None)
    assert len(picked) == 8
    assert np.all(np.diff(picked) > 0)
    times = TIMES[picked]
    assert PEAK in times
    # energy = exp(-2 ((t - 6) / 0.8)^2) of its peak is a tenth 0.86 from the peak; 8 records
    # need one more of those stored every 0.25.
    assert abs(times - PEAK).max() <= 1.0
    assert abs(times.mean() - PEAK) < 0.2


def test_default_records_are_spread_without_energy_or_visible_bending(run):
    even = [0, 8, 16, 24, 32, 40]
    assert select.pick_records(without(run, "observables", "elastic_energy"), None).tolist() == even
    stiff = run.copy(deep=True)
    stiff["observables"]["largest_curvature"][:] *= 1e-3
    assert select.pick_records(stiff, None).tolist() == even
    still = without(run, "observables", "largest_curvature").copy(deep=True)
    still["observables"]["elastic_energy"][:] = 0.0
    assert select.pick_records(still, None).tolist() == even


def test_default_records_are_spread_where_fibers_bend_from_the_start_or_all_along(run):
    even = [0, 8, 16, 24, 32, 40]
    observed = run["observables"]["time"].to_numpy()
    relaxing, tumbling = run.copy(deep=True), run.copy(deep=True)
    relaxing["observables"]["elastic_energy"][:, 0] = np.exp(-20.0 * observed)
    assert select.pick_records(relaxing, None).tolist() == even
    tumbling["observables"]["elastic_energy"][:, 0] = np.sin(0.1 * np.pi * observed) ** 2
    assert select.pick_records(tumbling, None).tolist() == even


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (0.0, "0"),
        (47.616, "47.616"),
        (0.00114, "0.00114"),
        (1e-4, r"1\times10^{-4}"),
        (-2.5e-5, r"-2.5\times10^{-5}"),
        (1.5e9, r"1.5\times10^{9}"),
        (1e10, r"1\times10^{10}"),
    ],
)
def test_numbers_in_formulas(value, written):
    assert select.digits(value) == written


def test_a_short_run_is_drawn_whole(run):
    short = xr.DataTree.from_dict({"/trajectory": run["trajectory"].to_dataset().isel(time=[0, 9])})
    assert select.pick_records(short, None).tolist() == [0, 1]


def test_fibers_are_numbers_that_exist():
    assert select.pick_fibers(3, None).tolist() == [0, 1, 2]
    assert select.pick_fibers(3, [2, 0]).tolist() == [2, 0]
    for bad in (3, -1, [], [0.5]):
        with pytest.raises(InputError, match="from 0 to 2"):
            select.pick_fibers(3, bad)
    with pytest.raises(InputError, match="expected 0, the only fiber, got 3") as caught:
        select.pick_fibers(1, (3,))
    assert "(3,)" not in str(caught.value)
    with pytest.raises(InputError, match="from 0 to 2, got 1, 5"):
        select.pick_fibers(3, [1, 5])


def test_missing_arrays_and_groups_are_named(run):
    with pytest.raises(InputError, match="centre, elastic_energy") as caught:
        select.read(run, "observables", "smallest_gap")
    assert caught.value.where == "observables.smallest_gap"
    with pytest.raises(InputError, match="no group trajectory"):
        select.read(xr.DataTree(), "trajectory", "position")


def test_what_the_store_says_goes_before_the_registry(run):
    assert select.describe(run, "observables", "shear_stress") == lookup(
        "observables", "shear_stress"
    )
    run["observables"]["shear_stress"].attrs["units"] = "pN um"
    told = select.describe(run, "observables", "shear_stress")
    assert (told.unit, told.symbol) == ("pN um", r"\Sigma_{12}")


def test_a_users_observable_is_labelled_by_the_store_or_refused(run):
    dataset = run["observables"].to_dataset()
    dataset["twist"] = ("time", np.ones(101))
    run["observables"] = xr.DataTree(dataset)
    with pytest.raises(InputError, match="twist"):
        select.describe(run, "observables", "twist")
    run["observables"]["twist"].attrs.update(symbol="w", long_name="twist", units="1")
    assert select.axis_label(select.describe(run, "observables", "twist")) == "twist $w$"


@pytest.mark.parametrize(
    ("unit", "meaning", "label"),
    [
        ("1", "count", "count $q$"),
        ("length^-1", "bend", "bend $q$ [length$^{-1}$]"),
        ("time", "time", "time $q$"),
        ("s", "time", "time $q$ [s]"),
        ("force length", "a quantity with a long name", "a quantity with a long name\n$q$ "),
    ],
)
def test_axis_labels(unit, meaning, label):
    variable = Variable("q", "observables", ("time",), unit, "q", meaning)
    assert select.axis_label(variable).startswith(label)


@pytest.mark.parametrize(
    ("count", "picked"),
    [
        (43, [0, 6, 12, 18, 24, 30, 36, 42]),
        (121, [0, 20, 40, 60, 80, 100, 120]),
        (48, [0, 7, 13, 20, 27, 34, 40, 47]),  # 47 is prime
        (5, [0, 1, 2, 3, 4]),
    ],
)
def test_default_records_are_evenly_spaced_where_a_few_fewer_can_be(count, picked):
    data = xr.DataTree.from_dict({"trajectory": xr.Dataset(coords={"time": np.arange(count)})})
    assert select.pick_records(data, None).tolist() == picked
