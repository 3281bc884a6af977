"""Observables against time: lines equal the stored values and say what they are."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from stokesfibers import plot
from stokesfibers.core.errors import InputError


def labels(ax):
    return ax.get_legend_handles_labels()[1]


def stored(run, name):
    return run["observables"][name].to_numpy()


def test_a_scalar_is_drawn_against_its_own_time(run):
    ax = plot.series(run, "shear_stress")
    (line,) = ax.get_lines()
    np.testing.assert_array_equal(line.get_xdata(), run["observables"]["time"].to_numpy())
    np.testing.assert_array_equal(line.get_ydata(), stored(run, "shear_stress"))
    assert ax.get_ylabel() == r"shear stress $\Sigma_{12}$ [force length]"
    assert ax.get_xlabel() == "time $t$"
    assert ax.get_legend() is None


def test_a_few_fibers_get_a_line_each(pair):
    ax = plot.series(pair, "largest_curvature")
    for number, line in enumerate(ax.get_lines()):
        np.testing.assert_array_equal(
            line.get_ydata(), stored(pair, "largest_curvature")[:, number]
        )
    assert labels(ax) == ["fiber 0", "fiber 1"]
    assert ax.get_ylabel() == r"largest curvature $\max\kappa$ [length$^{-1}$]"


def test_one_fiber_can_be_picked(pair):
    ax = plot.series(pair, "largest_curvature", fiber=1)
    (line,) = ax.get_lines()
    np.testing.assert_array_equal(line.get_ydata(), stored(pair, "largest_curvature")[:, 1])
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["fiber 1"]


def test_many_fibers_become_a_mean_and_a_band(crowd):
    values = crowd["observables"]["elastic_energy"]
    values[50, 3] = np.nan
    ax = plot.series(crowd, "elastic_energy")
    (line,) = ax.get_lines()
    known = values.to_numpy()
    np.testing.assert_allclose(line.get_ydata(), np.nanmean(known, axis=1), rtol=1e-14)
    (band,) = ax.collections
    heights = band.get_paths()[0].vertices[:, 1]
    assert heights.max() == pytest.approx(np.nanmax(known), rel=1e-14)
    assert labels(ax) == ["smallest to largest", "mean of 12"]


@pytest.mark.parametrize("name", ["no_such_thing", "centre"])
def test_what_is_no_stored_scalar_is_refused(name, run):
    with pytest.raises(InputError, match="shear_stress") as caught:
        plot.series(run, name)
    assert caught.value.where == f"observables.{name}"


def test_fibers_that_do_not_exist_are_refused(run):
    with pytest.raises(InputError, match="expected 0, the only fiber"):
        plot.series(run, "elastic_energy", fiber=1)
    with pytest.raises(InputError, match="no value per fiber"):
        plot.series(run, "shear_stress", fiber=0)


def test_stress_draws_both_and_a_zero_line(run):
    ax = plot.stress(run)
    zero, first, shear = ax.get_lines()
    assert np.all(np.asarray(zero.get_ydata()) == 0.0)
    np.testing.assert_array_equal(first.get_ydata(), stored(run, "first_normal_stress_difference"))
    np.testing.assert_array_equal(shear.get_ydata(), stored(run, "shear_stress"))
    assert labels(ax) == ["$N_1$", r"$\Sigma_{12}$"]
    assert ax.get_ylabel() == r"extra stress $\Sigma$ [force length]"
    assert first.get_linestyle() != shear.get_linestyle()


def test_the_second_difference_is_drawn_unless_zero_to_rounding(sheared_up):
    ax = plot.stress(sheared_up)
    assert labels(ax) == ["$N_1$", r"$\Sigma_{12}$", "$N_2$"]
    np.testing.assert_array_equal(
        ax.get_lines()[3].get_ydata(), stored(sheared_up, "second_normal_stress_difference")
    )
    sheared_up["observables"]["second_normal_stress_difference"][:] *= 1e-10
    assert len(labels(plot.stress(sheared_up))) == 2


def test_stress_needs_the_stresses(run):
    with pytest.raises(InputError, match="first_normal_stress_difference"):
        plot.stress(xr.DataTree.from_dict({"/trajectory": run["trajectory"].to_dataset()}))


@pytest.mark.parametrize(("which", "parts"), [("run", 0), ("pair", 2), ("crowd", 0)])
def test_energy_is_the_total_and_each_of_a_few_fibers(which, parts, request):
    tree = request.getfixturevalue(which)
    ax = plot.energy(tree)
    *each, total = ax.get_lines()
    values = stored(tree, "elastic_energy")
    np.testing.assert_allclose(total.get_ydata(), values.sum(axis=1), rtol=1e-14, atol=0)
    assert len(each) == parts
    for number, line in enumerate(each):
        np.testing.assert_array_equal(line.get_ydata(), values[:, number])
    assert ax.get_ylim()[0] == 0.0
    assert ax.get_ylabel() == r"elastic energy $E_\mathrm{elas}$ [force length]"
    assert (ax.get_legend() is not None) == (parts > 0)


def test_given_axes_are_used(run):
    for draw in (plot.stress, plot.energy, lambda d, ax: plot.series(d, "shear_stress", ax=ax)):
        ax = plot.new_axes()
        assert draw(run, ax=ax) is ax
