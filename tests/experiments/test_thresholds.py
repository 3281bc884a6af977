"""Buckling thresholds: published numbers, runs, and what the non-local operator does."""

from __future__ import annotations

import numpy as np
import pytest


def _assert_non_local_thresholds(reproduced) -> None:
    data = reproduced.data()
    first = data["threshold"].sel(mode=1, regularization="spheroidal").to_numpy()
    assert np.all(np.diff(first) < 0.0), "thicker fibers buckle at a smaller eta"
    assert 120.0 < first[-1] < first[0] < 153.2
    names = ("eps = 0.0001", "eps = 0.001", "eps = 0.01")
    found = [
        reproduced.ours(f"critical eta, planar extension, non-local, {name}") for name in names
    ]
    assert found == pytest.approx([145.6545, 142.9956, 137.5606], abs=2e-4)


def test_quick(quick):
    reproduced = quick("thresholds")
    _assert_non_local_thresholds(reproduced)
    assert reproduced.ours("k of critical eta") == pytest.approx(0.8685, abs=1e-3)


@pytest.mark.slow
def test_full(full):
    _assert_non_local_thresholds(full("thresholds"))
