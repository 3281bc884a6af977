"""Fig. 5: the tension is the straight filament's before and after the buckling only."""

from __future__ import annotations

import numpy as np
import pytest


def _assert_signs(data) -> None:
    middle = data.sizes["node"] // 2
    tension = data["tension"].to_numpy()[:, middle]
    assert tension[0] < 0.0 < tension[-1]
    apart = np.abs(data["tension"] - data["straight_tension"]).max("node").to_numpy()
    peak = np.abs(data["straight_tension"]).max("node").to_numpy()
    assert apart[0] < 1e-2 * peak[0]
    assert apart.max() > 0.5 * peak.max()


def test_quick(quick):
    _assert_signs(quick("fig05").data())


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    fig05 = full("fig05")
    _assert_signs(fig05.data())
    assert fig05.ours("T(1/2) over that of (44), t = 41.472") == pytest.approx(1.0, abs=1e-4)
