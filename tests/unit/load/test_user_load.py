"""A user's force per length: from a file or a function, checked, and its stress."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stokesfibers.config.case import case_from_tables
from stokesfibers.core.errors import InputError
from stokesfibers.domain import Free, Periodic, Sheared
from stokesfibers.fiber import curves
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.load import Gravity, LoadedState, UserLoad
from stokesfibers.problem.engine import PaperEngine, SpectralEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.tables import problem_to_tables
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import simulate
from stokesfibers.summation import ExactImages, TruncatedSum
from support import assert_close

FILE = """
import numpy as np

def density(points, t):
    return np.array([0.0, 0.0, -2.0]) * (1.0 + t) + 0.0 * points

def scale(points, t):
    return 3.0 * points
"""
TABLES = {
    "fiber": {"length": 1.0, "slenderness": 1e-2, "rigidity": 1.0},
    "fluid": {"viscosity": 1.0},
    "stepping": {"until": 0.2},
}


def _constant(*force):
    """Return a density that is the same everywhere."""

    def density(points, t):  # noqa: ARG001
        return np.broadcast_to(force, points.shape)

    return density


def _state(time=0.0):
    s = np.linspace(0.0, 1.0, 21)
    x = np.stack([s, 0.1 * s**2, 0.0 * s], axis=1)
    weights = np.full((2, 21), 0.05)
    weights[:, [0, -1]] = 0.025
    return LoadedState(np.stack([x, x + 1.0]), weights, np.full(2, 0.01), Free(), time)


def _tables(tmp_path, **load):
    (tmp_path / "load.py").write_text(FILE)
    return {**TABLES, "load": {"kind": "python", "file": "load.py", **load}}


def test_a_file_needs_to_be_allowed_and_gives_the_density_at_the_time(tmp_path):
    tables = _tables(tmp_path)
    with pytest.raises(InputError, match="allow-python"):
        case_from_tables(tables, folder=tmp_path)
    load = case_from_tables(tables, folder=tmp_path, allow_python=True).problem.load
    density = load.density(_state(0.5))
    assert density.shape == (2, 21, 3)
    assert_close(density, np.broadcast_to([0.0, 0.0, -3.0], (2, 21, 3)), rtol=1e-14)


def test_a_stored_case_finds_the_same_file_again(tmp_path):
    case = case_from_tables(_tables(tmp_path, density="scale"), folder=tmp_path, allow_python=True)
    stored = case.tables()
    again = case_from_tables(stored, allow_python=True).problem.load
    assert_close(again.density(_state()), 3.0 * _state().positions, rtol=1e-14)
    (tmp_path / "load.py").write_text(FILE + "\n# changed\n")
    with pytest.raises(InputError, match="changed file"):
        case_from_tables(stored, allow_python=True)


@pytest.mark.parametrize(
    ("load", "said"),
    [
        ({"density": "missing"}, "missing"),
        ({"file": "nothing.py"}, "can be read"),
        ({"density": 3}, "a text"),
        ({"velocity": "density"}, "velocity"),
        ({"sha256": "0" * 64}, "changed file"),
    ],
)
def test_unusable_tables_are_refused(load, said, tmp_path):
    with pytest.raises(InputError, match=said):
        case_from_tables(_tables(tmp_path, **load), folder=tmp_path, allow_python=True)


def test_a_function_typed_in_python_is_named_but_not_rebuilt():
    problem = Problem(
        Fiber(slenderness=1e-2), viscosity=1.0, load=UserLoad(_constant(0.0, 0.0, 0.0))
    )
    table = problem_to_tables(problem)["load"]
    assert "density" in table["density_function"]
    with pytest.raises(InputError, match="problem=problem"):
        case_from_tables({**TABLES, "load": table}, allow_python=True)


@pytest.mark.parametrize(
    "function",
    [
        _constant(np.nan, 0.0, 0.0),
        lambda points, t: points[:, 0] * t,
        lambda points, t: points / int(0.0 * t),
    ],
)
def test_unusable_values_are_refused(function):
    with pytest.raises(InputError, match="density function"):
        UserLoad(function).density(_state())


def test_stress_is_about_the_centre_of_each_fiber():
    """g = (y - y_c, 0, 0) has -int g (x - x_c) ds; a constant leaves nothing."""
    state = _state()
    flat = UserLoad(_constant(1.0, 2.0, 3.0)).stress(state)
    assert np.abs(flat).max() < 1e-14
    y = state.positions[0, :, 1]
    weights = state.weights[0]
    variance = weights @ (y - weights @ y / weights.sum()) ** 2
    mixed = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    found = UserLoad(lambda points, t: (1.0 + t) * points @ mixed.T).stress(state)
    assert_close(found[0, 1], -2.0 * variance, rtol=1e-12)


def test_a_constant_force_falls_like_weight():
    engine = SpectralEngine(nodes=10, rtol=1e-3)
    weight = Problem(
        Fiber(slenderness=1e-2), viscosity=1.0, load=Gravity((0.0, 0.0, -1.0)), engine=engine
    )
    given = replace(weight, load=UserLoad(_constant(0.0, 0.0, -1.0)))
    shape = curves.straight(weight.fibers[0], angle=0.3)
    ends = [
        simulate(p, shape, until=0.4, record=Schedule(0.4))
        .data["trajectory"]["position"]
        .to_numpy()
        for p in (weight, given)
    ]
    assert np.abs(ends[0][-1] - ends[0][0]).max() > 1e-3
    assert_close(ends[1], ends[0], rtol=1e-12)


def _falling(domain, **other):
    return Problem(
        Fiber(slenderness=1e-2),
        viscosity=1.0,
        load=Gravity((0.0, 0.0, -1.0)),
        domain=domain,
        **other,
    )


def test_weight_in_cells_needs_a_stated_balance():
    three, two = Periodic((4.0, 4.0, 4.0)), Periodic((4.0, 4.0, 0.0))
    with pytest.raises(InputError, match="unbounded"):
        _falling(Periodic((4.0, 0.0, 0.0)))
    with pytest.raises(InputError, match="ewald"):
        _falling(three, engine=PaperEngine(beta=1.0, dt=0.1), image_sum=TruncatedSum())
    for domain in (three, two):
        assert _falling(domain).image_sum.kind == "ewald"
    assert _falling(Sheared((4.0, 4.0, 4.0)), flow=Shear(1.0)).load.has_net_force


def test_the_sheared_cell_refuses_other_engines_sums_and_flows():
    cell = Sheared((4.0, 4.0, 4.0))
    plain = {"viscosity": 1.0, "domain": cell}
    fiber = Fiber(slenderness=1e-2)
    with pytest.raises(InputError, match="spectral"):
        Problem(fiber, flow=Shear(), engine=PaperEngine(), **plain)
    with pytest.raises(InputError, match=r"Leave domain\.sum out"):
        Problem(fiber, flow=Shear(), image_sum=ExactImages(), **plain)
    with pytest.raises(InputError, match="oscillatory_shear"):
        Problem(fiber, **plain)


def test_a_fiber_settles_slower_in_a_cell_by_hasimotos_constant():
    """A force F at a point of a cubic lattice of spacing d moves slower by 2.8373 F / (6 pi mu d).

    The mean flow is zero. A fiber is a point to second order in its length over the period.
    """
    fiber = Fiber(length=0.2, slenderness=1e-2)
    engine = SpectralEngine(nodes=10, rtol=1e-4)
    shape = curves.segment(fiber, centre=np.zeros(3), direction=np.array([1.0, 0.0, 0.0]))
    speeds = []
    for domain in (Free(), Periodic((2.0, 2.0, 2.0))):
        problem = replace(_falling(domain), fiber=fiber, engine=engine)
        result = simulate(problem, shape, until=0.01, record=Schedule(0.01))
        centre = result.data["observables"]["centre"].to_numpy()[:, 0, 2]
        speeds.append((centre[0] - centre[-1]) / 0.01)
    lost = 2.8373 * 0.2 / (6.0 * np.pi * 2.0)
    assert_close(speeds[0] - speeds[1], lost, rtol=0.03)
