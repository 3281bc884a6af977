"""The split: mollifiers, near polynomials, self terms, band-widths; a bad fit is refused."""

from __future__ import annotations

import numpy as np
import pytest

from reference.periodic_slow import mollified, stokeslet
from stokesfibers.core.errors import InputError
from stokesfibers.summation.ewald import Split
from stokesfibers.summation.ewald.accuracy import bandwidth_for, estimated_error, self_error
from stokesfibers.summation.ewald.near_polynomial import KERNELS, evaluate, fit
from stokesfibers.summation.ewald.prolate import prolate_series, prolate_values
from support import assert_close

RC = 0.4
KINDS = ("prolate", "gaussian")


def _split(kind, tolerance):
    return getattr(Split, kind)(tolerance, RC)


def _far(split, r, radius=0.0):
    """Return the far part's tensors at distances r along x, from the polynomials, (pair, 3, 3)."""
    near = fit(split)
    r2 = (r * near.scale) ** 2
    pa, pb = near.folded(radius)
    out = evaluate(pa, r2)[:, None, None] * np.eye(3)
    out[:, 0, 0] += evaluate(pb, r2) * r2
    return near.scale * out


def test_prolate_function_is_its_own_transform():
    c = 12.0
    series = prolate_series(c)
    z, w = np.polynomial.legendre.leggauss(100)
    t = np.linspace(0.0, 1.0, 9)
    transform = np.cos(c * np.outer(t, z)) @ (w * prolate_values(series, z))
    assert_close(transform / transform[0], prolate_values(series, t), rtol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_polynomials_are_the_transform_of_the_far_spectrum(kind, tolerance):
    split = _split(kind, tolerance)
    distance = np.linspace(0.01, 0.999, 40) * RC
    r = np.zeros((40, 3))
    r[:, 0] = distance
    expected = mollified(split.multiplier, split.k_max, r)
    # what the spectrum lacks beyond k_max is a few times the tolerance, relative to 1/r at r = 0
    assert_close(_far(split, distance), expected, rtol=3.0 * tolerance)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_polynomials_with_doublets_are_the_transform_of_the_far_spectrum(kind, tolerance):
    split, radius = _split(kind, tolerance), 0.1 * RC
    distance = np.linspace(0.01, 0.999, 40) * RC
    r = np.zeros((40, 3))
    r[:, 0] = distance
    expected = mollified(
        lambda k: split.multiplier(k) * (1.0 - 0.25 * (radius * k) ** 2), split.k_max, r
    )
    assert_close(_far(split, distance, radius), expected, rtol=5.0 * tolerance)
    assert np.abs(_far(split, distance) - expected).max() > 0.01 * np.abs(expected).max()


@pytest.mark.parametrize("kind", KINDS)
def test_far_part_meets_the_stokeslet_at_the_cutoff(kind):
    for tolerance in (1e-3, 1e-6, 1e-9):
        split = _split(kind, tolerance)
        edge = np.array([[RC, 0.0, 0.0]])
        far = _far(split, edge[:, 0])
        # Phi' does not vanish there: a few tens of tolerances, on a shell without thickness
        assert_close(far, stokeslet(edge), rtol=40.0 * tolerance)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("radius", [0.0, 0.08])
def test_self_term_is_the_polynomial_at_the_origin(kind, radius):
    for tolerance in (1e-4, 1e-9):
        split = _split(kind, tolerance)
        near = fit(split)
        found = near.scale * evaluate(near.folded(radius)[0], np.zeros(1))[0]
        # beyond k_max the closed form of the Gaussian goes on
        assert found == pytest.approx(split.at_origin(radius), rel=tolerance)
        expected = mollified(
            lambda k, s=split: s.multiplier(k) * (1.0 - 0.25 * (radius * k) ** 2),
            split.k_max,
            np.array([[1e-5 * RC, 0.0, 0.0]]),
        )[0, 0, 0]
        assert split.at_origin(radius) == pytest.approx(expected, rel=200.0 * tolerance)


def test_mollifier_and_multiplier():
    for kind in KINDS:
        split = _split(kind, 1e-8)
        k = np.linspace(0.0, 0.98 * split.k_max, 50)
        h = 1e-4 * split.k_max
        derivative = (split.mollifier(k + h) - split.mollifier(np.abs(k - h))) / (2.0 * h)
        assert split.mollifier(np.zeros(1))[0] == pytest.approx(1.0, abs=1e-14)
        assert_close(split.multiplier(k), split.mollifier(k) - 0.5 * k * derivative, rtol=1e-6)
        assert split.multiplier(np.array([1.001 * split.k_max]))[0] == 0.0


def test_prolate_bandwidth_is_smaller():
    # the study's 9, 17, 24 for the prolate, 27 for the Gaussian at 1e-6, with a margin
    for tolerance, most in ((1e-3, 11.5), (1e-6, 19.0), (1e-9, 26.5)):
        assert bandwidth_for("prolate", tolerance) < most
        wide = bandwidth_for("gaussian", tolerance)
        assert 1.3 * bandwidth_for("prolate", tolerance) < wide


@pytest.mark.parametrize("kind", KINDS)
def test_bandwidth_is_what_the_estimate_asks_for(kind):
    for tolerance in (1e-3, 1e-7, 1e-11):
        width = bandwidth_for(kind, tolerance)
        assert estimated_error(kind, width, 0.5) == pytest.approx(0.4 * tolerance, rel=0.05)


def _variance(left_out, end):
    """Return what a kernel (pair, 3, 3) at distances up to `end` makes of random forces.

    Per component and density of points; the rest falls like 1 / end.
    """
    sums = []
    for most in (end, 2.0 * end):
        r = (np.arange(int(40 * most)) + 0.5) / 40.0
        square = np.sum(left_out(r) ** 2, axis=(1, 2))
        sums.append(np.sum(4.0 * np.pi * r**2 * square) / 3.0 / 40.0)
    return 2.0 * sums[1] - sums[0]


def _along_x(r):
    at = np.zeros((len(r), 3))
    at[:, 0] = r
    return at


def _velocity_variance():
    """The same of the whole sum in a periodic cube of side 1: (128 pi^2 / 3) sum |2 pi m|^-4."""
    m2 = np.add.outer(np.add.outer(*[np.arange(-40.0, 41.0) ** 2] * 2), np.arange(-40.0, 41.0) ** 2)
    inside = (m2 > 0.0) & (m2 <= 1600.0)
    lattice = np.sum(m2[inside] ** -2.0) + 4.0 * np.pi / 40.0
    return 128.0 * np.pi**2 / 3.0 * lattice / (2.0 * np.pi) ** 4


@pytest.mark.parametrize("width", [9.0, 14.0])
def test_the_estimate_is_the_variance_of_the_kernel_that_prolate_splits_leave_out(width):
    split = Split("prolate", 1e-8, 1.0, width)

    def left_out(r):
        exact = stokeslet(_along_x(r))
        exact[r < 1.0] = _far(split, r[r < 1.0])
        return exact - mollified(split.multiplier, split.k_max, _along_x(r))

    expected = np.sqrt(_variance(left_out, 12.0) / _velocity_variance())
    assert estimated_error("prolate", width, 1.0) == pytest.approx(expected, rel=0.04)


@pytest.mark.parametrize("width", [10.0])
def test_the_estimate_is_the_variance_of_both_kernels_that_gaussian_splits_leave_out(width):
    """The near part beyond rc = 1, and the far part beyond K: taken to be independent."""
    xi = np.sqrt(0.5 * width)

    def gamma(k):
        return np.exp(-((0.5 * k / xi) ** 2)) * (1.0 + (0.5 * k / xi) ** 2)

    def near(r):
        rest = stokeslet(_along_x(r)) - mollified(gamma, 5.0 * width, _along_x(r))
        return np.where(r[:, None, None] > 1.0, rest, 0.0)

    def far(r):
        return mollified(gamma, 5.0 * width, _along_x(r)) - mollified(gamma, width, _along_x(r))

    variance = _variance(near, 3.0) + _variance(far, 12.0)
    expected = np.sqrt(variance / _velocity_variance())
    assert estimated_error("gaussian", width, 1.0) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("kind", KINDS)
def test_few_points_err_by_what_each_does_to_itself(kind):
    """Each velocity errs by what the force there does to itself, whatever the density."""
    width, share = 12.0, 0.3
    split = Split(kind, 1e-8, 1.0, width)
    origin = mollified(split.multiplier, split.k_max, np.array([[1e-6, 0.0, 0.0]]))[0, 0, 0]
    own = split.at_origin() - origin
    assert self_error(kind, width) == pytest.approx(abs(own), rel=1e-6)
    dense = estimated_error(kind, width, share)
    for density in (1.0, 8.0):
        # velocities have a variance of this constant, times density over share in units of rc
        expected = np.sqrt(dense**2 + own**2 * share / (_velocity_variance() * density))
        assert estimated_error(kind, width, share, density) == pytest.approx(expected, rel=1e-3)


def test_precision_follows_from_the_tolerance():
    assert fit(_split("prolate", 1e-6)).precision == "single"
    assert fit(_split("prolate", 1e-7)).precision == "double"
    assert fit(_split("prolate", 1e-7)).degree == KERNELS[1][1]


def test_a_fit_that_misses_its_tolerance_is_refused():
    with pytest.raises(InputError, match=r"degree 9 meet .* misfit of .* band-width"):
        fit(_split("prolate", 1e-9), degree=9)
    with pytest.raises(InputError, match="misfit"):
        fit(Split.prolate(1e-9, RC, bandwidth=130.0))


@pytest.mark.parametrize("tolerance", [1e-15, 0.5, 0.0, float("nan")])
def test_tolerance_out_of_reach_is_refused(tolerance):
    with pytest.raises(InputError, match="tolerance") as caught:
        Split.prolate(tolerance, RC)
    if tolerance > 0.0:
        assert "1e-12" in str(caught.value)
