"""The fluid's velocity from a stored periodic run: points, lines, volumes; its periodicity."""

from __future__ import annotations

import json

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.domain import Periodic
from support import assert_close

PERIOD = 2.0
TIME = 0.1


@pytest.fixture(scope="module")
def data():
    """Two fibers in an oscillating shear, periodic in x, as in cases/fig12.toml."""
    kind = sf.Fiber(slenderness=1e-2, count=2)
    problem = sf.Problem(
        kind,
        mu_bar=1.5e3,
        flow=sf.OscillatoryShear(frequency=0.5),
        engine=sf.PaperEngine(intervals=20, dt=0.01, beta=20.0),
        domain=Periodic((PERIOD, 0.0, 0.0)),
    )
    s = np.linspace(0.0, 1.0, 21)[:, None]
    first = s * np.array([0.6, 0.8, 0.0]) + np.array([1.6, 0.0, 0.0])
    second = s * np.array([0.8, -0.36, 0.48]) + np.array([0.2, 0.8, 0.3])
    return sf.simulate(
        problem, np.stack([first, second]), until=TIME, record=sf.every(0.05), threads=1
    ).data


def disturbance(data, points):
    rate = np.sin(2.0 * np.pi * 0.5 * TIME)
    background = np.zeros_like(points)
    background[..., 0] = rate * points[..., 1]
    return sf.velocity_from_run(data, points, time=TIME) - background


def volume():
    x, y, z = np.linspace(-0.3, 2.1, 7), np.linspace(-0.4, 1.1, 5), np.linspace(-0.5, 0.6, 4)
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)


def test_points_lines_planes_and_volumes_agree(data):
    box = volume()
    whole = sf.velocity_from_run(data, box, time=TIME)
    assert whole.shape == (7, 5, 4, 3)
    assert np.isfinite(whole).all()
    points = sf.velocity_from_run(data, box.reshape(-1, 3), time=TIME)
    assert np.array_equal(points.reshape(box.shape), whole)
    assert np.array_equal(sf.velocity_from_run(data, box[:, 2, 1], time=TIME), whole[:, 2, 1])
    assert np.array_equal(sf.velocity_from_run(data, box[:, :, 3], time=TIME), whole[:, :, 3])
    assert np.array_equal(sf.velocity_from_run(data, box[6, 0, 2], time=TIME), whole[6, 0, 2])
    assert np.array_equal(
        sf.velocity_from_run(data, box[6, 0, 2].tolist(), time=TIME), whole[6, 0, 2]
    )


@pytest.mark.parametrize("shape", [(2,), (3, 4), ()])
def test_points_of_other_shapes_are_refused(data, shape):
    with pytest.raises(sf.InputError, match=r"\(\.\.\., 3\)"):
        sf.velocity_from_run(data, np.zeros(shape), time=TIME)


@pytest.mark.parametrize("periods", [1, -3])
def test_the_disturbance_repeats_after_each_period_to_rounding(data, periods):
    box = volume()
    here = disturbance(data, box)
    there = disturbance(data, box + np.array([periods * PERIOD, 0.0, 0.0]))
    assert np.linalg.norm(here, axis=-1).max() > 5e-3
    assert_close(there, here, rtol=1e-11)
    across = disturbance(data, box + np.array([0.0, PERIOD, 0.0]))  # no period along y
    assert np.abs(across - here).max() > 0.1 * np.abs(here).max()


def test_the_jump_where_the_nearest_image_changes_is_that_of_the_moments(data):
    """Half a period from a mid-point an exact image and one by moments change their roles.

    The velocity jumps by the error of the image sum, which grows smaller with the period but
    is never zero.
    """
    middle = data["trajectory"]["position"].to_numpy()[-1, :, 10]
    y, z = np.meshgrid(np.linspace(-0.2, 1.0, 5), np.linspace(-0.3, 0.5, 4))
    jumps = []
    for x in middle[:, 0] + 0.5 * PERIOD:
        side = np.stack([np.full(y.shape, x), y, z], axis=-1)
        step = np.array([1e-9, 0.0, 0.0])
        jumps.append(disturbance(data, side + step) - disturbance(data, side - step))
    largest = np.linalg.norm(jumps, axis=-1).max()
    typical = np.sqrt(np.mean(np.sum(disturbance(data, volume()) ** 2, axis=-1)))
    assert 1e-6 * typical < largest < 5e-3 * typical


def test_the_case_of_the_run_is_what_is_evaluated(data):
    case = json.loads(data.attrs["case"])
    assert case["domain"]["periods"] == [PERIOD, 0.0, 0.0]
    far = np.array([[0.3, 40.0, 0.0]])
    rate = np.sin(2.0 * np.pi * 0.5 * TIME)
    assert_close(sf.velocity_from_run(data, far, time=TIME), [[40.0 * rate, 0.0, 0.0]], rtol=1e-3)
