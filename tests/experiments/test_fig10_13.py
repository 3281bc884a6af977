"""The suspension in oscillating shear, in its quick tier: what the paper says in words."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from stokesfibers.experiments import oscillating
from stokesfibers.run.start import nodal_positions

PERIODS = np.array([2.0, 0.0, 0.0])
Quick = Callable[[str], Any]


def test_energy_peaks_before_the_end_of_each_period(quick: Quick) -> None:
    found = quick("fig12")
    data = found.data()
    observed, energy = oscillating.totals(data)
    assert observed[-1] == 51.2
    for start in (0.0, 25.6):
        inside = (observed >= start) & (observed <= start + 25.6)
        peak = observed[inside][np.argmax(energy[inside])]
        assert 0.8 < (peak - start) / 25.6 < 0.95
    assert energy[0] < 1e-20
    assert found.ours("largest energy of a filament on its own") < 1e-6


def test_filaments_are_straight_at_first_and_amid_the_second_period(quick: Quick) -> None:
    first, second = quick("fig10").data(), quick("fig11").data()
    np.testing.assert_allclose(oscillating.ends(first, 0.0), 1.0, rtol=1e-12)
    calm, bent = oscillating.ends(second, 38.4), oscillating.ends(second, 49.024)
    assert calm.min() > bent.min()
    assert oscillating.at(second, 38.4) < 0.1 * oscillating.at(second, 49.024)


def test_energies_of_single_filaments_differ(quick: Quick) -> None:
    found = quick("fig13")
    energy = found.data()["elastic_energy"].max("observed").to_numpy()
    assert energy.max() > 10.0 * energy.min() > 0.0
    assert found.ours("largest energies within a second half period") >= 1


def test_the_seed_sets_the_positions() -> None:
    starts = []
    for seed in (1, 1, 2):
        run = oscillating.SuspensionRun(oscillating.QUICK, seed)
        assert run.name.endswith(f"seed{seed}")
        starts.append(nodal_positions(run.initial.curves(run.problem.fibers, PERIODS), run.problem))
    assert np.array_equal(starts[0], starts[1])
    assert np.abs(starts[0] - starts[2]).max() > 0.01
