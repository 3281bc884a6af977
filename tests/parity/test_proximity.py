"""The search for near segments, and for those that pass each other, against all pairs."""

from __future__ import annotations

import numpy as np
import pytest

from reference import proximity_twins as twins
from stokesfibers.domain import Free, Periodic, Sheared
from stokesfibers.domain.crossings import _coplanar, _ends, _meet, find_crossings
from stokesfibers.domain.neighbours import closest
from support import assert_close

DOMAINS = [
    Free(),
    Periodic((2.0, 0.0, 0.0)),
    Periodic((1.4, 1.5, 2.2)),
    Sheared((1.4, 1.5, 2.2), 0.37),
    Sheared((4.8, 1.5, 2.2), -1.4),
]
NAMES = ["free", "one period", "three", "sheared", "sheared, long"]


def _bent(count, seed, spread=0.8, nodes=33):
    """Bent fibers on points that gather at the ends, and their radii."""
    random = np.random.default_rng(seed)
    s = 0.5 * (1.0 - np.cos(np.pi * np.arange(nodes) / (nodes - 1)))
    unit = random.normal(size=(count, 1, 3))
    unit /= np.linalg.norm(unit, axis=-1, keepdims=True)
    bend = 0.3 * np.cross(unit, random.normal(size=(count, 1, 3)))
    middle = random.uniform(-spread, spread, size=(count, 1, 3))
    x = middle + (s[:, None] - 0.5) * unit + np.sin(5.0 * s[:, None]) ** 2 * bend
    thick = random.uniform(1e-3, 2e-2, size=(count, 1))
    return x, 2.0 * thick * np.sqrt(s * (1.0 - s))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("domain", DOMAINS, ids=NAMES)
def test_closest_approach_equals_that_of_all_pairs(domain, seed):
    x, radii = _bent(5, seed, spread=2.5 if seed % 2 else 0.8)
    found = closest(x, radii, domain)
    distance, gap = twins.closest(x, radii, domain)
    assert 0.0 < distance < 3.0
    assert gap < distance
    assert_close(found.distance, distance, rtol=1e-12)
    assert_close(found.gap, gap, rtol=1e-11)


def test_near_points_of_the_own_fiber_do_not_hide_another():
    """A nearest-points list of a few entries is filled by the own points, which lie dense."""
    x, radii = _bent(1, 0, nodes=201)
    pair = np.concatenate([x, x + np.array([0.0, 0.0, 0.7])])
    found = closest(pair, np.repeat(radii, 2, axis=0), Free())
    assert found.fibers == (0, 1)
    assert_close(found.distance, twins.closest(pair, np.repeat(radii, 2, axis=0), Free())[0])


def test_a_fiber_alone_has_no_neighbour():
    x, radii = _bent(1, 3)
    found = closest(x, radii, Free())
    assert (found.distance, found.gap, found.fibers) == (np.inf, np.inf, (-1, -1))


@pytest.mark.parametrize("far", [0.15, 0.3])
@pytest.mark.parametrize("domain", DOMAINS, ids=NAMES)
def test_crossings_equal_those_of_all_pairs_of_segments(domain, far):
    random = np.random.default_rng(7)
    count = 0
    for seed in range(12):
        before, _ = _bent(6, seed, spread=0.5, nodes=17)
        after = before + far * random.normal(size=(6, 1, 3))
        found = {(c.first, c.second): c.fraction for c in find_crossings(before, after, domain)}
        expected = _all_crossings(before, after, domain)
        assert {tuple(sorted(key)) for key in found} == expected.keys()
        for key, fraction in found.items():
            assert_close(fraction, expected[tuple(sorted(key))], rtol=1e-9)
        count += len(expected)
    assert count >= 2


def _all_crossings(before, after, domain):
    """Return the earliest crossing of each pair of fibers, over all pairs of segments."""
    fibers, segments = before.shape[0], before.shape[1] - 1
    k, i, m, j = np.indices((fibers, segments, fibers, segments)).reshape(4, -1)
    keep = k <= m
    k, i, m, j = k[keep], i[keep], m[keep], j[keep]
    middle = 0.5 * (before[:, 1:] + before[:, :-1])
    plain = middle[k, i] - middle[m, j]
    shift = domain.nearest_image(plain) - plain
    keep = (k != m) | np.any(np.abs(shift) > 1e-9, axis=1)
    k, i, m, j, shift = k[keep], i[keep], m[keep], j[keep], shift[keep]
    start, stop = (_ends(x, (k, i), (m, j), shift) for x in (before, after))
    when = _coplanar(start, stop)
    found = {}
    turned = (when < 1.0) & _meet(start + when[:, None] * (stop - start))
    for n in np.flatnonzero(turned):
        key = int(k[n]), int(m[n])
        found[key] = min(found.get(key, 1.0), float(when[n]))
    return found


def _all_images(x, domain, reach=4):
    """Return the smallest distance of different fibers over a block of lattice vectors."""
    steps = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 3), axis=-1).reshape(-1, 3)
    points = x.reshape(-1, 3)
    own = np.repeat(np.arange(len(x)), x.shape[1])
    different = own[:, None] != own[None]
    return min(
        float(np.linalg.norm(points[:, None] - points[None] - v, axis=-1)[different].min())
        for v in domain.lattice_vectors(steps)
    )


@pytest.mark.parametrize("domain", DOMAINS[3:], ids=NAMES[3:])
def test_the_nearest_image_is_the_nearest_of_all(domain):
    x = np.random.default_rng(2).uniform(0.0, 1.0, (5, 1, 3)) * domain.lengths
    plain = x[:, 0, None] - x[None, :, 0]
    near = np.linalg.norm(domain.nearest_image(plain), axis=-1)
    assert_close(near[np.triu_indices(5, 1)].min(), _all_images(x, domain), rtol=1e-12)


@pytest.mark.parametrize("domain", DOMAINS[3:], ids=NAMES[3:])
def test_lattice_vectors_change_neither_neighbours_nor_crossings(domain):
    assert sum(_moved_by_lattice_vectors(domain, seed) for seed in range(6)) >= 3


def _moved_by_lattice_vectors(domain, seed):
    random = np.random.default_rng(seed)
    x, radii = _bent(6, seed, spread=0.6, nodes=17)
    y = x + 0.25 * random.normal(size=(6, 1, 3))
    later = domain.at(domain.strain + 0.11)
    numbers = random.integers(-4, 5, (6, 3)).astype(float)
    first = domain.lattice_vectors(numbers)
    last = first + numbers[:, 1:2] * [domain.slide_to(later), 0.0, 0.0]
    moved, ahead = x + first[:, None], y + last[:, None]
    one, other = closest(x, radii, domain), closest(moved, radii, domain)
    assert sorted(other.fibers) == sorted(one.fibers)
    assert_close([other.distance, other.gap], [one.distance, one.gap], rtol=1e-11)
    known = {(c.first, c.second): c.fraction for c in find_crossings(x, y, domain, later)}
    found = {(c.first, c.second): c.fraction for c in find_crossings(moved, ahead, domain, later)}
    assert {tuple(sorted(k)) for k in found} == {tuple(sorted(k)) for k in known}
    for one, other in zip(sorted(found.values()), sorted(known.values()), strict=True):
        assert_close(one, other, rtol=1e-9)
    return len(found)


def test_an_image_that_slides_past_a_resting_fiber_crosses_it():
    """Both fibers rest; the second's image above the cell is dragged over the first's."""
    domain = Sheared((2.0, 2.0, 2.0), 0.0)
    s = np.linspace(-0.5, 0.5, 9)[:, None]
    upright = np.array([0.5, 0.02, 1.0]) + s * [0.0, 0.3, 1.0]
    lying = np.array([0.45, 1.99, 1.0]) + s * [0.0, 1.0, 0.0]
    lying[:, 1] = 1.99 + 0.4 * s[:, 0]
    still = np.stack([upright, lying])
    carried = still.copy()
    (found,) = find_crossings(still, carried, domain, domain.at(-0.05))
    assert {found.first, found.second} == {0, 1}
    # the image below moves along x from 0.45 by 0.05 times the period: half way it is at 0.5
    assert_close(found.fraction, 0.5, rtol=1e-9)
    assert find_crossings(still, carried, domain, domain.at(0.05)) == ()
    assert find_crossings(still, carried, domain) == ()
