"""Fig. 9: length errors and the penalisation."""

from __future__ import annotations

import pytest


def test_quick(quick):
    fig09 = quick("fig09")
    assert fig09.ours("peak falls by, mu_bar = 400000, N = 40 to 80") > 4.0
    assert fig09.ours("peak length error without penalisation") > 3.0
    errors = fig09.data()["beta_length_error"].max("time").to_numpy()
    assert (errors[:-1] > errors[1:]).all()


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    fig09 = full("fig09")
    for mu_bar in ("200000", "300000", "400000"):
        for levels in ("50 to 100", "100 to 200"):
            factor = fig09.ours(f"peak falls by, mu_bar = {mu_bar}, N = {levels}")
            assert 4.0 < factor < 7.0
    assert fig09.verdict("shapes of beta = 10 and 20 apart") == "agrees"
    assert fig09.verdict("shapes of beta = 50 and 20 apart") == "agrees"
    assert fig09.ours("peak length error without penalisation") > 50.0
