"""The largest stable step is 2 / (3 beta), whatever h."""

from __future__ import annotations

import numpy as np
import pytest


def test_quick(quick):
    found = quick("stable_dt")
    steps = found.data()["largest_step"].to_numpy()
    assert steps == pytest.approx(1.0 / 30.0, rel=0.1)
    by_beta = found.data()["largest_step_by_beta"]
    assert float(by_beta[0] / by_beta[1]) == pytest.approx(2.0, rel=0.15)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    found = full("stable_dt")
    assert abs(found.ours("exponent of the largest stable dt")) < 0.1
    assert np.min(found.data()["largest_step"] * found.data()["intervals"]) > 1.28
