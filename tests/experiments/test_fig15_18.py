"""Figs. 15-18: the sum over periodic images, its approximations and their errors."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.experiments import images

PERIOD = images.PERIODS[0]


@pytest.fixture(scope="module")
def source() -> images.Source:
    """Return a planar arc, not symmetric; F vanishes at its ends and exerts no torque."""
    s = np.linspace(0.0, 1.0, 41)
    angle = 0.4 + 2.0 * s + 0.8 * s**2
    xs = np.stack([np.cos(angle), np.sin(angle), 0.0 * s])
    steps = 0.5 * (xs[:, 1:] + xs[:, :-1]) / 40.0
    x = np.concatenate([np.zeros((3, 1)), np.cumsum(steps, axis=1)], axis=1)
    normal = np.stack([-xs[1], xs[0], xs[2]])
    force = s * (1.0 - s) * ((1.0 + 2.0 * s) * xs + (3.0 - 6.0 * s) * normal)
    weights = np.full(41, 1.0 / 40.0)
    weights[[0, -1]] *= 0.5
    return images.Source(x - x[:, 20:21], xs, force, weights)


def _by_17(source: images.Source, r: np.ndarray) -> np.ndarray:
    """Return V of (17) for R of shape (3, node), term by term as printed."""
    size = np.linalg.norm(r, axis=0)
    hat = r / size
    total = np.zeros(3)
    for n, weight in enumerate(source.weights):
        h, t = hat[:, n], source.xs[:, n]
        matrix = (h @ t) * (np.eye(3) + 3.0 * np.outer(h, h)) - (np.outer(t, h) + np.outer(h, t))
        total -= weight * matrix @ source.force[:, n] / size[n] ** 2
    return total


def test_exact_images_are_17_with_the_papers_sign_of_p(source):
    found = source.images(0.9, np.array([-PERIOD]))[40]
    point = np.array([0.9, images.HEIGHTS[40], 0.0])
    r = point[:, None] - source.x - np.array([[PERIOD], [0.0], [0.0]])
    np.testing.assert_allclose(found, _by_17(source, r), rtol=1e-12)


@pytest.mark.parametrize("about", ["midpoint", "centre of mass"])
def test_far_images_are_17_with_one_r(source, about):
    centre = None if about == "midpoint" else source.centre_of_mass
    at = np.zeros(3) if centre is None else centre
    found = source.images(0.6, np.empty(0), [3.0 * PERIOD], centre=centre)[10]
    r = np.array([0.6 + 3.0 * PERIOD, images.HEIGHTS[10], 0.0]) - at
    # as printed, R outside the integral: symmetric in x_s and F only after integration
    expected = _by_17(source, np.repeat(r[:, None], 41, axis=1))
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-16)
    size = np.linalg.norm(r)
    form = 3.0 * r @ source.moments @ r / size**2 - np.trace(source.moments)
    np.testing.assert_allclose(found, -r * form / size**3, rtol=1e-12)


def test_reference_is_the_limit_within_its_bound(source):
    best, bound = source.reference(0.9, PERIOD)
    finer, smaller = source.reference(0.9, PERIOD, sizes=(160, 320, 640))
    off = np.linalg.norm(best - finer, axis=1).max()
    assert 0.0 < off < bound
    assert smaller < bound / 500.0
    largest = np.linalg.norm(finer, axis=1).max()
    assert bound < 1e-6 * largest
    # a plain sum of as many images is far from it: its rest falls as P^-2 only
    rests = [
        np.linalg.norm(source.images(0.9, PERIOD * np.arange(-p, p + 1.0)) - finer, axis=1).max()
        for p in (40, 80)
    ]
    assert rests[0] / rests[1] == pytest.approx((80.5 / 40.5) ** 2, rel=0.01)
    assert rests[1] > 100.0 * bound


def test_quick_shape(quick):
    fig15 = quick("fig15")
    x = fig15.data()["position"].to_numpy()
    assert (x[:, :, x.shape[2] // 2] == 0.0).all()
    assert fig15.ours("elastic energy of the straighter") == pytest.approx(0.25, abs=0.1)


def test_quick_reference(quick):
    fig16 = quick("fig16")
    assert 0.0 < fig16.ours("relative error of the reference") < 1e-6
    data = fig16.data().sel(filament="bent", period=2.0)
    assert np.isfinite(data["magnitude"].to_numpy()).all()


def test_quick_cut_off(quick):
    fig17 = quick("fig17")
    cut = fig17.ours("error of |p| <= 1, x = 0.9, %")
    assert cut == pytest.approx(8.9, abs=1.0)
    nearer = fig17.ours("error of |p| <= 1 and the nearer of |p| = 2, x = 0.9")
    assert nearer < 0.6 * cut < fig17.ours("error of |p| <= 1 and the farther of |p| = 2, x = 0.9")


def test_quick_moments(quick):
    fig18 = quick("fig18")
    middle = fig18.ours("error of (42), Q = 20, mid-point, x = 0.9")
    centre = fig18.ours("error of (42), Q = 20, centre of mass, x = 0.9")
    assert 1.8 * centre < middle < 1.0
    assert fig18.ours("error of (42), d = 3, x = 0.9, %") < 0.5 * middle


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    assert full("fig15").data().attrs["intervals"] == 200
    full("fig16")
    fig17, fig18 = full("fig17"), full("fig18")
    assert fig17.ours("error of |p| <= 1, x = 0.9, %") == pytest.approx(6.62, abs=0.1)
    nearer = fig17.ours("error of |p| <= 1 and the nearer of |p| = 2, x = 0.9")
    assert nearer == pytest.approx(3.34, abs=0.1)
    middle = fig18.ours("error of (42), Q = 20, mid-point, x = 0.9")
    assert middle == pytest.approx(0.723, abs=0.02)
    gain = fig18.ours("error of (42), mid-point over centre of mass, x = 0.9")
    assert gain == pytest.approx(3.67, abs=0.1)
