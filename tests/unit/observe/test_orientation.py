"""Orientation tensor and nematic order of fibers whose directions are known."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.observe import observables
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.mobility import NonLocal
from support import assert_close


def _straight(directions) -> Snapshot:
    """Return straight fibers along `directions`, (fiber, 3)."""
    unit = np.asarray(directions, dtype=float)
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    fiber = DiscreteFiber.build(1.0, 1e-2, rigidity=1.0, intervals=10, mobility=NonLocal())
    positions = np.linspace(0.0, 1.0, 11)[:, None] * unit[:, None, :]
    return Snapshot.take(0.0, (fiber,) * len(unit), positions, np.zeros((len(unit), 11)))


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_parallel_fibers_have_order_one_with_heads_either_way(turn):
    along = np.array([np.cos(turn), np.sin(turn), 0.3])
    moment = _straight([along, -along, along])
    assert_close(observables.order_parameter(moment), 1.0, atol=1e-14)


def test_fibers_along_three_axes_have_no_order():
    moment = _straight(np.eye(3))
    assert abs(float(observables.order_parameter(moment))) < 1e-14
    assert_close(observables.orientation_tensor(moment), np.eye(3) / 3.0, rtol=1e-14)


def test_order_of_fibers_in_a_plane_and_of_two_across():
    # <pp> = diag(1/2, 1/2, 0) has the eigenvalues 1/4, 1/4, -1/2
    assert_close(observables.order_parameter(_straight(np.eye(3)[:2])), 0.25, atol=1e-14)
    # p at +-a to the x axis: the largest entry of the diagonal tensor is cos^2 a
    a = 0.3
    moment = _straight([[np.cos(a), np.sin(a), 0.0], [np.cos(a), -np.sin(a), 0.0]])
    assert_close(observables.order_parameter(moment), 1.5 * np.cos(a) ** 2 - 0.5, atol=1e-14)


def test_order_is_a_recorded_scalar():
    moment = _straight(np.eye(3)[:2])
    assert observables.recorded(moment)["order_parameter"](moment).shape == ()
