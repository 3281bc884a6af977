"""Filaments in contact: the reference against closed forms, and the quick tier's statements."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.experiments import contact_scenes as scenes
from stokesfibers.experiments.contact_rules import SpectralSource
from support import assert_close

DOUBLET = 0.5e-6


def _constant(s):
    return np.tile(np.array([[1.0], [0.0], [1.0]]), s.size)


def _closed_form(x, d):
    """V + DOUBLET W of a unit force along and one across, by a straight filament below at d."""
    high, low = x + 0.5, x - 0.5

    def between(integral):
        return integral(high) - integral(low)

    r1 = between(lambda u: np.arcsinh(u / d))
    r3 = between(lambda u: u / (d * d * np.hypot(u, d)))
    r5 = between(
        lambda u: u / (3.0 * d * d * np.hypot(u, d) ** 3) + 2.0 * u / (3.0 * d**4 * np.hypot(u, d))
    )
    u3 = between(lambda u: -1.0 / np.hypot(u, d))
    u5 = between(lambda u: -1.0 / (3.0 * np.hypot(u, d) ** 3))
    along = r1 + (r1 - d * d * r3) + DOUBLET * (r3 - 3.0 * (r3 - d * d * r5))
    across = r1 + d * d * r3 + DOUBLET * (r3 - 3.0 * d * d * r5)
    mixed = d * (u3 - 3.0 * DOUBLET * u5)
    return np.array([along + mixed, 0.0, across + mixed])


@pytest.mark.parametrize("distance", [0.3, 2.1e-3, 1e-4])
def test_reference_and_rule_are_the_closed_form_above_a_straight_filament(distance):
    parallel = scenes.arrangements()[0]
    s = np.array([0.0, 0.31, 0.5, 0.97])
    points = np.ascontiguousarray(parallel.target(s, distance).T)
    expected = [_closed_form(x - 0.5, distance) for x in s]
    found = scenes.exact_velocity(
        lambda at: parallel.source.sample(at).x, (_constant,), points, DOUBLET
    )[0]
    assert_close(found, expected, rtol=1e-12)
    source = SpectralSource.of(parallel.source, eps=1e-3, nodes=24)
    for tolerance in (1e-5, 1e-9):
        by_rule = source.velocity(points, _constant, tolerance)
        assert_close(by_rule, expected, rtol=tolerance)


@pytest.mark.parametrize("place", scenes.arrangements(), ids=lambda a: a.name)
def test_filaments_are_as_far_apart_as_said(place):
    s = np.linspace(0.0, 1.0, 501)
    points = place.target(np.array([0.41, 0.56]), 0.02)
    source = place.source.sample(np.linspace(0.0, 1.0, 5001)).x
    apart = np.linalg.norm(points[:, :, None] - source[:, None], axis=0).min(axis=1)
    assert apart.min() == pytest.approx(0.02, rel=1e-4)
    everywhere = place.target(s, 0.02)
    least = np.linalg.norm(everywhere[:, :, None] - source[:, None, ::5], axis=0).min()
    assert least > 0.02 * (1.0 - 1e-6)


def test_the_force_is_the_derivative_of_one_that_vanishes_at_both_ends():
    s = np.linspace(0.0, 1.0, 2001)
    whole = scenes.integrated_force(s)
    assert np.abs(whole).max() > 0.2
    assert np.abs(whole[:, [0, -1]]).max() == 0.0
    slope = np.gradient(whole, s, axis=1)[:, 1:-1]
    assert_close(slope, scenes.smooth_force(s)[:, 1:-1], rtol=1e-5)


def test_quick(quick):
    found = quick("contact")
    for name in ("parallel", "sliding", "crossed", "bent"):
        for force in ("a force of degree 5", "a force of all modes"):
            assert found.ours(f"error over tolerance, largest, {name}, {force}") < 1.0
        assert found.ours(f"error, 32 nodes alone, {name}") > 0.1
    # a tenth of a radius is a fiftieth of an interval: the paper's nodes are far apart
    assert found.ours("error, trapezoidal, N = 100, parallel") == pytest.approx(20.0, rel=0.02)
    assert found.ours("error, refined, N = 100, parallel") == pytest.approx(0.151, rel=0.02)
    assert found.ours("points for 1e-06, panels, bent") == 248
    assert found.ours("points for 1e-06, sinh, bent") == 64
    assert found.ours("smallest error, swap, bent") > 1e-13
    # own turns are left to the nodes
    assert found.ours("error, own velocity, turns 0.050 L apart, N = 32") > 1e-4
    assert found.ours("error, own velocity, turns 0.050 L apart, N = 64") < 1e-5
    data = found.data()
    # a tighter tolerance errs less
    largest = data["by_rule"].sel(arrangement="crossed").max(["force", "eps", "nodes", "gap"])
    assert (np.diff(largest.to_numpy()) < 0.0).all()


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_full(full):
    found = full("contact")
    assert found.verdict("error over tolerance, largest, bent, a force of all modes") == "agrees"
