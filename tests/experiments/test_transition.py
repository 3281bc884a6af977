"""The buckling transition: the straight limit, what buckling leaves, and where it sets in."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.experiments.transition import ONSET, growth, onset


def test_onset_and_growth_of_a_known_curve():
    eta = np.logspace(1.0, 5.0, 9)
    share = 1e-4 + (eta / 1e4) ** 1.5
    assert onset(eta, share) == pytest.approx(1e4 * ONSET ** (1 / 1.5), rel=0.02)
    assert growth(eta, share)[0] == pytest.approx(1.5, abs=1e-4)
    assert np.isnan(onset(eta, 0.0 * share))


def _assert_transition(data) -> None:
    share = data["integral"] / data["straight"]
    local, nonlocal_ = (share.sel(model=f"{m}, eps = 0.01") for m in ("local drag", "non-local"))
    assert np.all(np.abs(share[:, 0]) < 1e-3), "a straight fiber leaves nothing"
    assert np.all(share[:, -1] > 0.15)
    assert np.all(nonlocal_[-2:] > local[-2:]), "non-local forces leave more"
    assert nonlocal_[-1] > 1.1 * local[-1]
    energy = data["energy"].to_numpy()
    assert np.all(energy[:, 0] < 1e-8)
    assert np.all(energy[:, -1] > 10.0)
    assert np.all(np.diff(data["onset"], axis=1) > 0.0), "straighter fibers buckle later"


def test_quick(quick):
    reproduced = quick("transition")
    _assert_transition(reproduced.data())
    at = reproduced.ours("eta of the transition, d_y = 0.0001, non-local")
    assert 1.5e4 < at < 3e4


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    data = full("transition").data()
    _assert_transition(data)
    share = data["integral"] / data["straight"]
    local = share.sel(model=["local drag, eps = 0.01", "local drag, eps = 0.001"])
    assert np.abs(np.diff(local, axis=0)).max() < 2e-3, "local drag depends on eta alone"
