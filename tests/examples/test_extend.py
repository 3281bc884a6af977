"""The files that the how-tos show: a flow, a load and an observable of one's own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.flow import FLOWS
from stokesfibers.load import LOADS
from stokesfibers.problem.tables import problem_from_tables

EXTEND = Path(__file__).parents[2] / "examples" / "extend"
LONGEST = 45


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    monkeypatch.syspath_prepend(str(EXTEND))


def _tables(**more):
    fiber = {"length": 1.0, "slenderness": 1e-2, "rigidity": 1.0}
    return {"fiber": fiber, "fluid": {"viscosity": 2.0}, **more}


@pytest.mark.parametrize("path", sorted(EXTEND.glob("*.py")), ids=lambda p: p.stem)
def test_the_files_are_as_short_as_the_how_tos_say(path):
    assert len(path.read_text().splitlines()) <= LONGEST


def test_the_flow_carries_a_short_fiber_at_the_velocity_of_its_place(assert_close):
    from poiseuille import Poiseuille

    fiber = sf.Fiber(length=0.01, slenderness=1e-2, rigidity=1.0)
    flow = Poiseuille(speed=2.0, half_width=1.0)
    problem = sf.Problem(fiber, viscosity=1.0, flow=flow)
    start = sf.shapes.straight(fiber, centre=(0.0, 0.5, 0.0))
    run = sf.simulate(problem, start, until=0.5, record=sf.every(0.5))
    moved = run.data["observables"]["centre"].isel(fiber=0, time=-1)
    # 2 (1 - 1/4) x 0.5; a fiber of length l departs by speed (l / half_width)^2
    assert_close(moved, [0.75, 0.5, 0.0], atol=2e-4)


def test_the_gradient_of_the_flow_is_that_of_its_velocity(assert_close):
    from poiseuille import Poiseuille

    flow = Poiseuille(speed=1.5, half_width=0.7)
    points = np.random.default_rng(1).normal(size=(20, 3))
    step = 1e-5
    found = np.empty((20, 3, 3))
    for j, shift in enumerate(step * np.eye(3)):
        found[..., j] = flow.velocity(points + shift, 0.0) - flow.velocity(points - shift, 0.0)
    assert_close(flow.gradient(points, 0.0), found / (2.0 * step), rtol=1e-8)


def test_a_case_names_the_flow_once_it_is_listed(monkeypatch):
    from poiseuille import Poiseuille

    monkeypatch.setitem(FLOWS, Poiseuille.kind, Poiseuille)
    table = {"kind": "poiseuille", "speed": 1.0, "half_width": 2.0}
    assert problem_from_tables(_tables(flow=table)).flow == Poiseuille(1.0, 2.0)
    with pytest.raises(sf.InputError, match="half_width"):
        problem_from_tables(_tables(flow={**table, "half_width": -1.0}))


def test_a_straight_fiber_relaxes_in_the_trap_at_the_exact_rate(monkeypatch, assert_close):
    """Across its axis 8 pi mu V = -(2 - c) k d; the pull along it is borne by the tension."""
    from trap import Trap

    monkeypatch.setitem(LOADS, Trap.kind, Trap)
    problem = problem_from_tables(_tables(load={"kind": "trap", "stiffness": 3.0}))
    start = sf.shapes.straight(problem.fibers[0], centre=(0.0, 0.2, 0.0))
    run = sf.simulate(problem, start, until=1.0, record=sf.every(0.25))
    found = run.data["observables"]["centre"].isel(fiber=0)
    c = np.log(1e-4 * np.e)
    exact = 0.2 * np.exp(-3.0 * (2.0 - c) / (8.0 * np.pi * 2.0) * found["time"])
    assert exact[-1] < 0.12
    assert_close(found.sel(space="y"), exact, rtol=1e-4)


def test_the_trap_adds_the_stress_of_its_pull(assert_close):
    """A straight fiber with g = -k x: - int g x ds = k L^3 / 12, cancelled by its tension's part.

    With f = f_e - g = 0 along the fiber, the stress as a whole vanishes in fluid at rest.
    """
    from trap import Trap

    fiber = sf.Fiber(length=1.0, slenderness=1e-2, rigidity=1.0)
    problem = sf.Problem(fiber, viscosity=1.0, load=Trap(3.0))
    start = sf.shapes.straight(fiber)
    run = sf.simulate(problem, start, until=0.1, record=sf.every(0.1))
    observed = run.data["observables"].isel(time=-1)
    own = observed["fiber_stress"].isel(fiber=0).sel(i="x", j="x").item()
    assert_close(own, -3.0 / 12.0, rtol=1e-6)
    assert abs(observed["extra_stress"].sel(i="x", j="x").item()) < 1e-6 * abs(own)


def test_the_observable_is_recorded_labelled_and_stops_a_run():
    """In a process of its own, since importing the file adds to what every run records."""
    script = """
import gyration
import numpy as np
import stokesfibers as sf
fiber = sf.Fiber(length=2.0, slenderness=1e-3, rigidity=1.0)
problem = sf.Problem(fiber, viscosity=700.0, flow=sf.Shear(rate=1.0))
start = sf.shapes.nearly_straight(fiber, angle=0.93 * np.pi, amplitude=-0.05)
stop = sf.StopWhen("radius_of_gyration", below=0.55)
run = sf.simulate(problem, start, until=9.0, record=sf.every(0.5), stop=(stop,))
radius = run.data["observables"]["radius_of_gyration"]
assert radius.dims == ("time", "fiber") and radius.units == "length", radius
assert abs(radius[0, 0] - 2.0 / np.sqrt(12.0)) < 1e-6, radius[0, 0]
assert "radius of gyration below 0.55" in run.status.explanation, run.status
assert 0.55 <= radius[-1, 0] < 0.577, radius[-1, 0]
ax = sf.plot.series(run.data, "radius_of_gyration")
assert "R_g" in ax.get_ylabel()
"""
    command = [sys.executable, "-W", "error", "-c", script]
    done = subprocess.run(command, cwd=EXTEND, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
