"""Terminal shapes: the weak limit, hairpins, and the straight fiber under a uniform weight."""

from __future__ import annotations

import numpy as np
import pytest


def _assert_shapes(data) -> None:
    sag, span, velocity = (data[name].to_numpy() for name in ("sag", "span", "velocity"))
    assert np.all(np.diff(sag, axis=1) > 0.0)
    assert np.all(np.diff(span, axis=1) < 0.0)
    assert np.all(np.diff(velocity, axis=1) > 0.0), "bent fibers fall faster"
    assert velocity[0].max() < 2.0, "no faster than a straight fiber along itself"
    left_right = data["shape"].to_numpy()
    assert np.abs(left_right[..., 0, :] + left_right[..., 0, ::-1]).max() < 1e-4


def test_quick(quick):
    reproduced = quick("sedimentation")
    data = reproduced.data()
    _assert_shapes(data)
    at = "B = 1000, local drag"
    assert reproduced.ours(f"distance of the ends / L, {at}") == pytest.approx(0.3189, abs=1e-3)
    assert data["uniform_sag"].to_numpy()[0] < 1e-3
    from_hairpin = reproduced.ours("sag / L under a uniform weight, B = 1000, from")
    assert from_hairpin == pytest.approx(0.4079, abs=1e-3)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_full(full):
    _assert_shapes(full("sedimentation").data())
