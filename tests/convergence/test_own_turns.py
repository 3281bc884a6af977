"""A fiber that nears itself: what its nodes do not resolve is found, and how badly."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from reference.twins import finite_part_anywhere
from stokesfibers.experiments.close_pair_curves import Filament
from stokesfibers.experiments.contact_scenes import smooth_force
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.spectral import SpectralFiber

RISE = Polynomial([0.0, 0.0, 0.0, 1.0 / 3.0, -1.0 / 2.0, 1.0 / 5.0])
TOLERANCE = 1e-6


def coil(slope: float, turn: float = 180.0) -> Filament:
    """Return a filament coiled once, `turn` / 30 radians, that rises by `slope`."""
    return Filament.build(lambda s: turn * RISE(s), lambda s: np.full_like(s, slope), 0.5, 0.0)


@cache
def discretised(slope, nodes, eps=1e-3, turn=180.0):
    """Return the fiber and the modes of a coil."""
    fiber = SpectralFiber.build(
        1.0, eps, rigidity=1.0, nodes=nodes, mobility=NonLocal(), tolerance=TOLERANCE
    )
    curve = coil(slope, turn)
    return fiber, fiber.fit(lambda s: curve.sample(s).x.T)


def exact_velocity(fiber, modes, force):
    """Return Lambda f + K f at the nodes by adaptive quadrature, for the shape of the modes."""
    out = np.empty((3, fiber.count))
    for i, (s, delta) in enumerate(zip(fiber.sigma, fiber.weights.delta, strict=True)):
        here, tangent = force(np.array([s]))[:, 0], fiber.position(modes, np.array([s]), 1)[:, 0]
        out[:, i] = fiber.local.a * here + fiber.local.b * tangent * (tangent @ here)
        out[:, i] += finite_part_anywhere(
            lambda q, order=0: fiber.position(modes, q, order), force, s, delta
        )
    return out


@pytest.mark.parametrize("nodes", [24, 32, 48])
@pytest.mark.parametrize("slope", [0.2, 0.1, 0.05, 0.025])
def test_the_error_by_the_nodes_alone_is_foretold(slope, nodes):
    """From above, within a factor of ten, over four decades."""
    fiber, modes = discretised(slope, nodes)
    force = smooth_force(fiber.sigma)
    found, _ = fiber.mobility_velocity(modes, force)
    exact = exact_velocity(fiber, modes, smooth_force)
    error = np.abs(found - exact).max() / np.abs(exact).max()
    foretold = fiber.own_turns.approaches(modes).error
    if error < 0.1 * TOLERANCE:
        assert foretold < TOLERANCE
    else:
        assert error < foretold < 10.0 * error


def test_only_nodes_that_are_near_are_named():
    """The turns come near each other at the ends; the middle of the coil is far from all."""
    fiber, modes = discretised(0.05, 32)
    nodes = fiber.own_turns.approaches(modes).nodes
    assert {0, 31} <= set(nodes.tolist())
    assert not {15, 16} & set(nodes.tolist())


@pytest.mark.parametrize("turn", [0.0, 60.0, 100.0])
def test_fibers_that_stay_away_from_themselves_are_not_named(turn):
    fiber, modes = discretised(0.0, 32, turn=turn)
    found = fiber.own_turns.approaches(modes)
    assert (found.nodes.size, found.error) == (0, 0.0)


def test_a_reversed_and_turned_coil_is_judged_alike():
    fiber, modes = discretised(0.05, 32)
    curve, (turn, _) = coil(0.05), np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    other = fiber.fit(lambda s: (turn @ curve.sample(1.0 - s).x).T)
    one, two = fiber.own_turns.approaches(modes), fiber.own_turns.approaches(other)
    assert one.error == pytest.approx(two.error, rel=1e-6)
    assert (one.nodes == 31 - two.nodes[::-1]).all()
