"""The Ewald sum against plain sums: free, periodic, sheared; filaments, doublets, other targets."""

from __future__ import annotations

import numpy as np
import pytest

from reference.ewald_slow import (
    free_sum,
    laplacian,
    lattice_sum,
    lattice_tensor,
    relative,
    stokeslet,
)
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.sheared import Sheared
from stokesfibers.summation.ewald import EwaldSum

pytest.importorskip("ducc0")
WORKERS = Workers(1)
BOX = Periodic((1.0, 1.2, 0.9))
TIGHT = EwaldSum(1e-10)


def _cloud(count, seed=3):
    rng = np.random.default_rng(seed)
    return rng.random((count, 3)), rng.standard_normal((count, 3))


def _sum(domain, sources, forces, *, ewald=TIGHT, targets=None, **more):
    return ewald.plan(domain, sources, targets, workers=WORKERS, **more).execute(forces)


def _vectors(domain):
    vectors = np.diag(domain.lengths)
    vectors[1, 0] = getattr(domain, "offset", 0.0)
    return vectors


def _filaments(domain):
    """Return filaments of 4 nodes that cross borders, one of them longer than a period."""
    rng = np.random.default_rng(7)
    steps = rng.standard_normal((3, 4, 3))
    steps *= np.array([0.05, 0.1, 0.3])[:, None, None] / np.linalg.norm(steps, axis=2)[..., None]
    steps[2] = [0.0, 0.45, 0.05]
    points = (rng.random((3, 1, 3)) * domain.lengths * 3.0 - domain.lengths) + np.cumsum(steps, 1)
    return points.reshape(-1, 3), np.repeat([4, -1, 9], 4), rng.standard_normal((12, 3))


def _own(names):
    return lambda i, j: i == j or (names[i] == names[j] and names[i] >= 0)


def test_free_sum_is_the_sum_over_pairs():
    x, f = _cloud(60)
    expected = free_sum(x, x, f, left_out=lambda i, j: i == j)
    assert relative(_sum(Free(), x, f), expected) < 1e-10


def test_other_targets_feel_all_sources():
    x, f = _cloud(40)
    targets = np.random.default_rng(5).random((30, 3)) * 2.0 - 0.7
    expected = free_sum(targets, x, f)
    assert relative(_sum(Free(), x, f, targets=targets), expected) < 1e-10
    shorter = _sum(Free(), x, f, targets=targets, ewald=EwaldSum(1e-10, rc=0.4))
    assert relative(shorter, expected) < 1e-10


@pytest.mark.parametrize("domain", [BOX, Sheared((1.0, 1.2, 0.9), 0.2)], ids=["box", "sheared"])
@pytest.mark.parametrize("rc", [0.2, 0.45])
def test_lattice_sum_is_that_of_plain_series(domain, rc):
    x, f = _cloud(6)
    x = 3.0 * x - 1.0
    expected = lattice_sum(x, x, f, _vectors(domain))
    assert relative(_sum(domain, x, f, ewald=EwaldSum(1e-10, rc=rc)), expected) < 1e-10


def test_hasimoto_drag_of_a_simple_cubic_array():
    one = np.array([[0.3, 0.9, 0.1]])
    velocity = _sum(Periodic((1.0, 1.0, 1.0)), one, np.array([[0.0, 0.0, 1.0]]))
    # U = F / (6 pi mu a) (1 - 2.837297 a / L), and here 8 pi mu U without the sphere's own part
    assert velocity[0, 2] * 0.75 == pytest.approx(-2.8372974794806, abs=1e-9)
    assert np.abs(velocity[0, :2]).max() < 1e-12


@pytest.mark.parametrize("domain", [BOX, Sheared((1.0, 1.2, 0.9), -0.3)], ids=["box", "sheared"])
@pytest.mark.parametrize("rc", [0.12, 0.45])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-10])
def test_own_pairs_in_the_same_image_are_left_out(domain, rc, tolerance):
    x, names, f = _filaments(domain)
    expected = lattice_sum(x, x, f, _vectors(domain), own=_own(names))
    ewald = EwaldSum(tolerance, rc=rc)
    assert relative(_sum(domain, x, f, ewald=ewald, filaments=names), expected) < tolerance
    with_all = _sum(domain, x, f, ewald=ewald)
    assert relative(with_all, expected) > 0.1


def test_own_pairs_of_other_targets_are_left_out():
    x, names, f = _filaments(BOX)
    targets, target_names = x[[0, 5, 9]] + 0.013, np.array([4, -1, 9])
    expected = lattice_sum(
        targets,
        x,
        f,
        _vectors(BOX),
        own=lambda i, j: target_names[i] == names[j] and names[j] >= 0,
    )
    found = _sum(BOX, x, f, targets=targets, filaments=names, target_filaments=target_names)
    assert relative(found, expected) < 1e-10


def test_own_pairs_are_left_out_in_free_space_however_close():
    x, names, f = _filaments(BOX)
    x = np.concatenate([x, x[:4] + 1e-9, x[:1] + 2e-4])
    names, f = np.concatenate([names, names[:4], [30]]), np.concatenate([f, f[:4], f[:1]])
    expected = free_sum(x, x, f, left_out=_own(names))
    for tolerance in (1e-6, 1e-10):
        ewald = EwaldSum(tolerance, rc=0.3)
        assert relative(_sum(Free(), x, f, ewald=ewald, filaments=names), expected) < tolerance


def test_doublets_in_free_space_equal_or_mixed():
    x, f = _cloud(50)
    for radius in (0.03, np.linspace(0.0, 0.06, 50)):
        expected = free_sum(x, x, f, radius=radius, left_out=lambda i, j: i == j)
        for ewald, most in ((EwaldSum(1e-5, rc=0.4), 1e-5), (EwaldSum(1e-9, rc=0.4), 1e-9)):
            assert relative(_sum(Free(), x, f, ewald=ewald, radius=radius), expected) < most


@pytest.mark.parametrize("radius", [0.05, np.linspace(0.0, 0.08, 12)], ids=["equal", "mixed"])
def test_own_pairs_with_doublets_are_left_out_within_the_cutoff_and_beyond(radius):
    x, names, f = _filaments(BOX)
    assert np.linalg.norm(x[0] - x[3]) < 0.35 < np.linalg.norm(x[8] - x[9])
    expected = free_sum(x, x, f, radius=radius, left_out=_own(names))
    for tolerance in (1e-5, 1e-9):
        ewald = EwaldSum(tolerance, rc=0.35)
        found = _sum(Free(), x, f, ewald=ewald, filaments=names, radius=radius)
        assert relative(found, expected) < tolerance


def test_periodic_doublets_are_laplacians_of_the_slow_sum():
    domain = Sheared((1.0, 1.2, 0.9), 0.3)
    x, f = _cloud(3)
    vectors, xi = _vectors(domain), np.sqrt(np.pi)
    targets = np.array([[0.9, 0.1, 0.45], [0.15, 1.1, 0.2]])
    assert min(np.linalg.norm(t - y) for t in targets for y in x) > 0.3

    def velocity(at):
        return sum(lattice_tensor(at - y, vectors, xi) @ g for y, g in zip(x, f, strict=True))

    radius = 0.08
    plain = np.array([velocity(t) for t in targets])
    doublets = radius**2 / 4.0 * np.array([laplacian(velocity, t, 0.02) for t in targets])
    found = _sum(domain, x, f, targets=targets, radius=radius)
    assert relative(found - plain, doublets) < 3e-5
    mixed = _sum(domain, x, f, targets=targets, radius=radius * np.array([1.0, 1.0, 1.0 + 1e-12]))
    assert relative(mixed, found) < 1e-10


def test_self_term_of_a_periodic_doublet():
    # the images' doublets at the point itself, by the Laplacian of what is left of the slow sum
    radius, point = 0.1, np.array([[0.2, 0.3, 0.4]])
    cube = Periodic((1.0, 1.0, 1.0))

    def others(at):
        return lattice_tensor(at, np.eye(3), np.sqrt(np.pi)) - stokeslet(at)

    ring = 0.05 * np.concatenate([np.eye(3), -np.eye(3)])
    # S less its own image is smooth: its Laplacian at 0 is the mean of that around it
    expected = np.mean([laplacian(others, at, 0.03) for at in ring], axis=0)[0, 0]
    force = np.array([[1.0, 0.0, 0.0]])
    with_doublet = _sum(cube, point, force, radius=radius)[0, 0]
    without = _sum(cube, point, force)[0, 0]
    assert (with_doublet - without) * 4.0 / radius**2 == pytest.approx(expected, rel=2e-3)
    assert expected == pytest.approx(16.0 * np.pi / 3.0, rel=2e-3)


@pytest.mark.parametrize("strain", [0.3, -0.5, 0.5])
def test_strain_and_strain_less_one_are_the_same_cell(strain):
    x, f = _cloud(200)
    cells = [Sheared((1.0, 1.0, 1.0), s) for s in (strain, strain - 1.0, strain + 7.0)]
    ewald = EwaldSum(1e-10, rc=0.3)
    first, *others = (_sum(c, x, f, ewald=ewald) for c in cells)
    for other in others:
        assert relative(other, first) < 2e-10


def test_whole_strain_is_no_strain():
    x, f = _cloud(200)
    ewald = EwaldSum(1e-10, rc=0.25)
    expected = _sum(Periodic((1.0, 1.0, 1.0)), x, f, ewald=ewald)
    assert relative(_sum(Sheared((1.0, 1.0, 1.0), 3.0), x, f, ewald=ewald), expected) < 1e-12
    assert relative(_sum(Sheared((1.0, 1.0, 1.0), 2.8), x, f, ewald=ewald), expected) > 1e-3


@pytest.mark.parametrize("periods", [(1.0, 0.0, 0.0), (0.0, 1.1, 0.9)])
def test_free_directions_do_not_depend_on_the_split(periods):
    x, f = _cloud(150)
    f -= f.mean(axis=0)
    domain = Periodic(periods)
    far = _sum(domain, x, f, ewald=EwaldSum(1e-10, rc=0.2))
    near = _sum(domain, x, f, ewald=EwaldSum(1e-10, rc=0.44))
    assert relative(far, near) < 2e-10
    assert relative(_sum(Free(), x, f), near) > 1e-3
