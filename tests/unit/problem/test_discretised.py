"""A problem on nodes: what the engine, the run's health and the fluid's velocity all make of it."""

from __future__ import annotations

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.core.parallel import Workers
from stokesfibers.domain.sheared import Sheared
from stokesfibers.load import StericRepulsion
from stokesfibers.problem.discretised import (
    SHOWN_PER_NODE,
    discrete_fibers,
    load_density,
    spectral_fibers,
    spectral_interaction,
)
from stokesfibers.slender.spectral_forces import (
    elastic_forces,
    force_units,
    node_positions,
    resisted_forces,
)
from stokesfibers.slender.spectral_suspension import SpectralInteraction
from stokesfibers.stepping.spectral_view import ShownFiber
from stokesfibers.summation import FastImages
from support import assert_close

KINDS = (
    sf.Fiber(slenderness=1e-2),
    sf.Fiber(length=0.7, slenderness=2e-2, rigidity=3.0, count=2),
)


def _problem(**options) -> sf.Problem:
    return sf.Problem(KINDS, mu_bar=1e3, flow=sf.Shear(2.0), **options)


def _modes(count: int, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Return modes of curved, slightly stretched fibers beside each other, and tensions."""
    random = np.random.default_rng(4)
    fall = 2.0 ** -np.arange(nodes)
    modes = 0.2 * fall * random.standard_normal((count, 3, nodes))
    modes[:, 1, 0] = 0.4 * np.arange(count)
    return modes, 10.0 * fall[1:] * random.standard_normal((count, nodes - 1))


def test_fibers_of_one_kind_are_one_object():
    fibers = spectral_fibers(_problem(), 16)
    assert [f.length for f in fibers] == [1.0, 0.7, 0.7]
    assert fibers[1] is fibers[2]
    assert {f.count for f in fibers} == {16}


def test_all_at_once_is_each_by_itself():
    fibers = spectral_fibers(_problem(), 16)
    modes, tensions = _modes(3, 16)
    x = node_positions(fibers, modes)
    f = force_units(fibers) * elastic_forces(fibers, modes, tensions)
    resisted = resisted_forces(fibers, modes, f, Workers(1))
    for k, fiber in enumerate(fibers):
        s = fiber.sigma * fiber.length
        assert_close(x[k].T, fiber.position(modes[k], s), rtol=1e-13)
        assert_close(f[k], fiber.force(modes[k], tensions[k], s), rtol=1e-12)
        assert_close(resisted[k], fiber.mobility_velocity(modes[k], f[k])[0], rtol=1e-14)


def test_a_load_takes_the_cell_of_its_time():
    """Two fibers are neighbours only where the image below is displaced as at t = 0.25."""
    load = StericRepulsion(strength=1.0, range=0.05)
    problem = _problem(domain=Sheared((2.0, 2.0, 2.0)), load=load)
    points = np.zeros((3, 2, 3))
    points[:, :, 2] = np.array([[0.0, 0.01], [0.7, 0.71], [1.3, 1.31]])
    points[1] = points[0] + [1.0, 1.97, 0.0]  # at strain 0.5 images are 1.0 apart in x
    weights = np.full((3, 2), 0.5)
    assert not load_density(problem, points, weights, 0.0).any()
    pushed = load_density(problem, points, weights, 0.25)
    assert np.all(pushed[0, :, 1] > 0.0)
    assert_close(pushed[1].sum(axis=0), -pushed[0].sum(axis=0), rtol=1e-12)
    assert not pushed[2].any()


def test_how_fibers_act_on_each_other_follows_from_the_sum_asked_for():
    direct = _problem()
    found = spectral_interaction(direct, spectral_fibers(direct, 16), 1e-4)
    assert isinstance(found, SpectralInteraction)
    assert found.close.digits == pytest.approx(-np.log(1e-4))
    pytest.importorskip("ducc0")
    from stokesfibers.slender.spectral_ewald import EwaldInteraction

    images = FastImages(tolerance=1e-3, cutoff=0.4)
    fast = _problem(domain=sf.Periodic((2.0, 2.0, 2.0)), image_sum=images)
    found = spectral_interaction(fast, spectral_fibers(fast, 16), 1e-5, images)
    assert isinstance(found, EwaldInteraction)
    assert (found.ewald.tolerance, found.ewald.rc) == (1e-5, 0.4), "its own tolerance is not read"
    with pytest.raises(sf.InputError, match="tolerance"):
        spectral_interaction(direct, spectral_fibers(direct, 16), 0.5)


def test_fibers_on_the_papers_grid_are_one_object_by_kind():
    fibers = discrete_fibers(_problem(), 20)
    assert [f.grid.length for f in fibers] == [1.0, 0.7, 0.7]
    assert fibers[1] is fibers[2]
    assert {f.grid.intervals for f in fibers} == {20}


def test_a_shown_fiber_has_the_points_that_its_modes_are_found_from():
    shown = ShownFiber.of(spectral_fibers(_problem(), 16)[0])
    assert len(shown.grid.nodes) // SHOWN_PER_NODE == 16
