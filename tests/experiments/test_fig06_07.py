"""Figs. 6 and 7: stresses, the integral of N_1, and the factor two of the printed number."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid

from stokesfibers.experiments import runs
from stokesfibers.experiments.tiers import FULL, QUICK, BucklingRun


def test_quick_normal_stress_difference(quick):
    fig06 = quick("fig06")
    data = fig06.data()
    assert fig06.ours("integral of N1, straight filament") == pytest.approx(0.0, abs=1e-6)
    assert fig06.ours("integral of N1, weak form, N = 80") > 100.0
    before = data["time"].to_numpy() < data.attrs["vertical"] - 6.0
    straight = data["straight_n1"].to_numpy()[before]
    assert np.abs(data["n1"].to_numpy()[-1, before] / straight - 1.0).max() < 1e-3


def test_integral_over_another_window_of_the_straight_filament_does_not_vanish(quick):
    data = quick("fig06").data()
    time, straight = data["time"].to_numpy(), data["straight_n1"].to_numpy()
    later = time > 2.0
    assert abs(trapezoid(straight[later], time[later])) > 50.0


def test_quick_shear_stress(quick):
    fig07 = quick("fig07")
    assert fig07.ours("integral of Sigma_12 over") < 0.9
    assert float(fig07.data()["straight_shear_stress"].min()) >= 0.0


def test_trace_of_the_printed_bending_stress_tends_to_twice_the_elastic_energy(quick_settings):
    cases = [BucklingRun(QUICK, 2e5, n) for n in (40, 80)]
    trees = runs.finished(cases, quick_settings)
    pairs = zip(trees, cases, strict=True)
    coarse, fine = (runs.bending_trace_over_energy(tree, case) for tree, case in pairs)
    assert fine == pytest.approx(2.0, abs=0.06)
    assert abs(coarse - 2.0) > 3.5 * abs(fine - 2.0)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    fig06 = full("fig06")
    assert fig06.verdict("integral of N1 by (48) against") == "known difference"
    assert fig06.verdict("twice the integral of N1, extrapolated") == "agrees"
    assert fig06.verdict("twice the integral of N1, f x as printed, N = 200") == "agrees"
    assert fig06.ours("integral of N1, weak form, extrapolated") == pytest.approx(290.4, abs=0.5)
    assert full("fig07").ours("integral of Sigma_12 over") == pytest.approx(0.698, abs=0.01)
    assert list(fig06.data()["intervals"]) == list(FULL.levels)
