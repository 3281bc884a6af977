"""Fig. 8: orders of convergence."""

from __future__ import annotations

import pytest


def test_quick(quick):
    fig08 = quick("fig08")
    data = fig08.data()
    assert float(data["coarse_difference"].max()) > 2.0 * float(data["fine_difference"].max())
    assert fig08.ours("order p, mu_bar = 200000, t = 6.144") == pytest.approx(2.0, abs=0.3)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    fig08 = full("fig08")
    assert fig08.ours("order p, mu_bar = 300000, t = 50.176") == pytest.approx(1.98, abs=0.005)
    assert fig08.ours("order p, mu_bar = 400000, t = 50.176") == pytest.approx(1.90, abs=0.005)
    for time in ("49.152", "50.688"):
        assert 1.89 <= fig08.ours(f"order p, mu_bar = 400000, t = {time}") <= 2.22
    for mu_bar in ("200000", "300000", "400000"):
        centred = fig08.ours(f"order p centred, mu_bar = {mu_bar}, t = 61.44")
        assert centred == pytest.approx(1.97, abs=0.15)
