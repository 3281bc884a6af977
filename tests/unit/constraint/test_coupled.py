"""Solvers of the coupled tension equation on systems that cannot be solved."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.constraint.coupled import (
    AbstractTensionSolver,
    CoupledSystem,
    FixedPoint,
    Krylov,
    TensionError,
)
from support import assert_close

SIZE = 3
BOTH = pytest.mark.parametrize("solver", [FixedPoint(), Krylov()], ids=lambda s: s.kind)


def _system(coupling: float, right: float = 1.0) -> CoupledSystem:
    """Return two fibers of three tensions; the sweeps contract by coupling^2."""
    influence = np.zeros((2, SIZE, 2, SIZE))
    influence[0, :, 1] = influence[1, :, 0] = coupling * np.eye(SIZE)
    return CoupledSystem(
        np.stack([np.eye(SIZE)] * 2), influence, right * np.arange(1.0, 7.0).reshape(2, SIZE)
    )


@BOTH
def test_both_solve_a_coupled_system(solver: AbstractTensionSolver) -> None:
    system = _system(0.5)
    found, iterations = solver.solve(system, np.zeros((2, SIZE)))
    assert iterations > 1
    residual = found + 0.5 * found[::-1] - system.right
    assert_close(residual + system.right, system.right, rtol=1e-5)


def test_sweeps_that_diverge_say_so() -> None:
    with np.errstate(all="ignore"), pytest.raises(TensionError, match="last change inf"):
        FixedPoint(most=10_000).solve(_system(3.0), np.zeros((2, SIZE)))


@BOTH
def test_a_system_that_is_not_finite_is_refused(solver: AbstractTensionSolver) -> None:
    with pytest.raises(np.linalg.LinAlgError, match="not finite"):
        solver.solve(_system(0.5, right=np.nan), np.zeros((2, SIZE)))
