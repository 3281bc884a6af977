"""The far part's box and Green's function: slow sums, no dependence on the box, conventions."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import pytest

from reference import periodic_slow as slow
from stokesfibers.core.errors import InputError
from stokesfibers.summation.ewald.green import even_fast_length, far_box
from stokesfibers.summation.ewald.green_smooth import smooth_line, smooth_sheet, smooth_unbounded
from stokesfibers.summation.ewald.green_window import even_nodes, windowed_transform
from stokesfibers.summation.ewald.split import Split
from support import assert_close

INF = np.inf
POINTS = 9


def wavenumbers(box):
    """Modes -n/2+1 ... n/2-1 of each direction."""
    sides = zip(box.lengths, box.modes, strict=True)
    return [2.0 * np.pi / side * np.arange(-(n // 2) + 1, n // 2) for side, n in sides]


def far_sum(box, split, points, forces, radius=0.0):
    """The far part's definition, by plain discrete Fourier sums, at the points themselves.

    With the doublet a^2/2 D, a = `radius`: half the Laplacian of S.
    """
    k = wavenumbers(box)
    waves = [np.exp(-1j * np.outer(points[:, d], k[d])) for d in range(3)]
    kx, ky, kz = np.meshgrid(*k, indexing="ij", sparse=True)
    k2 = kx**2 + ky**2 + kz**2
    weight = split.multiplier(np.sqrt(k2)) * box.green(kx, ky, kz) / np.prod(box.lengths)
    weight = weight * (1.0 - 0.25 * radius**2 * k2)
    hat = [_to_modes(waves, forces[:, d]) for d in range(3)]
    along = (kx * hat[0] + ky * hat[1] + kz * hat[2]) / np.where(k2 > 0.0, k2, 1.0)
    out = np.empty((len(points), 3))
    for d, kd in enumerate((kx, ky, kz)):
        spectrum = weight * (hat[d] - kd * along)
        inner = np.tensordot(spectrum, waves[2].conj(), axes=(2, 1))
        inner = np.einsum("xyp,py->xp", inner, waves[1].conj())
        value = np.einsum("xp,px->p", inner, waves[0].conj())
        assert np.abs(value.imag).max() < 1e-12 * np.abs(value).max()
        out[:, d] = value.real
    return out + box.constant * forces.sum(axis=0)


def _to_modes(waves, f):
    left = (waves[0] * f[:, None])[:, :, None] * waves[1][:, None, :]
    return np.tensordot(left, waves[2], axes=(0, 0))


def cloud(periods, extent, *, neutral):
    """Points that fill a box, its corners among them, and forces."""
    rng = np.random.default_rng(3)
    # opposite faces are one face where periodic
    size = np.where(np.isfinite(periods), 0.93, 1.0) * extent
    points = rng.random((POINTS, 3)) * size
    points[0], points[1], points[2] = 0.0, size, size * (1.0, 0.0, 1.0)
    forces = rng.standard_normal((POINTS, 3))
    return points, forces - forces.mean(axis=0) if neutral else forces


def tensor(periods, r):
    """The slow tensor of all images, without the point itself; periods are inf where free."""
    axes = [d for d in range(3) if np.isfinite(periods[d])]
    if not axes:
        return slow.stokeslet(r)
    if len(axes) == 1:
        return slow.one_periodic(r, periods[axes[0]], axes[0])
    if len(axes) == 2:
        return slow.two_periodic(r, (periods[axes[0]], periods[axes[1]]), (axes[0], axes[1]))
    return slow.three_periodic(r, periods)


@cache
def pairs(periods, extent):
    """Differences of the cloud's pairs, and their slow tensors."""
    points, _ = cloud(periods, extent, neutral=False)
    one, other = np.triu_indices(POINTS)
    r = points[one] - points[other]
    return r, tensor(periods, r)


def applied(tensors, forces):
    """The sum over pairs i <= j of tensors that are even in r, and symmetric."""
    one, other = np.triu_indices(POINTS)
    full = np.empty((POINTS, POINTS, 3, 3))
    full[one, other] = full[other, one] = tensors
    return np.einsum("ijab,jb->ia", full, forces)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


CASES = [
    ((INF, INF, INF), (1.0, 1.0, 1.0)),
    ((INF, INF, INF), (0.5, 0.5, 2.0)),
    ((INF, INF, INF), (0.5, 2.0, 2.0)),
    ((INF, INF, 1.0), (1.0, 1.0, 1.0)),
    ((4.0, INF, INF), (4.0, 1.0, 1.0)),
    ((INF, 1.0, INF), (4.0, 1.0, 4.0)),
    ((1.0, 1.0, INF), (1.0, 1.0, 1.0)),
    ((4.0, INF, 1.0), (4.0, 1.0, 1.0)),
    ((INF, 1.0, 1.0), (4.0, 1.0, 1.0)),
    ((2.0, 2.0, INF), (2.0, 2.0, 0.5)),
    ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)),
    ((1.0, 1.0, 4.0), (1.0, 1.0, 4.0)),
    ((1.0, 4.0, 4.0), (1.0, 4.0, 4.0)),
]


@pytest.mark.parametrize(("periods", "extent"), CASES)
@pytest.mark.parametrize(
    ("kind", "tolerance", "rc"),
    [
        ("gaussian", 1e-4, 0.5),
        ("prolate", 1e-3, 0.5),
        ("prolate", 1e-6, 0.5),
        ("prolate", 1e-10, 0.6),
    ],
)
def test_far_part_is_the_slow_sum_less_the_near_part(periods, extent, kind, tolerance, rc):
    """With a net force where there is a sum for it: none and three periodic directions."""
    split = getattr(Split, kind)(tolerance, rc)
    free = np.isinf(periods).sum()
    points, forces = cloud(periods, extent, neutral=free in (1, 2))
    r, whole = pairs(periods, extent)
    expected = applied(whole - slow.near_images(split, r, periods), forces)
    far = far_sum(far_box(periods, extent, split), split, points, forces)
    assert rms(far - expected) < tolerance * rms(applied(whole, forces))


@pytest.mark.parametrize(("periods", "extent"), [c for c in CASES if np.isinf(c[0]).any()])
@pytest.mark.parametrize(("tolerance", "rc"), [(1e-3, 0.4), (1e-6, 0.6), (1e-9, 0.8), (1e-12, 0.9)])
def test_box_adds_little_to_the_error_of_the_split(periods, extent, tolerance, rc):
    """A box made for a larger cloud gives the same, to a part of the tolerance."""
    split = Split.gaussian(tolerance, rc)
    points, forces = cloud(periods, extent, neutral=False)
    far = far_sum(far_box(periods, extent, split), split, points, forces)
    wider = far_sum(far_box(periods, 1.2 * np.array(extent), split), split, points, forces)
    share = 0.15 if tolerance > 1e-11 else 5.0  # rounding: k^2 times a B of some 100
    assert rms(far - wider) < share * tolerance * rms(wider)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-10])
def test_free_far_part_is_the_mollified_stokeslet_to_a_tenth_of_the_tolerance(tolerance):
    split = Split.prolate(tolerance, 0.4)
    extent = (0.2, 1.0, 2.0)
    free = (INF, INF, INF)
    points, forces = cloud(free, extent, neutral=False)
    r, whole = pairs(free, extent)
    expected = applied(slow.mollified(split.multiplier, split.k_max, r), forces)
    far = far_sum(far_box(free, extent, split), split, points, forces)
    assert rms(far - expected) < 0.1 * tolerance * rms(applied(whole, forces))


def test_slow_sums_agree_with_each_other():
    """Lines of images against modes, up to a constant; Hasimoto's number for the cubic array."""
    rng = np.random.default_rng(5)
    r = rng.random((6, 3)) * (1.0, 2.0, 0.5) + (0.0, 0.0, 0.5)
    lines = slow.two_periodic(r, (1.0, 2.0), (0, 1))
    modes = slow.two_periodic_modes(r, (1.0, 2.0))
    assert_close(lines - lines[0], modes - modes[0], rtol=1e-11)
    cubic = slow.three_periodic(np.zeros((1, 3)), (1.0, 1.0, 1.0))[0]
    assert_close(cubic, -4.0 / 3.0 * 2.837297479480619 * np.eye(3), rtol=1e-11)
    plain = slow.one_periodic(r, 1.0, 0)
    assert_close(slow.one_periodic(r + np.eye(3)[0], 1.0, 0), plain, rtol=1e-12)


def test_net_force_with_one_period_is_the_sum_of_the_convention():
    """One source: the far part at points beyond rc is the whole sum, less nearer images."""
    split = Split.prolate(1e-9, 0.8)
    periods, extent = (INF, 1.3, INF), (1.0, 1.3, 2.0)
    points, _ = cloud(periods, extent, neutral=False)
    forces = np.zeros((POINTS, 3))
    forces[0] = (0.3, -1.0, 0.7)
    r = points - points[0]
    expected = tensor(periods, r) - slow.near_images(split, r, periods)
    far = far_sum(far_box(periods, extent, split), split, points, forces)
    assert_close(far, expected @ forces[0], rtol=5e-9)


def test_net_force_with_two_periods_is_symmetric_about_the_plane():
    split = Split.prolate(1e-9, 0.8)
    periods, extent = (1.0, 1.5, INF), (1.0, 1.5, 2.0)
    points, _ = cloud(periods, extent, neutral=False)
    points = points[points[:, 2] > 0.3]
    points = np.concatenate([np.zeros((1, 3)), points])
    forces = np.zeros(points.shape)
    forces[0] = (0.3, -1.0, 0.7)
    r = points[1:]
    expected = slow.two_periodic_modes(r, periods[:2]) - slow.near_images(split, r, periods)
    far = far_sum(far_box(periods, extent, split), split, points, forces)
    assert_close(far[1:], expected @ forces[0], rtol=5e-9)


@pytest.mark.parametrize(
    ("periods", "tail"),
    [((INF, INF, INF), 1e-7), ((INF, INF, 5.0), 1e-5), ((5.0, 5.0, INF), 3e-3)],
)
def test_doublet_needs_no_box_of_its_own(periods, tail):
    """Beyond rc it is the sum of (a^2/2) D, D = (I - 3 rr)/r^3; `tail` are images left out."""
    split = Split.prolate(1e-10, 0.8)
    points = np.array([[0.0, 0.0, 0.0], [0.9, 0.1, 0.2], [0.5, 0.8, 0.3], [0.1, 0.2, 0.9]])
    forces = np.zeros((4, 3))
    forces[0] = (1.0, -2.0, 0.5)
    box = far_box(periods, np.ptp(points, axis=0), split)
    a = 0.3
    doublet = far_sum(box, split, points, forces, a) - far_sum(box, split, points, forces)
    expected = np.zeros((3, 3))
    for image in product(*(range(-40, 41) if np.isfinite(d) else [0] for d in periods)):
        r = points[1:] + np.where(np.isfinite(periods), periods, 0.0) * image
        size = np.linalg.norm(r, axis=1)[:, None]
        expected += forces[0] / size**3 - 3.0 * r * (r @ forces[0])[:, None] / size**5
    assert_close(doublet[1:], 0.5 * a**2 * expected, rtol=tail)


def _ball_modes(extent, split):
    """Modes with the truncation at the radius diagonal + rc, the smooth or the sharp one."""
    radius = np.linalg.norm(extent) + split.rc
    needed = split.k_max * (np.array(extent) + radius + split.rc) / np.pi
    return np.prod([even_fast_length(int(np.ceil(v)) + 1) for v in needed])


@pytest.mark.parametrize(
    ("extent", "rc", "share"),
    [((1.0, 1.0, 1.0), 0.08, 0.5), ((1.0, 1.0, 4.0), 0.1, 0.2), ((1.0, 4.0, 4.0), 0.1, 0.25)],
)
def test_box_needs_fewer_modes_than_a_truncated_ball(extent, rc, share):
    split = Split.prolate(1e-6, rc)
    box = far_box((INF, INF, INF), extent, split)
    assert np.prod(box.modes) < share * _ball_modes(extent, split)


def test_box_covers_the_cloud_its_reach_and_the_spectrum():
    split = Split.prolate(1e-6, 0.3)
    box = far_box((INF, 2.0, INF), (1.0, 2.0, 0.0), split)
    assert box.lengths[1] == 2.0
    assert np.all(box.lengths[[0, 2]] > 2.0 * (np.array([1.0, 0.0]) + split.rc))
    largest = 2.0 * np.pi / box.lengths * (box.modes // 2)
    assert np.all(largest > split.k_max)
    assert np.all(largest[[0, 2]] < 1.1 * split.k_max)
    assert np.all(box.modes % 2 == 0)


def test_small_changes_of_the_cloud_keep_the_box():
    split = Split.prolate(1e-6, 0.1)
    sides = np.linspace(1.0, 1.2, 40)
    boxes = [far_box((INF, INF, INF), (v, v, v), split) for v in sides]
    assert len({tuple(b.lengths) for b in boxes}) <= 8
    assert all(b.lengths[0] >= 2.0 * (v + split.rc) for b, v in zip(boxes, sides, strict=True))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_axes_are_alike(axis):
    """Turning the axes turns the table and the constant."""
    split = Split.prolate(1e-6, 0.5)
    periods, extent = np.array([1.0, INF, INF]), np.array([1.0, 0.5, 1.5])
    box = far_box(periods, extent, split)
    turned = far_box(np.roll(periods, axis), np.roll(extent, axis), split)
    table = np.moveaxis(box.green(*np.ix_(*wavenumbers(box))), range(3), np.roll(range(3), -axis))
    assert_close(turned.green(*np.ix_(*wavenumbers(turned))), table, rtol=1e-11)
    assert_close(turned.constant, np.roll(box.constant, axis), rtol=1e-9)


@pytest.mark.parametrize("periods", [(INF, INF, INF), (2e-6, INF, INF), (2e-6, 1e-6, INF)])
def test_units_do_not_matter(periods):
    extent, scale = np.array([2e-6, 1e-6, 1e-6]), 1e6
    small = far_box(periods, extent, Split.prolate(1e-6, 0.5e-6))
    large = far_box(np.array(periods) * scale, extent * scale, Split.prolate(1e-6, 0.5))
    assert np.array_equal(small.modes, large.modes)
    table = large.green(*np.ix_(*wavenumbers(large)))
    assert_close(small.green(*np.ix_(*wavenumbers(small))) * scale**2, table, rtol=1e-11)
    if np.isinf(periods).sum() != 2:  # the logarithm takes the period as its unit
        assert_close(small.constant / scale, large.constant, rtol=1e-9)


def test_three_periods_take_any_wavenumber():
    box = far_box((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), Split.prolate(1e-3, 0.4))
    assert_close(
        box.green([0.0, 0.1, 0.1], [0.0, 0.2, 0.0], [0.0, 0.2, 0.0]),
        [0.0, 8.0 * np.pi / 0.09, 8.0 * np.pi / 0.01],
        rtol=1e-14,
    )
    assert_close(box.constant + 1.0, np.ones(3))


def test_wavenumbers_that_are_no_modes_are_refused():
    split = Split.prolate(1e-3, 0.4)
    box = far_box((INF, 1.0, 1.0), (1.0, 1.0, 1.0), split)
    step = 2.0 * np.pi / box.lengths
    assert box.green(step[0], -step[1], 0.0) == box.green(-step[0], step[1], 0.0)
    with pytest.raises(InputError, match=r"wavenumbers\[0\]"):
        box.green(1.01 * step[0], 0.0, 0.0)
    with pytest.raises(InputError, match=r"wavenumbers\[2\]"):
        box.green(0.0, 0.0, step[2] * (box.modes[2] // 2 + 1))
    with pytest.raises(InputError, match=r"wavenumbers\[1\]"):
        box.green(0.0, np.nan, 0.0)


@pytest.mark.parametrize(
    ("periods", "extent", "where"),
    [
        ((1.0, 0.0, 1.0), (1.0, 1.0, 1.0), "periods"),
        ((1.0, np.nan, 1.0), (1.0, 1.0, 1.0), "periods"),
        ((1.0, 1.0), (1.0, 1.0, 1.0), "periods"),
        ((INF, INF, 1.0), (-1.0, 1.0, 1.0), "extent"),
        ((INF, INF, 1.0), (INF, 1.0, 1.0), "extent"),
        ((INF, INF, 1.0), (np.nan, 1.0, 1.0), "extent"),
    ],
)
def test_bad_boxes_are_refused(periods, extent, where):
    with pytest.raises(InputError, match=where):
        far_box(periods, extent, Split.prolate(1e-3, 0.4))


def test_smooth_parts_are_sums_of_gaussians():
    """Against adaptive quadrature of the integral over t; for q = 0 up to a + b r^2."""
    t0, q = 0.03, 0.7
    across, along = np.array([0.2, 0.9, 1.7]), np.array([0.1, 1.1])

    def integral(x2, free, q):
        end = np.log(t0 + 60.0 / q**2) if q else 50.0
        z, w = np.polynomial.legendre.leggauss(300)
        half = 0.5 * (end - np.log(t0))
        t = t0 * np.exp(half * (1.0 + z))
        y = 0.25 * x2 / t
        less = np.where(y < 1e-3, y**2 * (0.5 - y / 6.0 + y**2 / 24.0), np.expm1(-y) + y)
        gaussian = np.exp(-y) if q else less
        front = t**2 * (4.0 * np.pi * t) ** (-0.5 * free) * np.exp(-(q**2) * t)
        return -8.0 * np.pi * half * (front * gaussian) @ w

    sheet = [integral(x**2, 1, q) for x in across]
    assert_close(smooth_sheet(np.array([q]), across, t0)[0], sheet, rtol=1e-10)
    line = [[integral(x**2 + y**2, 2, q) for y in along] for x in across]
    assert_close(smooth_line(q, [across, along], t0), line, rtol=1e-10)
    for free in (1, 2, 3):
        axes = [across, np.array([0.3]), np.array([0.4])][:free]
        x2 = across**2 + (0.3**2 if free > 1 else 0.0) + (0.4**2 if free > 2 else 0.0)
        differences = smooth_unbounded(axes, t0).ravel() - [integral(v, free, 0.0) for v in x2]
        slope = (differences[2] - differences[0]) / (x2[2] - x2[0])
        assert_close(differences[1], differences[0] + slope * (x2[1] - x2[0]), rtol=1e-9)


def test_windowed_transform_of_a_gaussian():
    """The window is one to begin with, falls smoothly, and half of it is gone in the middle."""
    count, flat, width = 40, 1.0, 0.5
    k = np.array([0.0, 1.0, 7.0])
    values = np.exp(-20.0 * even_nodes(count, flat + width) ** 2)
    expected = np.sqrt(np.pi / 20.0) * np.exp(-(k**2) / 80.0)
    transform = windowed_transform(k, flat, width, count)
    assert_close(transform @ values, expected, rtol=3e-9)  # exp(-20) is cut
    ones = transform @ np.ones(count)
    assert_close(ones[0], 2.0 * (flat + 0.5 * width), rtol=1e-12)
