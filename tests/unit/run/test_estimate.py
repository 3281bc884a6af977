"""What a run will cost: a trial that does not get beyond the start says so."""

from __future__ import annotations

import stokesfibers as sf
from stokesfibers.run import estimate
from stokesfibers.run.schedule import every


def test_a_trial_cut_short_in_the_start_is_told(monkeypatch):
    fiber = sf.Fiber(slenderness=1e-2)
    engine = sf.SpectralEngine(nodes=16, rtol=1e-2)
    problem = sf.Problem(fiber, mu_bar=1e4, flow=sf.Shear(1.0), engine=engine)
    bent = sf.shapes.nearly_straight(fiber, amplitude=1e-2)
    monkeypatch.setattr(estimate, "_TRIAL_SECONDS", 1e9)
    monkeypatch.setattr(estimate, "_LONGEST", 1e9)
    whole = estimate.estimate(problem, bent, until=1.0, record=every(0.5))
    monkeypatch.setattr(estimate, "_LONGEST", 0.0)
    cut = estimate.estimate(problem, bent, until=1.0, record=every(0.5))
    assert whole.settled
    assert not cut.settled
    assert cut.store_bytes < whole.store_bytes
