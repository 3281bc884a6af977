"""A fiber's own operator on more nodes, and what lasts of an error in its velocity."""

from __future__ import annotations

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.core.parallel import Workers
from stokesfibers.experiments.contact_own import _coil
from stokesfibers.problem.discretised import spectral_fibers
from stokesfibers.run.health_nodes import MoreNodes, more_than
from stokesfibers.slender.spectral_forces import elastic_forces, force_units, resisted_forces
from support import assert_close

WORKERS = Workers(1)
FIRST_BENDING = 4.730040744862704
"""Root of cos(x) cosh(x) = 1: wave number of the first bending mode of a free beam of length 1."""


def _problem(*fibers: sf.Fiber) -> sf.Problem:
    return sf.Problem(fibers, mu_bar=1e3, flow=sf.Shear(1.0))


def _resisted(problem: sf.Problem, count: int, slope: float, modes_of: int) -> np.ndarray:
    """Return the operator on `count` nodes for the coil that has `modes_of` modes."""
    (few,), (many,) = spectral_fibers(problem, modes_of), spectral_fibers(problem, count)
    modes = np.pad(_coil_modes(few, slope), [(0, 0), (0, count - modes_of)])[None]
    pulls = np.pad(_tensions(modes_of), [(0, 0), (0, count - modes_of)])
    force = elastic_forces((many,), modes, pulls)
    found = force_units((many,)) * resisted_forces((many,), modes, force, WORKERS)
    return many.between_nodes(found, few.sigma)


def _coil_modes(fiber, slope: float) -> np.ndarray:
    return fiber.fit(lambda s: _coil(slope).sample(s).x.T)


def _tensions(count: int) -> np.ndarray:
    tensions = np.zeros((1, count - 1))
    tensions[0, :3] = 20.0, -7.0, 3.0
    return tensions


@pytest.mark.parametrize(("slope", "nearest"), [(0.6, 3e-7), (0.05, 1e-2)])
def test_more_nodes_see_what_the_nodes_miss(slope, nearest):
    """Of one force; the reference has six times the nodes."""
    nodes = 28
    problem = _problem(sf.Fiber(slenderness=1e-3))
    fibers = spectral_fibers(problem, nodes)
    modes = _coil_modes(fibers[0], slope)[None]
    more = MoreNodes(problem, fibers, WORKERS)
    seen = more.resisted(modes, _tensions(nodes), np.zeros((1, 3, nodes)))
    own, exact = (_resisted(problem, n, slope, nodes) for n in (nodes, 6 * nodes))
    missed = np.abs(own - exact).max()
    assert np.abs(seen - own).max() == pytest.approx(missed, rel=0.2)
    assert np.abs(seen - exact).max() < 0.2 * missed
    assert 0.1 * nearest < missed / np.abs(exact).max() < 10.0 * nearest


def test_the_load_is_borne_too():
    """A load that balances the elastic force leaves nothing to resist."""
    nodes = 24
    problem = _problem(sf.Fiber(length=1.7, slenderness=1e-2, rigidity=0.3))
    fibers = spectral_fibers(problem, nodes)
    modes, still = _coil_modes(fibers[0], 0.6)[None], np.zeros((1, nodes - 1))
    more = MoreNodes(problem, fibers, WORKERS)
    bare = more.resisted(modes, still, np.zeros((1, 3, nodes)))
    elastic = force_units(fibers) * elastic_forces(fibers, modes, still)
    left = more.resisted(modes, still, elastic)
    assert np.abs(left).max() < 1e-6 * np.abs(bare).max()
    assert_close(more.resisted(modes, still, -elastic), 2.0 * bare, rtol=1e-6, atol=1e-6)


def test_bending_modes_relax_and_rigid_motion_lasts():
    """By E / L^4 of each kind: the short fiber's errors relax sooner."""
    long, short = sf.Fiber(length=1.0, slenderness=1e-2), sf.Fiber(length=0.5, slenderness=2e-2)
    problem = _problem(long, short)
    fibers = spectral_fibers(problem, 20)
    more, tau = MoreNodes(problem, fibers, WORKERS), 0.7
    s, k = fibers[0].sigma - 0.5, FIRST_BENDING
    mode = np.cos(k * s) + np.cos(0.5 * k) / np.cosh(0.5 * k) * np.cosh(k * s)
    velocity = np.stack([np.stack([mode, 2.0 + 0.0 * s, 3.0 * s])] * 2)
    lasts = more.lasting(velocity, tau)
    for fiber, found in zip(fibers, lasts, strict=True):
        rate = fiber.local.a * fiber.rigidity / (problem.drag * fiber.length**4) * k**4
        assert_close(found[0], mode / (1.0 + tau * rate), rtol=1e-7, atol=1e-7)
        assert_close(found[1:], velocity[0, 1:], rtol=1e-9)
    assert np.abs(lasts[1, 0]).max() < 0.5 * np.abs(lasts[0, 0]).max()


def test_there_are_few_numbers_of_nodes():
    found = {more_than(n): n for n in range(8, 140)}
    assert set(found) == {12, 16, 24, 32, 48, 64, 96, 128, 192, 256}
    assert all(1.5 * n <= more_than(n) <= 2.25 * n for n in range(8, 140))
