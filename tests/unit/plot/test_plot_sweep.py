"""Figures of sweeps: which parameter goes where, what is averaged, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from matplotlib.ticker import FuncFormatter

from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import NATURAL_UNITS
from stokesfibers.plot import save, sweep
from stokesfibers.plot.style import new_panels, time_colours
from stokesfibers.plot.sweep_along import Along, along, label_of
from stokesfibers.plot.sweep_data import cut
from stokesfibers.plot.sweep_select import drawable, stay
from stokesfibers.plot.sweep_units import bracketed, in_natural_units, quotient
from stokesfibers.plot.ticks import log_ticks
from support import assert_close

MU = np.array([1e3, 1e4, 1e5, 1e6])
EPS = np.array([1e-2, 1e-3])
SEEDS = 3


def swept() -> xr.Dataset:
    """Energies mu eps (1 + seed) of one fiber, with a series, a failed and a doubtful case."""
    shape = (len(MU), len(EPS), SEEDS)
    energy = MU[:, None, None] * EPS[:, None] * (1.0 + np.arange(SEEDS))
    status = np.full(shape, "done", dtype=object)
    doubt = np.full(shape, "", dtype=object)
    status[0, 1, :], doubt[2, 0, 1] = "failed", "lengths err"
    energy = np.where(status == "done", energy, np.nan)
    dims = ("mu_bar", "slenderness", "seed")
    said = {
        "long_name": "elastic energy, largest over time",
        "symbol": "E",
        "units": "force length",
    }
    time = np.linspace(0.0, 2.0, 5)
    return xr.Dataset(
        {
            "status": (dims, status),
            "doubt": (dims, doubt),
            "wall_time": (dims, np.ones(shape)),
            "energy_largest": ((*dims, "fiber"), energy[..., None], said),
            "energy_largest_time": ((*dims, "fiber"), energy[..., None]),
            "stress": ((*dims, "time"), energy[..., None] * time),
            "tensor": ((*dims, "i", "j"), np.ones((*shape, 2, 2))),
            "stress_mean": (dims, energy),
            "stress_mean_error": (dims, 0.1 * energy),
            "stress_mean_settled": (dims, np.ones(shape)),
        },
        coords={
            "mu_bar": ("mu_bar", MU, {"symbol": r"\bar\mu", "long_name": "effective viscosity"}),
            "slenderness": ("slenderness", EPS),
            "seed": np.arange(SEEDS),
            "time": ("time", time, {"symbol": "t", "long_name": "time", "units": "time"}),
        },
    )


def test_what_can_be_drawn_starts_with_one_number_for_each_case():
    assert drawable(swept()) == [
        "energy_largest",
        "stress_mean",
        "stress",
        "energy_largest_time",
        "wall_time",
    ]


def test_seeds_become_their_mean_with_its_standard_error():
    found = cut(swept(), None, x=None, at={})
    assert found.x.name == "mu_bar"
    assert found.lines is not None
    assert (found.lines.name, found.lines.texts) == ("slenderness", ["0.01", "0.001"])
    assert found.panels is None
    assert found.errors is not None
    expected = 2.0 * EPS[:, None] * MU
    known = np.isfinite(found.values[0])
    assert np.argwhere(~known).tolist() == [[1, 0]]
    assert_close(found.values[0][known], expected[known], rtol=1e-12)
    assert_close(found.errors[0][known], 0.5 * expected[known] / np.sqrt(3.0), rtol=1e-12)
    assert np.argwhere(found.doubtful[0]).tolist() == [[0, 2]]
    assert found.label == "largest elastic energy $E$ [force length]\nmean over seeds"


def test_a_stored_mean_brings_its_own_error():
    found = cut(swept(), "stress_mean", x=None, at={"seed": "1"})
    assert found.errors is not None
    expected = 2.0 * EPS[:, None] * MU
    assert_close(found.values[0, :, 1:], expected[:, 1:], rtol=1e-12)
    assert_close(found.errors[0, :, 1:], 0.1 * expected[:, 1:], rtol=1e-12)


def test_seeds_can_be_the_axis_and_others_lines_and_panels():
    found = cut(swept(), "stress_mean", x="seed", at={})
    assert (found.x.name, found.lines.name, found.panels.name) == ("seed", "mu_bar", "slenderness")
    assert found.values.shape == (2, 4, 3)
    assert_close(found.values[1, 3], 1e3 * np.array([1.0, 2.0, 3.0]), rtol=1e-12)


def test_one_stays_at_the_nearest_value():
    found = cut(swept(), None, x="slenderness", at={"mu_bar": "9e3", "seed": 2})
    assert found.lines is None
    assert_close(found.values[0, 0], [300.0, 30.0], rtol=1e-12)


def test_series_are_drawn_against_time():
    axes = sweep(swept(), "stress", at={"slenderness": 1e-2})
    assert axes.shape == (1,)
    lines = axes[0].get_lines()
    assert len(lines) == 4
    assert_close(lines[1].get_xydata()[:, 0], [0.0, 0.5, 1.0, 1.5, 2.0], rtol=1e-12)
    assert_close(lines[1].get_ydata()[-1], 2.0 * 2.0 * 100.0, rtol=1e-12)
    assert axes[0].get_xlabel() == "time $t$"


def test_scales_are_logarithmic_where_values_spread_and_doubtful_points_hollow():
    (ax,) = sweep(swept(), "energy_largest")
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    ground = ax.get_facecolor()
    hollow = [
        line
        for line in ax.get_lines()
        if line.get_marker() == "o" and len(line.get_xdata()) and line.get_linestyle() == "None"
    ]
    assert [line.get_xdata().tolist() for line in hollow] == [[1e5]]
    assert_close(
        np.array([int(hollow[0].get_markerfacecolor()[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0,
        ground[:3],
        atol=1e-12,
    )
    (ax,) = sweep(swept(), "energy_largest", x="slenderness", at={"mu_bar": 1e4})
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "linear")


def test_long_names_below_an_axis_are_turned():
    data = swept().isel(slenderness=0, seed=0, drop=True).rename(mu_bar="case")
    names = [f'{{kind = "shear", rate = {k}.0}}' for k in range(3)] + ['{kind = "extension"}']
    (ax,) = sweep(data.assign_coords(case=names))
    ax.figure.draw_without_rendering()
    labels = ax.get_xticklabels()
    assert [text.get_text() for text in labels[2:]] == ["shear, rate = 2.0", "extension"]
    assert {text.get_rotation() for text in labels} == {20.0}
    (ax,) = sweep(data.assign_coords(case=["a", "b", "c", "d"]))
    assert {text.get_rotation() for text in ax.get_xticklabels()} == {0.0}


def test_names_of_cases_are_ticks(tmp_path):
    data = swept().isel(slenderness=0, seed=0, drop=True)
    data = data.rename(mu_bar="case").assign_coords(case=["thin", "thick", "soft", "stiff"])
    (ax,) = sweep(data)
    assert [text.get_text() for text in ax.get_xticklabels()] == ["thin", "thick", "soft", "stiff"]
    assert save(sweep(data), tmp_path / "cases.svg").stat().st_size > 1000


def test_walked_together_a_numeric_coordinate_is_the_axis():
    data = swept().isel(slenderness=0, seed=0, drop=True).rename_dims(mu_bar="sample")
    found = cut(data, None, x=None, at={})
    assert (found.x.name, found.x.symbol) == ("sample", r"$\bar\mu$")
    assert_close(found.x.numbers, MU, rtol=1e-15)


@pytest.mark.parametrize(
    ("name", "options", "where", "said"),
    [
        ("enrgy_largest", {}, "name", "Did you mean 'energy_largest'?"),
        ("tensor", {}, "name", "one of energy_largest"),
        ("stress", {"x": "mu_bar"}, "x", "time, since the variable is a series"),
        (None, {"x": "mu"}, "x", "a swept parameter: mu_bar, slenderness"),
        (None, {"at": {"mu": 1.0}}, "at", "a swept parameter: mu_bar, slenderness, seed"),
        (None, {"at": {"mu_bar": "soft"}}, "at", "a number for mu_bar"),
        (None, {"at": {"mu_bar": 1.0, "slenderness": 1e-3}}, "name", "none is known"),
        (None, {"at": {"mu_bar": 1.0, "slenderness": 1e-3, "seed": 1}}, "at", "a single case"),
    ],
)
def test_what_cannot_be_drawn_is_refused(name, options, where, said):
    with pytest.raises(InputError, match=where) as caught:
        sweep(swept(), name, **options)
    assert said in str(caught.value)
    assert caught.value.where == where


def test_too_many_lines_are_refused():
    many = xr.concat(
        [swept().assign_coords(slenderness=EPS / k) for k in range(1, 8)], "slenderness"
    )
    with pytest.raises(
        InputError, match="at most 12 lines, got 14 values of slenderness"
    ) as caught:
        sweep(many, x="mu_bar")
    assert "x = 'slenderness'" in str(caught.value)


def test_values_that_spread_are_written_as_powers_and_panels_share_their_heights():
    data = swept().isel(seed=0, drop=True)
    found = cut(data, None, x="slenderness", at={})
    assert found.lines.texts == ["$10^{3}$", "$10^{4}$", "$10^{5}$", "$10^{6}$"]
    axes = sweep(data, "stress")
    assert [ax.get_title(loc="left") for ax in axes] == [
        "slenderness = 0.01",
        "slenderness = 0.001",
    ]
    assert axes[0].get_ylim() == axes[1].get_ylim()
    assert axes[0].get_ylim()[1] > 2e4


def test_series_of_seeds_have_a_band_and_their_label_says_what_was_averaged():
    data = swept().isel(slenderness=0, drop=True)
    (ax,) = sweep(data, "stress", at={"mu_bar": 1e3})
    (band,) = ax.collections
    low, high = band.get_paths()[0].get_extents().intervaly
    assert_close([low, high], [0.0, 2.0 * (20.0 + 10.0 / np.sqrt(3.0))], atol=1e-9)
    data["stress_mean"].attrs = {"long_name": "stress, mean over time", "symbol": "S"}
    assert cut(data, "stress_mean", x=None, at={}).label == "mean stress $S$\nmean over seeds"


def with_own_times() -> xr.Dataset:
    """A series at other times in each case, as sweeps of until or dt have it."""
    data = swept().isel(slenderness=0, seed=0, drop=True)
    times = np.arange(5.0) * np.array([1.0, 2.0, 0.5, 1.0])[:, None]
    times[2, 3:] = np.nan
    stress = np.where(np.isfinite(times), 1.0 + times, np.nan)
    data = data.drop_vars(["stress", "time"])
    said = {"symbol": "t", "long_name": "time", "units": "time"}
    data["stress"] = (("mu_bar", "record"), stress)
    data["time"] = (("mu_bar", "record"), times, said)
    return data


def test_series_with_times_of_their_own_are_drawn_at_these():
    (ax,) = sweep(with_own_times(), "stress")
    for line, count, step in zip(ax.get_lines(), (5, 5, 3, 5), (1.0, 2.0, 0.5, 1.0), strict=True):
        assert_close(line.get_xdata(), step * np.arange(count), rtol=1e-12)
        assert_close(line.get_ydata(), 1.0 + step * np.arange(count), rtol=1e-12)
    assert ax.get_xlabel() == "time $t$"


def test_seeds_recorded_at_other_times_have_no_mean():
    data = with_own_times().rename(mu_bar="seed").assign_coords(seed=np.arange(4))
    with pytest.raises(InputError, match="recorded at different times"):
        sweep(data, "stress")
    (ax,) = sweep(data, "stress", at={"seed": 1})
    assert_close(ax.get_lines()[0].get_xdata(), 2.0 * np.arange(5), rtol=1e-12)


def test_points_are_joined_in_order_of_the_axis():
    (ax,) = sweep(swept().isel(mu_bar=[2, 0, 3, 1]), "stress_mean", at={"seed": 0})
    assert ax.get_lines()[0].get_xdata().tolist() == MU.tolist()


def test_parameters_walked_together_are_drawn_along_one_that_tells_cases_apart():
    data = swept().isel(slenderness=0, seed=0, drop=True).rename_dims(mu_bar="ab")
    data = data.drop_vars("mu_bar").assign_coords(
        a=("ab", [1.0, 1.0, 2.0, 2.0]), b=("ab", [4.0, 3.0, 2.0, 1.0])
    )
    found = cut(data, None, x=None, at={})
    assert (found.x.symbol, found.x.values) == ("b", (4.0, 3.0, 2.0, 1.0))
    found = cut(data, None, x="a", at={})
    assert (found.x.name, found.x.symbol, found.x.values) == ("ab", "a", (1.0, 1.0, 2.0, 2.0))
    assert_close(found.places[0, 0], [1.0, 1.0, 2.0, 2.0], rtol=1e-15)
    with pytest.raises(InputError, match="a single case"):
        sweep(data, at={"b": 2.2})


def test_panels_and_lines_of_failed_cases_spoil_no_others():
    data = swept().isel(seed=0, drop=True)
    small = data["stress_mean"].where(data["slenderness"] > 5e-3) * 1e-9
    data["stress_mean"] = small.where(data["mu_bar"] < 5e5)
    data["stress_mean_error"] *= 1e-9
    axes = sweep(data, "stress_mean", x="mu_bar")
    assert len(axes) == 1
    axes = sweep(data.expand_dims(c=["p", "q"]), "stress_mean", x="mu_bar")
    assert axes[0].get_ylim()[1] < 1e-5
    texts = [text.get_text() for text in axes[-1].get_legend().get_texts()]
    assert len(texts) == 2
    alone = sweep(data.transpose("slenderness", ...), "stress_mean", x="slenderness")
    assert alone[0].get_ylim()[1] < 1e-5


def test_a_parameter_that_some_cases_lack_is_written_as_none():
    data = swept().isel(seed=0, drop=True).assign_coords(slenderness=[1.0, np.nan])
    data = data.isel(mu_bar=slice(1, 4))
    found = cut(data, "stress_mean", x="mu_bar", at={})
    assert found.lines.texts == ["1", "none"]
    wide = xr.concat([data.assign_coords(slenderness=[1.0, np.nan]), data], "slenderness")
    wide = wide.isel(slenderness=[0, 1, 2]).assign_coords(slenderness=[1.0, np.nan, 100.0])
    assert cut(wide, "stress_mean", x="mu_bar", at={}).lines.texts == ["1", "none", "100"]
    assert len(sweep(wide, "stress_mean", x="mu_bar")[0].get_legend().get_texts()) == 3


def test_a_mean_that_lacks_a_seed_is_marked_and_said():
    data = swept().isel(slenderness=0, drop=True)
    data["stress_mean"] = data["stress_mean"].where((data["mu_bar"] < 1e6) | (data["seed"] != 1))
    data["doubt"] = data["doubt"].where(False, "")
    found = cut(data, "stress_mean")
    assert found.doubtful[0, 0].tolist() == [False, False, False, True]
    assert found.notes == (
        "1 of 4 results drawn cannot be trusted, lack a seed or have not settled; they are hollow",
    )
    (ax,) = sweep(data, "stress_mean")
    assert ax.get_lines()[-1].get_xdata().tolist() == [1e6]
    data["stress_mean_settled"][0, 0] = 0.0
    assert cut(data, "stress_mean").doubtful[0, 0].tolist() == [True, False, False, True]


def test_doubtful_series_are_dashed():
    data = swept().isel(slenderness=0, drop=True)
    found = cut(data, "stress")
    assert found.notes == (
        "1 of 4 results drawn cannot be trusted, lack a seed or have not settled; they are dashed",
    )
    (ax,) = sweep(data, "stress")
    assert [line.get_linestyle() for line in ax.get_lines()] == ["-", "-", "--", "-"]


def test_fibers_have_a_mean_without_an_error():
    data = swept().isel(slenderness=0, seed=0, fiber=0, drop=True)
    data["pair"] = data["stress_mean"] * xr.DataArray([1.0, 3.0], dims="fiber")
    found = cut(data, "pair")
    assert found.errors is None
    assert_close(found.values[0, 0], 2.0 * 1e-2 * MU, rtol=1e-12)
    assert found.label.endswith("mean over fibers")


def test_what_stays_is_named_and_what_divides_is_in_the_label():
    data = swept().isel(seed=0, drop=True)
    (ax,) = sweep(data, "energy_largest", at={"mu_bar": 9e3}, x="slenderness")
    assert ax.get_title(loc="left") == r"$\bar\mu$ = $10^{4}$"
    found = cut(data, "energy_largest", per="mu_bar", at={"slenderness": 1e-2})
    assert_close(found.values[0, 0], np.full(4, 1e-2), rtol=1e-12)
    assert found.label == "largest elastic energy\n$E / \\bar\\mu$ [force length]"
    found = cut(data, "stress_mean", per="mu_bar", at={"slenderness": 1e-2})
    assert found.errors is not None
    assert_close(found.errors[0, 0], np.full(4, 1e-3), rtol=1e-12)
    axes = sweep(data, "stress", at={"slenderness": 1e-3, "mu_bar": 1e5})
    assert axes[0].get_title(loc="left") == r"slenderness = 0.001, $\bar\mu$ = $10^{5}$"
    with pytest.raises(InputError, match="per: expected a swept parameter"):
        sweep(data, "stress", per="mu")


@pytest.mark.parametrize(
    ("values", "is_log", "texts"),
    [
        (
            (2e4, 58480.4, 170998.0, 5e5),
            True,
            [r"$2\times10^{4}$", r"$5.85\times10^{4}$", r"$1.71\times10^{5}$", r"$5\times10^{5}$"],
        ),
        ((1.0, 2.0, 3.0, 4.0, 5.0), False, ["1", "2", "3", "4", "5"]),
        ((1.0001, 1.0002), False, ["1.0001", "1.0002"]),
        ((1.0, 40.0), True, ["1", "40"]),
        ((1e4, 1.5e5), False, ["$10^{4}$", r"$1.5\times10^{5}$"]),
        (('{kind = "shear", rate = 1.0}', '{kind = "extension"}'), False, ["shear", "extension"]),
        (('{kind = "planar_extension"}', '{kind = "a"}'), False, ["planar extension", "a"]),
        (
            ('{kind = "shear", rate = 1.0}', '{kind = "shear"}'),
            False,
            ["shear, rate = 1.0", "shear"],
        ),
        (("[1, 2]", '{file = "a"}'), False, ["[1, 2]", '{file = "a"}']),
    ],
)
def test_values_are_written_as_short_as_tells_them_apart(values, is_log, texts):
    found = Along("a", "a", values, "a", "a")
    assert found.is_log is is_log
    assert found.texts == texts


def test_scales_can_be_chosen_and_long_names_stand_above():
    data = swept().isel(seed=0, drop=True)
    (ax,) = sweep(data, "energy_largest", log="x")
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "linear")
    (ax,) = sweep(data, "energy_largest", log="")
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "linear")
    with pytest.raises(InputError, match="log: expected x, y, xy or nothing"):
        sweep(data, log="z")
    names = ["a name that is longer than most others", "b"]
    (ax,) = sweep(data.assign_coords(slenderness=names), "energy_largest", x="mu_bar")
    ax.figure.draw_without_rendering()
    assert ax.get_legend().get_window_extent().y0 > ax.get_window_extent().y1
    assert ax.get_window_extent().width > 0.6 * ax.figure.bbox.width


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (1e-8, 1e2, [1e-8, 1e-6, 1e-4, 1e-2, 1e0, 1e2]),
        (5e-9, 3e2, [1e-8, 1e-6, 1e-4, 1e-2, 1e0, 1e2]),
        (1.5e3, 2e5, [3e3, 1e4, 3e4, 1e5]),
        (1.8e5, 9e5, [2e5, 3e5, 5e5, 7e5]),
        (0.028, 0.11, [0.03, 0.05, 0.07, 0.1]),
        (0.9e3, 1.1e6, [1e3, 1e4, 1e5, 1e6]),
        (6.1e5, 7.9e5, [6.6e5, 7.2e5, 7.8e5]),
    ],
)
def test_log_axes_have_three_to_six_numbers(low, high, ticks):
    assert_close(log_ticks(low, high), ticks, rtol=1e-9)
    wide = np.log10(log_ticks(low, high, gap=0.24))
    assert np.diff(wide).min() >= 0.16 * np.log10(high / low)


def test_numbers_of_a_log_axis_do_not_overlap():
    data = swept().isel(seed=0, drop=True).assign_coords(mu_bar=[2e5, 4e5, 6e5, 8e5])
    (ax,) = sweep(data, "energy_largest", x="mu_bar", log="xy")
    ax.figure.draw_without_rendering()
    for axis, side in ((ax.xaxis, "x"), (ax.yaxis, "y")):
        boxes = [label.get_window_extent() for label in axis.get_ticklabels() if label.get_text()]
        low, high = (np.array([getattr(b, f"{side}{k}") for b in boxes]) for k in (0, 1))
        assert len(boxes) >= 3
        assert np.all(np.sort(low)[1:] > np.sort(high)[:-1])
        assert not any(text.get_text() for text in axis.get_ticklabels(minor=True))


def test_the_first_number_of_the_sweep_file_is_drawn_by_itself():
    data = swept()
    for lists, first in (
        ({"series": ["stress"], "mean": ["stress"], "largest": ["energy"]}, "stress_mean"),
        ({"largest": ["energy"], "mean": ["stress"]}, "energy_largest"),
    ):
        data.attrs["collect"] = json.dumps({**lists, "after": 0.0})
        assert drawable(data)[0] == first


@pytest.mark.parametrize("taken", ["largest", "smallest", "final", "mean"])
def test_a_name_may_be_turned_round(taken):
    data = swept().isel(seed=0, drop=True)
    data[f"energy_{taken}"] = data["energy_largest"]
    label = cut(data, f"energy_{taken}").label
    assert cut(data, f"{taken}_energy").label == label
    if taken == "largest":
        data = data.rename({"energy_largest": "largest_energy_final"})
        assert cut(data, "largest_energy").label == cut(data, "final_largest_energy").label
        data["largest_energy_mean"] = data["largest_energy_final"]
        with pytest.raises(InputError, match="got 'largest_energy'"):
            cut(data, "largest_energy")
    with pytest.raises(InputError, match="'energy_other'"):
        cut(data, "energy_other")


def test_numbers_that_are_all_the_same_are_noise():
    data = swept().isel(seed=0, slenderness=0, drop=True)
    for spread, alike in ((2e-6, False), (5e-7, True)):
        data["stress_mean"] = ("mu_bar", 1.0 + spread * np.arange(4) / 3.0)
        notes = cut(data, "stress_mean").notes
        assert any("the same to a part in a million" in note for note in notes) is alike


def test_numbers_that_differ_by_little_are_written_out():
    """An axis whose numbers are to be added to one at its end is read wrongly."""
    data = swept().isel(seed=0, slenderness=0, drop=True).drop_vars("stress_mean_error")
    data["stress_mean"] = ("mu_bar", [0.99997, 0.99998, 0.99999, 1.0])
    (ax,) = sweep(data, "stress_mean", log="x")
    ax.figure.canvas.draw()
    assert ax.yaxis.get_offset_text().get_text() == ""
    assert "0.99998" in "".join(text.get_text() for text in ax.get_yticklabels())


def test_where_another_moment_gives_the_value_is_said():
    """Between mu_bar = 1e4 and 1e5 the largest energy moves from a tenth to nine of the run."""
    data = swept().isel(seed=0, fiber=0, drop=True)
    data["time_reached"] = data["wall_time"] * 10.0
    data["energy_largest"] = data["mu_bar"] / 1e6 + 2.0 * data["slenderness"]
    moved = [[1.0, 2.0], [1.2, 2.0], [9.0, 2.5], [9.1, 3.0]]
    data["energy_largest_time"] = (("mu_bar", "slenderness"), moved)
    (note,) = [n for n in cut(data, "energy_largest").notes if "moment" in n]
    told = "between mu_bar = 1e+04 and 1e+05 (slenderness = 0.01) another moment of the run gives"
    assert note.startswith(told)
    # where a place along the axis is not known, nothing is drawn
    gap = data.assign_coords(pace=("mu_bar", [1.0, 2.0, np.nan, 4.0]))
    (other,) = [n for n in cut(gap, "energy_largest", x="pace").notes if "moment" in n]
    assert other.startswith("between pace = 2 and 4")
    last = gap.assign_coords(pace=("mu_bar", [1.0, 2.0, np.nan, np.nan]))
    assert not [n for n in cut(last, "energy_largest", x="pace").notes if "moment" in n]
    named = data.assign_coords(pace=("mu_bar", [1.0, 2.0, 3.0, 4.0]))
    (other,) = [n for n in cut(named, "energy_largest", x="pace").notes if "moment" in n]
    assert other.startswith("between pace = 2 and 3")
    assert "other line" not in note
    # backwards, and not sorted, it is the same place
    turned = data.isel(mu_bar=[3, 1, 0, 2])
    assert note in cut(turned, "energy_largest").notes
    both = np.array(moved)
    both[2:, 1] = 8.0
    data["energy_largest_time"] = (("mu_bar", "slenderness"), both)
    assert any("and in 1 other line" in n for n in cut(data, "energy_largest").notes)
    flat = data.assign(energy_largest=1.0 + 1e-3 * data["energy_largest"])
    flat["energy_largest"][-1] = 2.0  # elsewhere there is nothing to see
    assert not any("moment" in n for n in cut(flat, "energy_largest").notes)
    # the first and the last time are told by their own notes
    ends = np.where(np.array(moved) > 5.0, 10.0, np.array(moved))
    data["energy_largest_time"] = (("mu_bar", "slenderness"), ends)
    assert not any("moment" in n for n in cut(data, "energy_largest").notes)


@pytest.mark.parametrize(("after", "first"), [(0.0, 2), (0.5, 3)])
def test_values_of_the_first_and_the_last_time_are_counted(after, first):
    """There nothing grew, or it may grow on."""
    data = swept().isel(seed=0, slenderness=0, fiber=0, drop=True)
    data["energy_largest_time"] = ("mu_bar", [0.0, 0.0, 0.5, 3.0])
    data["time_reached"] = ("mu_bar", [4.0, 4.0, 4.0, 3.0])
    data.attrs["collect"] = json.dumps({"largest": ["energy"], "after": after})
    notes = cut(data, "energy_largest").notes
    assert f"{first} of 4 values are those of the first time" in notes
    assert "1 of 4 values are those of the last time" in notes
    data["energy_largest_time"] = ("mu_bar", [0.6, 1.0, np.nan, 2.9])
    assert not any("of the" in note for note in cut(data, "energy_largest").notes)


def test_axes_of_a_figure_of_one_s_own():
    data = swept().isel(seed=0, drop=True)
    panels = new_panels(1, 2, width=7.0, height=2.0)
    (drawn,) = sweep(data, "energy_largest", ax=panels[0, 1])
    assert drawn is panels[0, 1]
    assert len(drawn.get_lines()) >= 2
    assert not panels[0, 0].get_lines()
    with pytest.raises(InputError, match="no axes for several panels"):
        sweep(swept(), "energy_largest", x="seed", ax=panels[0, 0])


def test_what_has_components_is_refused_by_name():
    with pytest.raises(InputError, match="It has components: stay at one, such as i = 1, j = 1"):
        cut(swept(), "tensor")
    with pytest.raises(InputError, match="such as j = 1"):
        cut(swept(), "tensor", at={"i": 0})


def test_one_component_or_fiber_is_drawn():
    data = swept().isel(seed=0, slenderness=0, drop=True)
    part = np.arange(8.0).reshape(4, 2, 1) + np.array([0.0, 100.0])
    data = data.drop_vars(["energy_largest", "energy_largest_time"]).assign_coords(space=["x", "y"])
    data["pull"] = (("mu_bar", "fiber", "space"), part)
    found = cut(data, "pull", at={"space": "y", "fiber": "1"})
    assert_close(found.values[0, 0], part[:, 1, 1])
    assert found.held == ("y", "fiber 1")
    assert "mean over" not in found.label
    found = cut(data, "pull", at={"space": "x"})
    assert_close(found.values[0, 0], part[:, :, 0].mean(axis=1))
    assert found.held == ("x",)


@pytest.mark.parametrize(
    ("name", "at", "says"),
    [
        ("pull", {"space": "z"}, "space to be one of x, y, got 'z'"),
        ("pull", {"space": "y", "fiber": 7}, "fiber to be one of 0 to 6, got '7'"),
        ("pull", {"space": "y", "fiber": 1.5}, "fiber to be one of 0 to 6"),
        ("stress_mean", {"space": "y"}, "stress_mean having no space"),
        ("stress_mean", {"node": 1}, "a swept parameter: mu_bar, fiber, i, j, space"),
    ],
)
def test_components_and_fibers_that_are_not_there_are_refused(name, at, says):
    data = swept().isel(seed=0, slenderness=0, drop=True)
    data = data.drop_vars(["energy_largest", "energy_largest_time"]).assign_coords(space=["x", "y"])
    data["pull"] = (("mu_bar", "fiber", "space"), np.ones((4, 7, 2)))
    with pytest.raises(InputError, match=says):
        cut(data, name, at=at)


@pytest.mark.parametrize(
    ("unit", "written", "said"),
    [
        ("force length", r"E \, L / E", "$E / L$"),
        ("force", r"E \, L^{2} / E", "$E / L^{2}$"),
        ("force length^-2", r"E \, L^{4} / E", "$E / L^{4}$"),
        ("length", "E / L", "$L$"),
        ("length^-1", r"E \, L", "$1 / L$"),
        ("force length^2", "E / E", "$E$"),
        ("force^2 length^4", "E / E^{2}", "$E^{2}$"),
        ("force^-1 length", r"E \, E / L^{3}", r"$L^{3} / E$"),
        ("time", r"\dot\gamma \, E", r"$1 / \dot\gamma$"),
        ("time^-1", r"E / \dot\gamma", r"$\dot\gamma$"),
        ("length time^-1", r"E / (\dot\gamma \, L)", r"$\dot\gamma \, L$"),
    ],
)
def test_symbols_are_over_natural_scales_where_the_dataset_says_so(unit, written, said):
    data = swept()
    data["energy_largest"].attrs["units"] = unit
    assert in_natural_units(data) is data
    half = data.assign_attrs(unit_of_length="L")
    assert in_natural_units(half) is half
    data.attrs |= NATURAL_UNITS | {"unit_of_time": "1/rate"}
    found = in_natural_units(data)["energy_largest"].attrs
    assert (found["symbol"], found["units"]) == (written, "1")
    assert data["energy_largest"].attrs["units"] == unit
    del data["energy_largest"].attrs["symbol"]
    assert in_natural_units(data)["energy_largest"].attrs["units"] == said


def test_units_without_a_rate_keep_the_time():
    data = swept().assign_attrs(NATURAL_UNITS)
    for unit, said in (
        ("time", "time"),
        ("force time length^-2", "$E / L^{4}$ time"),
        ("rad", "rad"),
        ("1", "1"),
    ):
        data["energy_largest"].attrs["units"] = unit
        found = in_natural_units(data)["energy_largest"].attrs
        assert (found["symbol"], found["units"]) == ("E", said)
    data["energy_largest"].attrs["units"] = "force"
    assert cut(data, "energy_largest").label.startswith(r"largest elastic energy $E \, L^{2} / E$")
    assert cut(data, "stress", at={"seed": 0}).x.label == "time $t$"
    data.attrs["unit_of_time"] = "1/|amplitude|"
    label = cut(data, "stress", at={"seed": 0}).x.label
    assert label == r"time $|\dot\gamma_0| \, t$"


def test_lines_have_markers_of_their_own_and_numbers_as_they_are_written():
    data = swept().isel(seed=0, drop=True)
    (ax,) = sweep(data, "energy_largest", x="slenderness")
    assert len({line.get_marker() for line in ax.get_lines()} - {"none"}) == len(MU)
    lightest = ax.get_legend().legend_handles[-1].get_color()
    assert lightest == time_colours(np.array([0.0, 0.88, 1.0]))[1]
    data = data.assign_coords(mu_bar=[0.1, 0.2, 0.4, 9.0])
    (ax,) = sweep(data, "energy_largest", x="slenderness")
    said = [text.get_text() for text in ax.get_legend().get_texts()]
    assert said == ["0.1", "0.2", "0.4", "9"]


@pytest.mark.parametrize(
    ("said", "label"),
    [
        ("elastic energy, smallest over time", "smallest elastic energy $E$"),
        ("elastic energy, at the end", "final elastic energy $E$"),
        ("largest curvature, largest over time", "largest curvature $E$"),
        ("elastic energy, mean over time", "mean elastic energy $E$"),
        (
            "elastic energy, mean over time and fibers and seeds",
            "mean elastic energy $E$\nmean over fibers and seeds",
        ),
        ("extra stress, all fibers", "extra stress $E$\nall fibers"),
    ],
)
def test_what_was_taken_of_a_quantity_stands_before_it(said, label):
    held = xr.DataArray(np.ones(2), attrs={"long_name": said, "symbol": "E"})
    assert label_of(held, "any") == label


def test_a_long_legend_title_is_the_symbol_with_its_unit():
    attrs = {"symbol": r"\theta_0", "long_name": "initial angle to the x-axis", "units": "rad"}
    data = swept().isel(seed=0, drop=True).rename(slenderness="angle")
    data["angle"] = data["angle"].assign_attrs(attrs)
    (ax,) = sweep(data, "energy_largest", x="mu_bar")
    assert ax.get_legend().get_title().get_text() == r"$\theta_0$ [rad]"


@pytest.mark.parametrize(
    ("unit", "by", "said"),
    [
        ("force length", "force", "length"),
        ("force", "length^2", "force length^-2"),
        ("force length^-2", "length^-2", "force"),
        ("1", "time^-1", "time"),
        ("length", "1", "length"),
        ("time", "time", "1"),
    ],
)
def test_the_unit_of_a_quotient(unit, by, said):
    assert quotient(unit, by) == said


def test_what_divides_divides_the_unit_too():
    data = swept().isel(seed=0, drop=True).rename(slenderness="length")
    data["length"] = data["length"].assign_attrs(symbol="L", units="length")
    said = {"x": "mu_bar", "per": "length"}
    assert cut(data, "energy_largest", **said).label == "largest elastic energy $E / L$ [force]"
    data.attrs |= NATURAL_UNITS
    label = cut(data, "energy_largest", **said).label
    assert label == r"largest elastic energy $E \, L^{2} / (L \, E)$"
    assert cut(data, "energy_largest", x="mu_bar").label.endswith(r"$E \, L / E$")
    assert along(data, "length").unit == " [length]"
    assert cut(data, "energy_largest", at={"length": 1e-2}).held == ("$L / L$ = 0.01",)
    del data.attrs["unit_of_length"]
    assert cut(data, "energy_largest", at={"length": 1e-2}).held == ("$L$ = 0.01 [length]",)
    axes = sweep(data, "energy_largest", x="mu_bar")
    assert len(axes) == 1
    axes = sweep(data, "stress")
    assert [ax.get_title(loc="left") for ax in axes] == [f"$L$ = {x} [length]" for x in EPS]


def walked_together() -> xr.Dataset:
    data = swept().isel(slenderness=0, seed=0, drop=True).rename_dims(mu_bar="ab")
    return data.drop_vars("mu_bar").assign_coords(
        a=("ab", [1.0, 1.0, 2.0, 2.0]), b=("ab", [4.0, 3.0, 4.0, 3.0])
    )


def test_a_case_of_lists_walked_together_is_told_by_all_their_values():
    one, held = stay(walked_together(), ["ab"], {"b": "3.1", "a": 2})
    assert one["energy_largest"].item() == swept()["energy_largest"][3, 0, 0].item()
    assert held == ("b = 3", "a = 2")


@pytest.mark.parametrize(
    ("at", "said"),
    [
        ({"a": 2.0}, "values of one case, by a, b, got a = 2.0, which fits 2 values of ab"),
        ({"ab": 2.0}, "one of a, b, got 'ab'"),
    ],
)
def test_what_tells_no_single_case_is_refused(at, said):
    with pytest.raises(InputError, match="at: ") as caught:
        stay(walked_together(), ["ab"], at)
    assert said in str(caught.value)


def test_lists_walked_together_of_which_none_tells_cases_apart_are_named_by_all():
    data = walked_together()
    data["a"].attrs = {"symbol": r"\theta_0", "units": "rad"}
    (ax,) = sweep(data, "energy_largest")
    assert ax.get_xlabel() == r"$\theta_0$ [rad], b"
    assert [text.get_text() for text in ax.get_xticklabels()] == ["1, 4", "1, 3", "2, 4", "2, 3"]
    (ax,) = sweep(data, "stress")
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["1, 4", "1, 3", "2, 4", "2, 3"]
    named = data.assign_coords(c=("ab", ["p", "q", "r", "s"]))
    assert along(named, "ab").texts == ["p", "q", "r", "s"]
    assert along(named, "ab", "a").texts == ["1", "1", "2", "2"]
    numbered = named.assign_coords(n=("ab", [4.0, 2.0, 3.0, 1.0]))
    assert along(numbered, "ab").symbol == "n"


def test_lines_along_which_nothing_varies_are_told_and_no_kink_in_noise():
    data = swept().isel(seed=0, fiber=0, drop=True)
    noise = 1.0 + 1e-9 * np.array([0.0, 1.0, 3.0, 2.0])
    data["energy_largest"] = (("mu_bar", "slenderness"), np.stack([noise, 1.0 + MU / 1e7], axis=1))
    data["time_reached"] = data["wall_time"] * 10.0
    moved = np.array([[1.0, 2.0], [1.2, 2.0], [9.0, 2.0], [9.1, 2.0]])
    data["energy_largest_time"] = (("mu_bar", "slenderness"), moved)
    told = "along 1 of 2 lines values are the same to a part in a million"
    assert cut(data, "energy_largest").notes == (told,)
    (note,) = cut(data, "energy_largest", at={"slenderness": 1e-2}).notes
    assert note == "all values of energy_largest are the same to a part in a million"


@pytest.mark.parametrize("value", [1.0, -2.0])
def test_what_does_not_vary_is_flat(value):
    data = swept().isel(seed=0, slenderness=0, drop=True)
    data["stress_mean"] = ("mu_bar", value * (1.0 + 1e-11 * np.arange(4)))
    (ax,) = sweep(data, "stress_mean")
    assert_close(ax.get_ylim(), value + 0.1 * np.array([-1.0, 1.0]) * abs(value), rtol=1e-9)


def test_tables_are_told_by_their_kinds():
    names = ['{kind = "none"}', '{kind = "steric", stiffness = 2.0}']
    data = swept().assign_coords(slenderness=names)
    one, held = stay(data, ["mu_bar", "slenderness", "seed"], {"slenderness": "steric"})
    assert one["slenderness"].item() == names[1]
    assert held == ("slenderness = steric",)
    shears = ['{kind = "shear"}', '{kind = "shear", rate = 2.0}', '{kind = "none"}', '{kind = "x"}']
    data = data.assign_coords(mu_bar=shears)
    one, _ = stay(data, ["mu_bar", "slenderness", "seed"], {"mu_bar": "none"})
    assert one["mu_bar"].item() == shears[2]
    one, _ = stay(data, ["mu_bar", "slenderness", "seed"], {"mu_bar": "shear"})
    assert one["mu_bar"].item() == shears[0]
    with pytest.raises(InputError, match="mu_bar = shear, which fits 2 values"):
        stay(data.isel(mu_bar=[1, 1, 2]), ["mu_bar", "slenderness", "seed"], {"mu_bar": "shear"})
    lists = data.assign_coords(slenderness=["[2, 2, 2]", "[3, 2, 2]"])
    for typed in ("3,2,2", "[3,2,2]", [3, 2, 2]):
        one, _ = stay(lists, ["mu_bar", "slenderness", "seed"], {"slenderness": typed})
        assert one["slenderness"].item() == "[3, 2, 2]"
    with pytest.raises(InputError, match="slenderness to be one of none, steric"):
        stay(data, ["mu_bar", "slenderness", "seed"], {"slenderness": "hard"})


def test_lines_are_named_by_a_coordinate_beside_their_own():
    data = swept().isel(seed=0, drop=True)
    attrs = {"long_name": "strain of half a cycle", "symbol": r"\gamma", "units": "1"}
    data = data.assign_coords(flow_strain=("slenderness", [3.0, 5.0], attrs))
    assert cut(data, "energy_largest").lines.values == tuple(EPS)
    named = cut(data, "energy_largest", by="flow_strain").lines
    assert (named.values, named.label) == ((3.0, 5.0), r"strain of half a cycle $\gamma$")
    (ax,) = sweep(data, "energy_largest", by="flow_strain", label="up", xlabel="along", legend="so")
    title = ax.get_legend().get_title().get_text()
    assert (ax.get_ylabel(), ax.get_xlabel(), title) == ("up", "along", "so")
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["3", "5"]
    with pytest.raises(InputError, match="parameter: slenderness, flow_strain, got"):
        cut(data, "energy_largest", by="other")
    with pytest.raises(InputError, match=r"by: expected a coordinate of lines .*Take x = 'mu_bar'"):
        cut(data, "energy_largest", by="mu_bar")
    with pytest.raises(InputError, match="by: expected a figure with several lines"):
        cut(data.isel(slenderness=0), "energy_largest", by="flow_strain")


def oscillating() -> xr.Dataset:
    """Lists walked together, by the name ``pace``; coordinates in the order of a store."""
    data = walked_together().rename_dims(ab="pace").drop_vars(["a", "b"])
    strain = {"symbol": r"\gamma", "derived": "amplitude / (pi frequency)"}
    return data.assign_coords(
        flow_strain=("pace", [4.0, 3.0, 2.0, 1.0], strain),
        frequency=("pace", [1.0, 2.0, 3.0, 4.0]),
        until=("pace", [8.0, 7.0, 6.0, 5.0]),
    )


def test_what_follows_from_parameters_is_drawn_along_only_where_it_is_named():
    data = oscillating()
    assert cut(data, "energy_largest").x.parameter == "frequency"
    assert cut(data, "energy_largest", x="flow_strain").x.parameter == "flow_strain"
    plain = data.drop_vars("until")
    (held,) = cut(plain.expand_dims(b=[1.0, 2.0]), "stress_mean", at={"pace": 2.1}).held
    assert held == "frequency = 2"
    both = data.drop_vars("until").assign_coords(frequency=("pace", [1.0, 1.0, 2.0, 2.0]))
    both = both.assign_coords(amplitude=("pace", [1.0, 2.0, 1.0, 2.0]))
    assert along(both, "pace").parameter == "frequency, amplitude"


def test_lines_may_have_places_of_their_own_along_an_axis():
    data = swept().isel(seed=0, drop=True)
    places = MU[:, None] / np.array([10.0, 20.0])
    said = {"symbol": r"\eta", "long_name": "this", "derived": "mu_bar / abs(c)"}
    data = data.assign_coords(eta=(("mu_bar", "slenderness"), places, said))
    found = cut(data, "energy_largest", x="eta")
    assert (found.x.name, found.x.parameter, found.x.label) == ("mu_bar", "eta", r"this $\eta$")
    assert_close(found.places[0], places.T, rtol=1e-15)
    assert found.lines.name == "slenderness"
    (ax,) = sweep(data, "energy_largest", x="eta")
    assert_close(ax.get_lines()[0].get_xdata(), places[:, 0], rtol=1e-15)
    assert ax.get_xscale() == "log"
    one = cut(data, "energy_largest", x="eta", at={"slenderness": 1e-3})
    assert_close(one.places[0, 0], places[:, 1], rtol=1e-15)
    assert cut(data, "energy_largest").x.parameter == "mu_bar"
    with pytest.raises(InputError, match="parameter: mu_bar, slenderness, eta, got 'etta'"):
        cut(data, "energy_largest", x="etta")
    with pytest.raises(InputError, match="by: expected a swept parameter: slenderness, got"):
        cut(data, "energy_largest", by="eta")


def test_the_first_parameter_of_the_file_names_an_axis_whatever_the_order_of_the_store():
    data = oscillating()
    assert (
        along(data.assign_attrs(parameters='["until", "frequency"]'), "pace").parameter == "until"
    )
    assert along(data, "pace").parameter == "frequency"


@pytest.mark.parametrize(
    ("symbol", "factor"),
    [
        ("N_1", "N_1"),
        (r"\mathbf{x}(L)-\mathbf{x}(0)", r"(\mathbf{x}(L)-\mathbf{x}(0))"),
        (r"\eta_r - 1", r"(\eta_r - 1)"),
        (r"\langle x^{a+b} \rangle", r"\langle x^{a+b} \rangle"),
        ("(a - b)", "(a - b)"),
        ("|a - b|", "|a - b|"),
        ("(a - b) + c", "((a - b) + c)"),
    ],
)
def test_differences_are_bracketed_before_they_are_divided(symbol, factor):
    assert bracketed(symbol) == factor
    data = swept().isel(seed=0, drop=True).assign_attrs(NATURAL_UNITS)
    said = {"symbol": symbol, "units": "length", "long_name": "this"}
    data["stress_mean"] = data["stress_mean"].assign_attrs(said)
    assert cut(data, "stress_mean").label == f"this ${factor} / L$"
    assert cut(data, "stress_mean", per="mu_bar").label == rf"this ${factor} / (\bar\mu \, L)$"


def test_a_dataset_that_is_drawn_stays_as_it_is():
    data = swept().isel(seed=0, drop=True).assign_attrs(NATURAL_UNITS)
    said = {"symbol": "N_1", "units": "force length", "long_name": "this"}
    data["stress_mean"] = data["stress_mean"].assign_attrs(said)
    before = data.copy(deep=True)
    sweep(data, "stress_mean")
    assert data.identical(before)


def test_numbers_of_the_caller_s_axes_are_left_alone():
    ax = new_panels(1, 1, width=3.0, height=2.0).ravel()[0]
    written = FuncFormatter(lambda value, _: f"<{value}>")
    ax.yaxis.set_major_formatter(written)
    sweep(swept().isel(seed=0, slenderness=0, drop=True), "stress_mean", log="", ax=ax)
    assert ax.yaxis.get_major_formatter() is written


def test_lines_close_to_one_another_have_colours_far_apart():
    data = swept().isel(seed=0, drop=True).assign_coords(mu_bar=[2.0, 2.5, 3.0, 80.0])
    (ax,) = sweep(data, "energy_largest", x="slenderness")
    colours = [handle.get_color() for handle in ax.get_legend().legend_handles]
    assert colours == time_colours(np.arange(4.0), 0.88)
