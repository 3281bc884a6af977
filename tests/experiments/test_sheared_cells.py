"""Suspensions in sheared cells: concentration and lengths, their dilute limits and errors."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.experiments.length_distribution import LENGTHS, groups, third_moment
from stokesfibers.experiments.sheared_cells import CellRun, uniform


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


def test_quick_concentration(quick):
    reproduced = quick("concentration")
    data = reproduced.data()
    viscosity = data["mean"].sel(quantity="viscosity", kind="stiff")
    assert np.all(viscosity > 0.0)
    assert np.all(np.diff(viscosity, axis=-1) > 0.0), "more fibers, more viscous"
    assert np.all(data["error"] >= 0.0)


def test_quick_lengths(quick):
    data = quick("length_distribution").data()
    alone = data["alone"].sel(quantity="viscosity")
    assert float(alone[1]) > float(alone[0]), "long fibers tell more than their number"


@pytest.mark.slow
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("name", ["concentration", "length_distribution"])
def test_full(full, name):
    data = full(name).data()
    assert np.all(
        data["error"].sel(quantity="viscosity") < 0.3 * data["mean"].sel(quantity="viscosity")
    )
