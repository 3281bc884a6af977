"""Cut-off image sums and (42) against the exact sum."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.experiments import images_exact
from stokesfibers.experiments import slow_sums as slow
from stokesfibers.experiments.slow_sums import Pairs
from support import assert_close

pytest.importorskip("ducc0")


@pytest.fixture(scope="module")
def pairs() -> Pairs:
    """Nodes of an arc with forces that neither push nor turn it, and a few targets."""
    s, w = np.polynomial.legendre.leggauss(images_exact._NODES)
    sources = np.stack([0.3 * s, 0.4 * s**2 - 0.1 * s, 0.1 * s**3], axis=1)
    gap = sources[:, None] - sources[None]  # springs between all: no net force and no torque
    pull = np.outer(w, w) * np.cos(3.0 * np.add.outer(s, s))
    forces = np.einsum("ij,ijk->ik", pull, gap)
    targets = np.array([[0.7, 0.2, 0.0], [0.9, -0.4, 0.1]])
    return Pairs(targets, sources - sources[len(s) // 2], forces)


def test_moments_stand_for_far_images(pairs):
    """With (42) and without it the same images are summed, the farther ones all but exactly."""
    both = (
        images_exact._approximate(pairs, 2.0, name, (12, 60)) for name in ("midpoint", "centre")
    )
    exact = images_exact._approximate(pairs, 2.0, "cut", (60, 60))
    cut = images_exact._approximate(pairs, 2.0, "cut", (12, 60))
    for found in both:
        assert np.abs(found - exact).max() < 0.2 * np.abs(cut - exact).max()


def test_replaced_images_are_the_exact_sum(pairs):
    expected = slow.one_direction(pairs, 2.0, 0)
    assert_close(images_exact._by_replaced_images(pairs, 2.0), expected, rtol=1e-9)


@pytest.mark.timeout(1800)
def test_quick(quick):
    data = quick("images").data()
    error = data["error"]
    for better, worse in (("midpoint", "cut"), ("centre", "midpoint")):
        ratio = error.sel(sum=worse) / error.sel(sum=better)
        assert float(ratio.min()) > 1.2
    assert bool((error.diff("reach") < 0.0).all()), "each more image makes it better"
    assert bool((error.sel(reach=1).diff("x") > 0.0).all()), "and each step towards the next worse"


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_full(full):
    full("images")
