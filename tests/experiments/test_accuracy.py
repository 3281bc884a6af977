"""Error against cost: the runs converge to the reference, and cheaper than the paper's scheme."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from stokesfibers.core.errors import StokesFibersError
from stokesfibers.experiments import accuracy_rows
from stokesfibers.experiments.accuracy_plan import plan
from stokesfibers.experiments.engine_runs import (
    UNIT_SIZE,
    EngineRun,
    cost,
    largest_distance,
    paper_run,
    shapes,
    unit_times,
)
from stokesfibers.experiments.tiers import QUICK, BucklingRun
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.slender.regularization import PaperRegularization, SpheroidalRegularization


@pytest.fixture(scope="module")
def reproduced(quick):
    return quick("accuracy").data()


def test_quick(reproduced):
    data = reproduced
    for k in range(data.sizes["case"]):
        one = data.isel(case=k)
        loose, tight = one["rtol_error"].to_numpy()[[0, -1]]
        assert loose > 1e-5, "the loose run must err"
        assert tight < 1e-2 * loose
        few, many = one["space_error"].to_numpy()
        assert few > 1e-4 > 3e-5 > many
        # Both engines go to the same answer: the paper's error falls towards our reference.
        assert (np.diff(np.log2(one["paper_shape"])) < -1.5).all()
    # The choice of delta moves the integral; each engine's own must be compared.
    spheroidal, paper, _ = data["integral"].to_numpy()
    assert 1e-5 < abs(spheroidal / paper - 1.0) < 1e-3
    assert (data["out_of_plane"][:2] == 0.0).all()
    assert data["out_of_plane"][2] > 0.01, "the last case leaves the plane"
    assert data.attrs["unit_smallest"] <= data.attrs["unit_median"]


def test_goal_rows_fail_beyond_the_goal(reproduced):
    data = reproduced.copy(deep=True)
    data.attrs["quick"] = 0
    data = data.assign_coords(aim=[1e-3, 1e-5])
    for seconds, verdict in ((0.9, "agrees"), (1.1, "differs")):
        goals = np.array([accuracy_rows.GOALS[aim] for aim in (1e-3, 1e-5)])
        data["aim_formulas"] = seconds * goals * data["aim_unit"]
        rows = accuracy_rows.rows(data)
        costs = [row for row in rows if row.quantity.startswith("cost in LAPACK solves")]
        assert [row.verdict for row in costs] == [verdict] * 2


def test_a_wrong_integral_is_told(reproduced):
    data = reproduced.copy(deep=True)
    data.attrs["quick"] = 0
    data["mu_bar"] = (("case",), [4e5, 4e5, 4e5])
    data["integral"] = (("case",), [290.4471, 290.4471, 290.4471])
    kinds = [str(kind) for kind in data["regularization"].to_numpy()]
    assert kinds == ["spheroidal", "paper", "spheroidal"]
    rows = [r for r in accuracy_rows.rows(data) if r.quantity.startswith("integral of N1")]
    assert [r.verdict for r in rows] == ["agrees", "differs", "reported"]


def test_runs_by_the_papers_scheme_with_16_are_those_of_the_figures():
    assert isinstance(paper_run(QUICK, 2e5, 40, regularization=PaperRegularization()), BucklingRun)
    spheroidal = paper_run(QUICK, 2e5, 40, regularization=SpheroidalRegularization())
    figures = BucklingRun(QUICK, 2e5, 40)
    assert spheroidal.name != figures.name
    assert spheroidal.problem.engine == figures.problem.engine
    assert spheroidal.problem.mobility != figures.problem.mobility
    assert spheroidal.schedule == figures.schedule
    skewed = paper_run(QUICK, 2e5, 40, regularization=PaperRegularization(), skew=20.0)
    assert skewed.problem == figures.problem
    assert skewed.name != figures.name
    (curve,) = skewed.initial.curves(skewed.problem.fibers, np.zeros(3))
    assert 0.0 < np.ptp(curve.at_fractions(np.linspace(0.0, 1.0, 41))[:, 2]) < 1e-3


@pytest.mark.parametrize("is_quick", [False, True])
def test_times_are_recorded_by_every_run(is_quick):
    chosen = plan(is_quick)
    steps = [chosen.tier.step_ratio / n for n in chosen.tier.levels]
    for step in steps:
        whole = chosen.times / step
        assert np.abs(whole - np.round(whole)).max() < 1e-6
    assert chosen.times[0] == pytest.approx(chosen.tier.vertical - 1.024)
    assert chosen.times[-1] == pytest.approx(chosen.tier.vertical + 1.536)


def test_shapes_are_taken_at_common_points_and_refused_elsewhere():
    position = np.arange(2.0 * 9 * 3).reshape(2, 1, 9, 3)
    trajectory = xr.Dataset(
        {"position": (("time", "fiber", "node", "space"), position)}, coords={"time": [0.5, 1.0]}
    )
    tree = xr.DataTree.from_dict({"trajectory": trajectory})
    found = shapes(tree, np.array([1.0]), 5)
    np.testing.assert_array_equal(found, position[[1], 0, ::2])
    for times, points in (([0.75], 5), ([1.0], 4)):
        with pytest.raises(StokesFibersError):
            shapes(tree, np.array(times), points)


def test_distance_is_the_largest_of_all_points():
    one = np.zeros((2, 3, 3))
    other = one.copy()
    other[1, 2] = [3.0, 0.0, 4.0]
    assert largest_distance(one, other) == 5.0


def test_costs_count_all_steps():
    run = EngineRun(QUICK, 2e5, SpectralEngine(rtol=1e-2, nodes=16))
    found = cost(run, 1)
    assert found.whole >= found.formulas > 0.0
    assert 20 < found.steps < 400
    assert found.nodes == 16
    assert 0.2 * found.unit < found.formulas, "a unit is a solve, not a run"


def test_unit_is_a_solve_of_the_papers_system():
    assert UNIT_SIZE == 3 * (200 + 1)
    assert unit_times().min() > 1e-4


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_full(full):
    accuracy = full("accuracy")
    assert accuracy.ours("integral of N1, mu_bar = 4e5, spheroidal") == pytest.approx(
        290.4471, abs=5e-4
    )
    assert accuracy.ours("integral of N1, mu_bar = 4e5, (16)") == pytest.approx(290.4531, abs=5e-4)
