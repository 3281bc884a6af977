"""Steric repulsion: force from its potential, balance, virial, and that it keeps fibers apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.domain import Free, Periodic
from stokesfibers.load import LoadedState, StericRepulsion
from support import assert_close, assert_negligible

S = np.linspace(-0.5, 0.5, 41)
RADII = np.array([0.01, 0.02])
LOAD = StericRepulsion(strength=50.0, range=0.1)


def _state(second, domain=None):
    first = np.stack([S, 0.1 * S**2, 0 * S], axis=-1)
    weights = np.full((2, 41), 1.0 / 40)
    weights[:, [0, -1]] *= 0.5
    weights[1] *= 1.7  # as if it were longer
    return LoadedState(np.stack([first, second]), weights, RADII, domain or Free())


def _second(offset=(0.02, 0.0, 0.05)):
    return np.stack([0.3 * S, S, 0.1 * S], axis=-1) + np.array(offset)


def _energy(state):
    """The potential, node pair by node pair, written out from its definition."""
    total = 0.0
    for i in range(41):
        for j in range(41):
            r = np.linalg.norm(state.positions[0, i] - state.positions[1, j])
            gap = r - RADII.sum()
            if gap < LOAD.range:
                phi = LOAD.strength * LOAD.range / 3.0 * (1.0 - gap / LOAD.range) ** 3
                total += state.weights[0, i] * state.weights[1, j] * phi
    return total


def test_density_is_minus_the_gradient_of_the_potential():
    density = LOAD.density(_state(_second()))
    assert np.abs(density).max() > 0.1
    for fiber, node, axis in [(1, 20, 2), (1, 22, 0), (1, 18, 1), (0, 20, 2), (0, 21, 1)]:
        step = np.zeros((2, 41, 3))
        step[fiber, node, axis] = 1e-6
        state = _state(_second())
        up, down = (
            _energy(replace(state, positions=state.positions + sign * step)) for sign in (1, -1)
        )
        weight = state.weights[fiber, node]
        assert_close(density[fiber, node, axis] * weight, -(up - down) / 2e-6, rtol=1e-5)


def test_forces_balance_and_push_apart():
    state = _state(_second())
    force = np.einsum("fni,fn->fi", LOAD.density(state), state.weights)
    assert force[1, 2] > 0.0
    assert_negligible(force.sum(axis=0), scale=float(np.abs(force).max()), rtol=1e-12)


def test_stress_is_minus_the_virial_of_the_pair_forces():
    state = _state(_second())
    density = LOAD.density(state)
    virial = np.einsum("fni,fnj,fn->ij", density, state.positions, state.weights)
    assert_close(LOAD.stress(state), -virial, rtol=1e-12)
    assert np.trace(LOAD.stress(state)) < 0.0  # repulsion: a positive pressure


def test_nearest_image_repels_with_the_same_force_and_stress():
    domain = Periodic((2.0, 0.0, 0.0))
    near, far = _state(_second()), _state(_second((6.02, 0.0, 0.05)), domain)
    assert_close(LOAD.density(far), LOAD.density(near), rtol=1e-10)
    assert_close(LOAD.stress(far), LOAD.stress(near), rtol=1e-10)


def test_nothing_acts_beyond_the_range():
    assert not LOAD.density(_state(_second((0.0, 0.0, 0.25)))).any()


@pytest.mark.parametrize("bad", [{"strength": 0.0, "range": 0.1}, {"strength": 1.0, "range": -1.0}])
def test_bad_parameters_are_refused(bad):
    with pytest.raises(InputError):
        StericRepulsion(**bad)
