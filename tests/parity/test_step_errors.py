"""The errors of a step against the same written out with numpy."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.kernels.spectral import step_errors

_SHIFT, _BEND = 2e-5, 1e-4


def _slow(weights, scales, history, fresh, table, allowed, least_bends):
    shift, bend, rounding = allowed
    errors = np.zeros(len(weights))
    for states, modes, least in zip(history, fresh, least_bends, strict=True):

        def norms(of):
            rigid = of.copy()
            rigid[:, 2:] = 0.0
            return [np.linalg.norm(part @ table.T, axis=0).max() for part in (of, of - rigid)]

        size, bent = norms(modes)
        may_bend = bend * max(bent, least) + rounding * max(1.0, size)
        for r, (row, scale) in enumerate(zip(weights, scales, strict=True)):
            off, off_bend = norms(scale * (modes - np.tensordot(row, states, 1)))
            errors[r] = max(errors[r], off / shift, off_bend / may_bend)
    return errors


@pytest.mark.parametrize("away", [0.0, 1e5], ids=["here", "far away"])
@pytest.mark.parametrize("stiff", [0.0, 0.2, 30.0])
def test_errors_are_those_written_out(away, stiff):
    """Rounding counts far away, where a position has fewer digits."""
    rng = np.random.default_rng(3)
    fibers, depth, nodes = 3, 7, 12
    fresh = rng.normal(size=(fibers, 3, nodes))
    fresh[:, :, 0] += away
    history = fresh[:, None] + 1e-3 * rng.normal(size=(fibers, depth, 3, nodes))
    weights = np.zeros((3, depth))
    for r in range(3):
        weights[r, : r + 2] = 1.0 / (r + 2)
    table = rng.normal(size=(nodes, nodes))
    table[:, 0] = 1.0
    given = weights, np.array([0.5, 0.2, 0.1]), history, fresh, table
    bends = np.array([stiff, 0.1, 1e-9])
    for rounding in (1e-15, 1e-9):
        allowed = _SHIFT, _BEND, rounding
        found = step_errors(*given, allowed, bends)
        np.testing.assert_allclose(found, _slow(*given, allowed, bends), rtol=1e-6)
        only_bends = 1e9 * _SHIFT, _BEND, rounding
        found = step_errors(*given, only_bends, bends)
        np.testing.assert_allclose(found, _slow(*given, only_bends, bends), rtol=1e-6)
