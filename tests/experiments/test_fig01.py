"""Fig. 1: the rod keeps its length with tension and follows the flow without."""

from __future__ import annotations

from math import sin

import numpy as np
import pytest

from stokesfibers.experiments.fig01 import ANGLE


def test_quick(quick):
    fig01 = quick("fig01")
    assert fig01.ours("length at the vertical") == pytest.approx(sin(ANGLE), rel=1e-12)
    data = fig01.data()
    middle = data.sizes["time"] // 2
    rod = data["with_tension"].to_numpy()[middle]
    assert np.abs(rod[:, 0]).max() < 1e-3
    assert np.linalg.norm(rod[-1] - rod[0]) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.slow
def test_full(full):
    fig01 = full("fig01")
    assert fig01.ours("largest relative length error with tension") < 1e-5
