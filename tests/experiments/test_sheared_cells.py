"""Suspensions in sheared cells: concentration and lengths, their dilute limits and errors."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from stokesfibers.experiments.cell_averages import (
    Averages,
    draw,
    legend,
    note,
    unsettled,
    variables,
)
from stokesfibers.experiments.cell_periods import PERIOD, over_periods
from stokesfibers.experiments.length_distribution import LENGTHS, groups, third_moment
from stokesfibers.experiments.sheared_cells import CellRun, dilute_stress, uniform
from stokesfibers.flow import OscillatoryShear
from stokesfibers.plot.style import new_axes
from support import assert_close


def test_a_cell_holds_its_concentration():
    run = CellRun("x", uniform(60), 1e3, 0.5, 1, 1.0)
    assert run.count / run.side**3 == pytest.approx(0.5)
    assert run.problem.drag == pytest.approx(1e3)


def test_distributions_have_one_mean_length():
    for lengths in LENGTHS.values():
        made = groups(lengths, 60)
        assert sum(g.count for g in made) == 60
        assert np.average([g.length for g in made], weights=[g.count for g in made]) == (
            pytest.approx(1.0)
        )
        assert len({round(g.eps * g.length, 12) for g in made}) == 1, "one radius"
    assert third_moment((0.5, 1.5)) == pytest.approx(1.75)


def _tree(time, shear_stress) -> xr.DataTree:
    """Return a run of two fibers with this Sigma_12 per volume and no normal stress."""
    stress = np.zeros((len(time), 3, 3))
    stress[:, 0, 1] = stress[:, 1, 0] = shear_stress
    observables = xr.Dataset({"particle_stress": (("time", "i", "j"), stress)}, {"time": time})
    ends = np.array([[[0.0, 0.0, 0.0], [0.6, 0.8, 0.0]], [[0.0, 1.0, 0.0], [0.0, 1.0, 1.0]]])
    shapes = xr.Dataset({"position": (("time", "fiber", "node", "space"), ends[None])})
    return xr.DataTree.from_dict({"observables": observables, "trajectory": shapes})


def _averages(drift: float) -> Averages:
    """Return those of two runs whose stress fluctuates about 3; the second one drifts."""
    time = np.linspace(0.0, 20.0, 401)
    runs = [CellRun("x", uniform(2), 8.0 * np.pi, 0.5, seed, 20.0) for seed in (1, 2)]
    noise = np.random.default_rng(0).standard_normal((2, 401))
    slopes = np.array([[0.0], [drift]]) * (time - 15.0)
    trees = [_tree(time, 3.0 + 0.1 * one + slope) for one, slope in zip(noise, slopes, strict=True)]
    return Averages.of(trees, runs)


def test_a_mean_has_settled_if_it_has_in_each_run():
    still, drifting = _averages(0.0), _averages(0.1)
    assert still.settled.tolist() == [True, True, True]
    assert drifting.settled.tolist() == [False, True, True]
    assert abs(still.mean[0] - 3.0) < 3.0 * still.error[0]
    assert 0.002 < still.error[0] < 0.02, "0.1 / sqrt(402)"
    assert still.mean[1] == still.error[1] == 0.0


def test_what_has_not_settled_is_said_and_drawn_open():
    found = [_averages(0.0), _averages(0.1)]
    data = xr.Dataset(
        variables(found, {"distribution": 2}), {"quantity": ["viscosity", "n1", "n2"]}
    ).assign_attrs(seeds=2, count=2)
    assert data["mean"].dims == ("distribution", "quantity")
    row = unsettled(data)
    assert (row.ours, row.quantity) == (1, "means not settled, of 4")
    one = data.sel(quantity="viscosity")
    bar = f"{found[0].error[0] / 0.5:.2g}"
    assert note(data, one.isel(distribution=0), 0.5) == f"+- {bar}, 2 seeds of 2 fibers."
    assert note(data, one.isel(distribution=1), 0.5).endswith(
        " or more, 2 seeds of 2 fibers. Not settled."
    )
    ax = new_axes()
    draw(ax, np.arange(2.0), one, color="k", label="viscosity")
    (marks,) = [line for line in ax.get_lines() if line.get_markerfacecolor() == "white"]
    assert marks.get_xydata().tolist() == [[1.0, found[1].mean[0]]]
    legend(ax, data)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["not settled", "viscosity"]
    calm = new_axes()
    draw(calm, np.zeros(1), one.isel(distribution=[0]), color="k", label="viscosity")
    legend(calm, data.isel(distribution=[0]))
    assert [text.get_text() for text in calm.get_legend().get_texts()] == ["viscosity"]


def _oscillating(mu_bar: float = 8.0 * np.pi) -> CellRun:
    flow = OscillatoryShear(1.0, frequency=1.0 / PERIOD)
    return CellRun("x", uniform(2), mu_bar, 0.5, 1, 2.0 * PERIOD, flow)


def test_averages_over_periods_pick_the_part_in_phase_with_the_rate():
    time = np.linspace(0.0, 2.0 * PERIOD, 257)
    phase = 2.0 * np.pi * time / PERIOD
    sigma = 3.0 * np.sin(phase) + 5.0 * np.cos(phase) + 7.0 * np.sin(2.0 * phase)
    n1 = 2.0 + np.cos(2.0 * phase) + np.where(time >= PERIOD, 1.0, 0.0)
    found = over_periods(time, np.stack([sigma, n1]))
    assert found.shape == (2, 2)
    assert_close(found[0], [3.0, 3.0], rtol=1e-12)
    assert_close(found[1], [2.0, 3.0], rtol=0.01)


def test_straight_fibers_alone_leave_no_normal_stress_over_a_period():
    """They turn there and back as material lines; at first they give the isotropic viscosity."""
    run = _oscillating()
    random = np.random.default_rng(0).normal(size=(4000, 3))
    ends = random / np.linalg.norm(random, axis=1)[:, None]
    tree = xr.DataTree.from_dict(
        {
            "trajectory": xr.Dataset(
                {
                    "position": (
                        ("time", "fiber", "node", "space"),
                        np.stack([-0.5 * ends, 0.5 * ends], axis=1)[None],
                    )
                }
            )
        }
    )
    many = CellRun("x", uniform(4000), run.mu_bar, 1.0, 1, run.until, run.flow)
    time = np.linspace(0.0, PERIOD, 513)
    stress = dilute_stress(tree, many, time)
    c = -np.log(1e-4 * np.e)
    rate = np.sin(2.0 * np.pi * time / PERIOD)
    early = 8.0 * np.pi / (24.0 * (c - 2.0)) / 15.0
    assert stress[0, 4] / rate[4] == pytest.approx(early, rel=0.05)
    viscosity, n1 = over_periods(time, stress[:2])[:, 0]
    assert abs(n1) < 1e-6 * viscosity
    assert 0.2 * early < viscosity < early, "they lie along the flow for a while"
    half = np.mean(stress[1, :257])
    assert half > 0.5 * early, "stretched while they turn towards the flow"


def test_quick_concentration(quick):
    reproduced = quick("concentration")
    data = reproduced.data()
    viscosity = data["mean"].sel(quantity="viscosity", kind="stiff").isel(period=0)
    assert np.all(viscosity > 0.0)
    assert np.all(np.diff(viscosity) > 0.0), "more fibers, more viscous"
    assert np.all(data["error"] >= 0.0)
    n1 = data["mean"].sel(quantity="n1").isel(period=0)
    assert np.all(np.abs(n1.sel(kind="stiff")) < 0.2 * n1.sel(kind="flexible"))
    assert np.all(np.diff(n1.sel(kind="flexible")) > 0.0)
    assert float(data["bent"].sel(kind="stiff").max()) == 0.0
    (alone,) = [row for row in reproduced.summary["rows"] if "dilute limit" in row["quantity"]]
    assert alone["verdict"] == "agrees"


def test_quick_lengths(quick):
    data = quick("length_distribution").data()
    alone = data["alone"].sel(quantity="viscosity")
    assert float(alone[1]) > float(alone[0]), "long fibers tell more than their number"


@pytest.mark.slow
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("name", ["concentration", "length_distribution"])
def test_full(full, name):
    reproduced = full(name)
    data = reproduced.data()
    assert "differs" not in {row["verdict"] for row in reproduced.summary["rows"]}
    assert np.all(
        data["error"].sel(quantity="viscosity") < 0.3 * data["mean"].sel(quantity="viscosity")
    )
