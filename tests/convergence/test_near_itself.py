"""A filament whose own turns are near each other: its shape, and what the run says of it."""

from __future__ import annotations

import numpy as np

import stokesfibers as sf
from stokesfibers.experiments.contact_own import _coil, _least_distance
from stokesfibers.fiber.initial import given

COIL = _coil(0.05)


def _run(rtol: float, nodes: int | None = None) -> sf.Result:
    fixed = {} if nodes is None else {"nodes": nodes, "adapt_nodes": False}
    problem = sf.Problem(
        sf.Fiber(slenderness=1e-3),
        mu_bar=1e4,
        flow=sf.Shear(1.0),
        engine=sf.SpectralEngine(rtol=rtol, **fixed),
    )
    start = given(COIL.sample(np.linspace(0.0, 1.0, 401)).x.T, problem.fibers)
    return sf.simulate(problem, start, until=1.0, record=sf.every(1.0), threads=1)


def _last(result: sf.Result) -> np.ndarray:
    return result.data["trajectory"]["position"].to_numpy()[-1, 0]


def _worst(result: sf.Result) -> float:
    return float(result.data["observables"]["motion_error"].to_numpy().max())


def test_shapes_keep_the_tolerance_and_a_run_that_does_not_says_so():
    """Turns 0.031 L apart; the reference has 3 to 4 times the nodes."""
    assert 0.025 < _least_distance(COIL) < 0.035
    exact = _last(_run(1e-6, 120))
    for rtol in (1e-3, 1e-4, 1e-5):
        result = _run(rtol)
        assert result.data["numerics"]["nodes"].to_numpy().max() <= 40
        assert np.abs(_last(result) - exact).max() < min(0.15 * rtol, _worst(result))
        assert _worst(result) < rtol
        assert result.status.trust == "trusted"
    tight = _run(1e-6)
    assert 1e-6 < np.abs(_last(tight) - exact).max() < 2.0 * _worst(tight)
    assert tight.status.trust == "doubtful"
    assert {reason.quantity for reason in tight.status.reasons} == {"motion_error"}
