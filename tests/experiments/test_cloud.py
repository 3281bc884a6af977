"""A falling ball of filaments: theory of its first velocity, the quick tier, the shipped case."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stokesfibers.config.case import load_case
from stokesfibers.experiments.cloud import WEIGHT, CloudRun
from stokesfibers.experiments.cloud_start import mean_inverse_distance, swarm_velocity
from stokesfibers.load import Gravity
from support import assert_close

CASE = Path(__file__).parents[2] / "cases" / "cloud.toml"


def test_theory_of_point_forces_is_hadamards_drop():
    """F / (5 pi mu R) with 8 pi mu = 1."""
    for radius in (1.0, 5.0):
        assert mean_inverse_distance(radius, 0.0) == pytest.approx(1.2 / radius, rel=1e-6)
        found = swarm_velocity(11, 3.0, radius=radius, length=0.0)
        assert found == pytest.approx(10 * 3.0 * 8.0 / (5.0 * radius), rel=1e-6)


def test_theory_is_the_mean_of_the_tensor_over_random_filaments():
    random = np.random.default_rng(3)
    count, radius, length = 400_000, 1.5, 1.0
    places = random.normal(size=(2, count, 3))
    places *= (radius * random.random((2, count, 1)) ** (1 / 3)) / np.linalg.norm(
        places, axis=2, keepdims=True
    )
    units = random.normal(size=(2, count, 3))
    units /= np.linalg.norm(units, axis=2, keepdims=True)
    places += length * (random.random((2, count, 1)) - 0.5) * units
    r = places[0] - places[1]
    size = np.linalg.norm(r, axis=1)
    mean = np.mean(1.0 / size + r[:, 1] ** 2 / size**3)
    expected = swarm_velocity(2, 1.0, radius=radius, length=length)
    assert mean == pytest.approx(expected, rel=4e-3)
    point = swarm_velocity(2, 1.0, radius=radius, length=0.0)
    assert expected < 0.98 * point, "the length is seen"


def test_the_shipped_case_is_the_run_of_the_experiment():
    case, run = load_case(CASE), CloudRun(200)
    assert case.problem.load == run.problem.load == Gravity((0.0, -WEIGHT, 0.0))
    assert case.problem.image_sum.kind == "ewald"
    assert case.until == pytest.approx(run.until, rel=2e-3)
    sigma = np.array([0.0, 0.3, 1.0])
    own = run.initial.curves(run.problem.fibers, np.zeros(3))
    shipped, expected = (
        np.stack([c.at_fractions(sigma) for c in cs]) for cs in (case.curves(), own)
    )
    assert_close(shipped, expected, atol=1e-5)
    middles = shipped[:, [0, 2]].mean(axis=1)
    assert np.linalg.norm(middles, axis=1).max() <= run.radius + 1e-5


@pytest.mark.timeout(1800)
def test_quick(quick):
    pytest.importorskip("ducc0")
    data = quick("cloud").data()
    fallen, time = data["fallen"].to_numpy(), data["time"].to_numpy()
    assert np.all(np.diff(fallen) > 0.0)
    assert time[-1] == pytest.approx(2.0, rel=1e-9)
    assert float(data["curvature"][0]) < 1e-6
    assert float(data["curvature"].max()) > 1.0, "they bend"


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_full(full):
    full("cloud")
