"""Oscillating shear: the rule over directions, Fourier moduli, and the linear limit."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from stokesfibers.experiments.oscillatory import directions, moduli


def test_directions_average_polynomials_to_degree_eight():
    axes, weights = directions()
    assert weights.sum() == pytest.approx(1.0, abs=1e-14)
    for powers in itertools.product(range(0, 9, 2), repeat=3):
        if not 0 < sum(powers) <= 8:
            continue
        exact = np.prod([_odd(p - 1) for p in powers]) / _odd(sum(powers) + 1)
        found = weights @ np.prod(axes ** np.array(powers), axis=1)
        assert found == pytest.approx(exact, abs=1e-13), powers


def _odd(n: int) -> float:
    """Return n!! of an odd n."""
    return float(np.prod(np.arange(n, 0, -2))) if n > 0 else 1.0


def test_moduli_of_a_known_stress():
    phase = np.linspace(0.0, 2.0 * np.pi, 129)
    stress = 0.3 * np.sin(phase) + 0.8 * np.cos(phase) + 0.05 * np.sin(3.0 * phase)
    storage, loss, third, stored = moduli(stress, 0.1 + 0.2 * np.sin(phase), 0.5)
    assert storage == pytest.approx(0.6, abs=1e-12)
    assert loss == pytest.approx(1.6, abs=1e-12)
    assert third == pytest.approx(0.05 / np.hypot(0.3, 0.8), abs=1e-12)
    assert stored == pytest.approx(0.4 / (np.pi * 0.25 * 1.6), abs=1e-12)


def test_quick(quick):
    reproduced = quick("oscillatory")
    assert reproduced.verdict("G'' over its linear limit") == "agrees"
    large = reproduced.data().isel(mu_bar=0, strain=-1)
    assert float(large["stored"]) > 1e-6
    assert float(large["third"]) > 0.01


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    data = full("oscillatory").data()
    soft = data.isel(mu_bar=-1, strain=-1)
    stiff = data.isel(mu_bar=0, strain=-1)
    assert float(soft["stored"]) > 10.0 * float(stiff["stored"])
