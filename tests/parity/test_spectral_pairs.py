"""Sums between fibers in Legendre modes: against slow twins, near and far, images to rounding."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.special import eval_legendre, zeta

from reference.pair_twins import doublet, plain, stokeslet
from stokesfibers.core.errors import InputError
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.experiments.contact_scenes import exact_velocity
from stokesfibers.kernels.spectral_images import image_block
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import SpheroidalRegularization
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_interaction import plain_reach
from stokesfibers.slender.spectral_suspension import SpectralInteraction, SpectralScene
from stokesfibers.summation.close_approach import PaperCloseApproach, SmoothCloseApproach
from stokesfibers.summation.images import ImageSum
from stokesfibers.summation.periodic_kernel import ExactImages, places_needed, replaced_images
from support import assert_close, free_end_curve

CURVE = free_end_curve(bend=90.0)
NODES = 28
NO_BLEND = PaperCloseApproach(d0=1e-9)


def _force(s):
    return np.stack([np.cos(3.0 * s), np.sin(2.0 * s) + s**2 - 0.8, np.exp(-s)])


def _fiber(eps=1e-2, length=1.0, nodes=NODES):
    return SpectralFiber.build(
        length, eps, rigidity=1.0, nodes=nodes, mobility=NonLocal(SpheroidalRegularization())
    )


def _scene(fibers, domain=None, *, curves=None, close=NO_BLEND, images=None, tolerance=1e-8):
    curves = curves or [CURVE] * len(fibers)
    interaction = SpectralInteraction.build(
        fibers,
        domain or Free(),
        image_sum=images or ImageSum(),
        close_approach=close,
        tolerance=tolerance,
    )
    modes = np.stack(
        [f.fit(lambda q, f=f, c=c: f.length * c(q).T) for f, c in zip(fibers, curves, strict=True)]
    )
    return SpectralScene(interaction, modes, Workers(1)), modes


def _forces(fibers):
    return np.stack([_force(f.sigma) for f in fibers])


def _beside(s, distance, angle=0.7):
    """A point at a distance from the centreline at arclength s."""
    tangent = CURVE(s, 1)
    one = np.cross(tangent, [0.3, -0.2, 1.0])
    one /= np.linalg.norm(one)
    other = np.cross(tangent, one)
    return CURVE(s) + distance * (np.cos(angle) * one + np.sin(angle) * other)


@pytest.mark.parametrize("eps", [1e-2, 1e-3])
@pytest.mark.parametrize("tolerance", [1e-5, 1e-9])
def test_velocity_at_any_distance_is_that_of_the_slow_twin(eps, tolerance):
    fiber = _fiber(eps)
    scene, modes = _scene((fiber,), tolerance=tolerance)
    for distance in (1.0, 0.3, 0.2, 0.1, 0.03, 2.0 * eps):
        points = np.array([_beside(s, distance) for s in (0.03, 0.46, 0.8)])
        found = scene.fluid(points, _forces([fiber]), np.zeros((1, 3, NODES)))
        panels = max(200, int(4.0 / distance))
        exact = [
            plain(p, lambda s: fiber.position(modes[0], s), _force, 0.5 * eps**2, panels)
            for p in points
        ]
        assert_close(found, exact, rtol=3.0 * tolerance)


@pytest.mark.parametrize("nodes", [24, 48])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-7])
def test_every_mode_of_the_force_meets_the_tolerance_next_to_a_fiber(nodes, tolerance):
    fiber = _fiber(1e-3, nodes=nodes)
    scene, modes = _scene((fiber,), tolerance=tolerance)
    points = np.array([_beside(s, d) for s in (0.12, 0.41, 0.9) for d in (2.1e-3, 0.011, 0.05)])
    nothing = np.zeros((1, 3, nodes))
    first = 0.0
    for mode in (0, nodes // 2, nodes - 1):

        def force(s, mode=mode):
            return np.array([[1.0], [0.4], [-0.7]]) * eval_legendre(mode, 2.0 * s - 1.0)

        found = scene.fluid(points, force(fiber.sigma)[None], nothing)
        exact = exact_velocity(lambda s: fiber.position(modes[0], s), (force,), points, 0.5e-6)[0]
        first = first or float(np.abs(exact).max())
        assert np.abs(found - exact).max() < tolerance * first


@pytest.mark.parametrize("distance", [0.4, 0.2])
def test_outside_the_bend_of_a_hairpin_rows_begin_farther_out(distance):
    fiber = _fiber(1e-2, nodes=32)
    hairpin = free_end_curve(bend=180.0, twist=0.0)
    s = np.array([0.35, 0.5, 0.65])
    tangent = hairpin(s, 1)
    outwards = np.cross(tangent.T, [0.0, 0.0, 1.0])
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    points = hairpin(s).T + distance * outwards
    forces, nothing = _force(fiber.sigma)[None], np.zeros((1, 3, 32))
    for tolerance in (1e-6, 1e-8):
        assert distance > plain_reach(32, tolerance), "a straight fiber needs no rows here"
        scene, modes = _scene((fiber,), curves=[hairpin], tolerance=tolerance)
        position = partial(fiber.position, modes[0])
        exact = exact_velocity(position, (_force,), points, 0.5e-4)[0]
        near = exact_velocity(position, (_force,), hairpin(s).T + 0.02 * outwards, 0.5e-4)[0]
        found = scene.fluid(points, forces, nothing)
        assert np.abs(found - exact).max() < tolerance * np.abs(near).max()


def test_points_off_the_ends_and_between_two_arms_of_a_hairpin():
    fiber = _fiber(1e-2)
    hairpin = free_end_curve(bend=180.0, twist=0.0)
    scene, modes = _scene((fiber,), curves=[hairpin])
    ends = hairpin(np.array([0.0, 1.0])).T
    outwards = [ends[0] - 0.03 * hairpin(0.0, 1), ends[1] + 0.03 * hairpin(1.0, 1)]
    s = np.linspace(0.0, 1.0, 400)
    x = hairpin(s).T
    apart = np.linalg.norm(x[:, None] - x, axis=2) + 10.0 * (np.abs(s[:, None] - s) < 0.5)
    i, j = np.unravel_index(np.argmin(apart), apart.shape)
    assert 0.02 < apart[i, j] < 0.25, "the arms come near each other"
    points = np.array([*outwards, 0.5 * (x[i] + x[j]), 0.8 * x[i] + 0.2 * x[j]])
    found = scene.fluid(points, _forces([fiber]), np.zeros((1, 3, NODES)))
    exact = [plain(p, lambda s: fiber.position(modes[0], s), _force, 0.5e-4, 800) for p in points]
    assert_close(found, exact, rtol=1e-7)


def test_lengths_and_radii_of_the_source_count():
    fiber = _fiber(2e-2, length=3.0)
    scene, modes = _scene((fiber,))
    points = 3.0 * np.array([_beside(s, d) for s, d in ((0.3, 0.05), (0.6, 0.8))])
    found = scene.fluid(points, _forces([fiber]), np.zeros((1, 3, NODES)))
    exact = [
        3.0 * plain(p, lambda q: fiber.position(modes[0], 3.0 * q), _force, 0.5 * 0.06**2, 400)
        for p in points
    ]
    assert_close(found, exact, rtol=1e-7)


@pytest.mark.parametrize("approach", [PaperCloseApproach, SmoothCloseApproach])
def test_near_contact_the_velocity_is_that_of_the_centreline_next_to_it(approach):
    fiber = _fiber()
    own = np.stack([1.0 + fiber.sigma, 2.0 - fiber.sigma**2, 0.5 * fiber.sigma])[None]
    scene, _ = _scene((fiber,), close=approach(d0=0.04))
    bare, _ = _scene((fiber,))
    for distance, xi in ((0.039, 0.0), (0.05, 0.25), (0.07, 0.75), (0.081, 1.0)):
        point = _beside(0.37, distance)[None]
        outer = bare.fluid(point, _forces([fiber]), own)[0]
        share = xi**3 * (10.0 - 15.0 * xi + 6.0 * xi**2) if approach.smooth else xi
        value = np.array([1.37, 2.0 - 0.37**2, 0.185])
        found = scene.fluid(point, _forces([fiber]), own)[0]
        assert_close(found, share * outer + (1.0 - share) * value, rtol=1e-8)


def test_default_blend_begins_at_four_radii():
    fiber = _fiber(1e-2)
    own = np.ones((1, 3, NODES))
    default, _ = _scene((fiber,), close=PaperCloseApproach())
    inside, outside = (
        default.fluid(_beside(0.4, d)[None], _forces([fiber]), own)[0] for d in (0.0199, 0.0401)
    )
    assert_close(inside, np.ones(3), rtol=1e-12)
    bare, _ = _scene((fiber,))
    expected = bare.fluid(_beside(0.4, 0.0401)[None], _forces([fiber]), own)[0]
    assert_close(outside, expected, rtol=1e-12)


def test_the_fiber_itself_is_left_out_but_its_images_are_not():
    fiber = _fiber()
    force, nothing = _forces([fiber]), np.zeros((1, 3, NODES))
    alone, modes = _scene((fiber,))
    assert not alone.velocity(force, nothing).any()
    scene, _ = _scene((fiber,), Periodic((1.2, 0, 0)), images=ImageSum(reach=1))
    nodes = fiber.position(modes[0], fiber.sigma).T
    exact = sum(
        np.array(
            [
                plain(p + shift, lambda s: fiber.position(modes[0], s), _force, 0.5e-4, 200)
                for p in nodes[::9]
            ]
        )
        for shift in np.array([[1.2, 0, 0], [-1.2, 0, 0]])
    )
    assert_close(scene.velocity(force, nothing)[0, :, ::9].T, exact, rtol=1e-7)


def test_the_places_of_the_images_that_stand_for_all_others():
    for count in (4, 7, 10):
        p, w = replaced_images(count)
        assert np.all(p > 1.9)
        assert np.all(w > 0.0)
        for power in range(3, min(4 * count, 24), 2):
            exact = zeta(power, 2.0)
            # the first moments of the measure are met to rounding
            assert_close(np.sum(w * p**-power), exact, rtol=1e-10)
    p, w = replaced_images(10)
    assert_close(p[:3], [2.0, 3.0, 4.0], rtol=1e-9)
    assert_close(w[:3], np.ones(3), rtol=1e-6)
    assert places_needed(1e-4) < places_needed(1e-12)


def _brute_tail(r, d, axis, weight):
    """Sum over |p| >= 2 of V + weight W, each less (I + aa) / |p d|, extrapolated from 1e4."""
    unit = np.eye(3)[axis]
    constant = np.eye(3) + np.outer(unit, unit)
    p = np.arange(2, 10001)
    total = np.zeros((len(p), 3, 3))
    for sign in (1.0, -1.0):
        at = r + sign * d * p[:, None] * unit
        size = np.linalg.norm(at, axis=1)[:, None, None]
        dyad = at[:, :, None] * at[:, None, :]
        total += np.eye(3) / size + dyad / size**3
        total += weight * (np.eye(3) / size**3 - 3.0 * dyad / size**5)
        total -= constant / (d * p[:, None, None])
    # the rest of the sum behaves as (P + 1/2)^-2, (P + 1/2)^-4, ...
    counts = np.array([2500, 5000, 10000])
    sums = np.stack([np.sort(total[: n - 1], axis=0).sum(axis=0) for n in counts])
    powers = (counts[:, None] + 0.5) ** -np.array([0.0, 2.0, 4.0])
    return np.tensordot(np.linalg.inv(powers)[0], sums, axes=1) - 2.0 * constant / d


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("across", [0.0, 0.4, 1.3, 4.9, 5.2, 11.0])
def test_the_exact_sum_is_that_of_ten_thousand_images_with_their_tail(axis, across):
    d, weight = 1.7, 3e-2
    domain = Periodic(tuple(d if k == axis else 0.0 for k in range(3)))
    images = ExactImages().replaced(domain, 1e-12)
    for along in (0.0, -0.6, 1.5):
        r = np.zeros(3)
        r[axis], r[axis - 1], r[axis - 2] = along * d, 0.6 * across * d, -0.8 * across * d
        found = image_block(
            r[:, None], np.zeros((1, 3)), np.zeros((1, 3, 1)), np.array([weight]), images.arguments
        )[0, 0, :, 0]
        exact = _brute_tail(r, d, axis, weight)
        expected = exact[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        assert_close(found, expected, atol=2e-11)


def _net_free(fibers):
    """Nodal forces without a net force, as those of free fibers."""
    force = _forces(fibers)
    weights = np.stack([f.quadrature / f.length for f in fibers])
    return force - np.einsum("kan,kn->ka", force, weights)[:, :, None]


@pytest.mark.parametrize("spread", [0.5, 3.0])
def test_exact_images_of_fibers_are_all_images(spread):
    fibers = (_fiber(), _fiber(3e-2, length=0.7))
    away = np.array([0.7, spread, -0.4 * spread])
    curves = [CURVE, lambda q: CURVE(q) + away[:, None] / 0.7]
    domain = Periodic((2.0, 0.0, 0.0))
    force, nothing = _net_free(fibers), np.zeros((2, 3, NODES))
    exact, near = (
        _scene(fibers, domain, curves=curves, images=images, tolerance=1e-10)[0].velocity(
            force, nothing
        )
        for images in (ExactImages(), ImageSum(reach=1))
    )
    x = np.stack([f.length * c(f.sigma) for f, c in zip(fibers, curves, strict=True)])
    middles = np.stack([xk @ f.quadrature / f.length for xk, f in zip(x, fibers, strict=True)])
    p = np.arange(2, 161)
    terms = np.zeros((len(p), 2, 3))
    for target, source in ((0, 0), (0, 1), (1, 0), (1, 1)):
        fiber = fibers[source]
        apart = middles[target] - middles[source]
        r = x[target][:, 9] + domain.nearest_image(apart) - apart - x[source].T
        f = (force[source] * fiber.quadrature).T
        for sign in (1.0, -1.0):
            at = r + sign * 2.0 * p[:, None, None] * np.array([1.0, 0.0, 0.0])
            size = np.linalg.norm(at, axis=2)[..., None]
            along = at * np.sum(at * f, axis=2, keepdims=True)
            v = f / size + along / size**3
            v += 0.5 * (fiber.eps * fiber.length) ** 2 * (f / size**3 - 3.0 * along / size**5)
            terms[:, target] += v.sum(axis=1)
    counts = np.array([40, 80, 160])
    sums = np.stack([terms[: n - 1].sum(axis=0) for n in counts])
    powers = (counts[:, None] + 0.5) ** -np.array([0.0, 2.0, 4.0])
    expected = np.tensordot(np.linalg.inv(powers)[0], sums, axes=1)
    assert_close((exact - near)[:, :, 9], expected, rtol=1e-6)


def test_moments_of_far_images_see_net_forces_and_the_chosen_centre():
    fiber = _fiber()
    domain = Periodic((2.0, 0.0, 0.0))
    force = _net_free((fiber,))
    point = np.array([[0.2, 0.9, -0.5]])

    def velocity(images, f):
        scene, _ = _scene((fiber,), domain, images=images)
        return scene.fluid(point, f, np.zeros((1, 3, NODES)))[0]

    def far(images, f):
        return velocity(images, f) - velocity(ImageSum(reach=1), f)

    x = CURVE(fiber.sigma)
    for about, centre in (
        ("midpoint", CURVE(0.5)),
        ("centre_of_mass", x @ fiber.quadrature),
    ):
        arms = x - centre[:, None]
        s = -np.einsum("an,bn,n->ab", arms, force[0], fiber.quadrature)
        expected = np.zeros(3)
        for p in (2, -2, 3, -3):
            r = point[0] + [2.0 * p, 0.0, 0.0] - centre
            size = np.linalg.norm(r)
            expected += (np.trace(s) - 3.0 * r @ s @ r / size**2) * r / size**3
        assert_close(far(ImageSum(reach=3, about=about), force), expected, rtol=1e-7)
    net = np.ones((1, 3, NODES))
    expected = np.zeros(3)
    for p in (2, -2, 3, -3):
        r = point[0] + [2.0 * p, 0.0, 0.0] - x @ fiber.quadrature
        expected += stokeslet(r, np.ones(3)) + 0.0 * doublet(r, np.ones(3))
    found = far(ImageSum(reach=3, about="centre_of_mass"), net)
    assert_close(found, expected, rtol=1e-6)


def test_what_cannot_be_summed_is_refused():
    with pytest.raises(InputError, match=r"domain.sum: expected one periodic direction"):
        _scene((_fiber(),), Periodic((2.0, 2.0, 0.0)), images=ExactImages())
    with pytest.raises(InputError, match="with the paper's engine"):
        ExactImages().shifts(Periodic((2.0, 0.0, 0.0)))
    with pytest.raises(InputError, match="as many nodes"):
        _scene((_fiber(), _fiber(nodes=20)))
    with pytest.raises(InputError, match="tolerance: expected a number from"):
        _scene((_fiber(),), tolerance=0.5)
