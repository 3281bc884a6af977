"""The fast sum between fibers with its near corrections, against the direct sums."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.sheared import Sheared
from stokesfibers.experiments.contact_rules import SpectralSource
from stokesfibers.experiments.contact_scenes import arrangements, exact_velocity, smooth_force
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import SpheroidalRegularization
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_ewald import EwaldInteraction
from stokesfibers.slender.spectral_suspension import SpectralInteraction
from stokesfibers.summation import ExactImages, ImageSum
from stokesfibers.summation.close_approach import PaperCloseApproach, SmoothCloseApproach
from stokesfibers.summation.ewald.cloud import Lattice
from stokesfibers.summation.near_images import Balls, near_images
from support import assert_close

pytest.importorskip("ducc0")

COUNT = 8
KINDS = ((1.0, 1e-2), (0.6, 2e-2))  # length, eps
FREE = SmoothCloseApproach()


def fibers() -> tuple[SpectralFiber, ...]:
    kinds = [
        SpectralFiber.build(
            length,
            eps,
            rigidity=1.0,
            nodes=24,
            mobility=NonLocal(SpheroidalRegularization()),
        )
        for length, eps in KINDS
    ]
    return tuple(kinds[k % 2] for k in range(COUNT))


def placed(kinds: tuple[SpectralFiber, ...], span: float = 1.6) -> np.ndarray:
    """Bent fibers all over the cell and across its border; 0 and 1 nearly touch, 2 and 3 blend."""
    rng = np.random.default_rng(5)
    along = rng.normal(size=(COUNT, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    centre = span * rng.random((COUNT, 3))
    for first, gap in ((0, 0.06), (2, 0.03)):
        side = np.cross(along[first], [0.3, 0.4, -1.0])
        along[first + 1] = along[first]
        centre[first + 1] = centre[first] + gap * side / np.linalg.norm(side)
    bend = 0.2 * rng.normal(size=(COUNT, 3))

    def curve(k: int):
        length = kinds[k].length
        return lambda s: (
            centre[k] + length * ((s[:, None] - 0.5) * along[k] + bend[k] * (s[:, None] - 0.5) ** 2)
        )

    return np.stack([f.fit(curve(k)) for k, f in enumerate(kinds)])


def forces(kinds: tuple[SpectralFiber, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Forces without a net one, and what stands for Lambda f + K f."""
    rng = np.random.default_rng(6)
    s = kinds[0].sigma
    found = rng.normal(size=(COUNT, 3, 3)) @ np.stack([np.sin(3.0 * s), np.cos(5.0 * s), s**2])
    mean = np.stack([f @ k.quadrature / k.length for f, k in zip(found, kinds, strict=True)])
    return found - mean[:, :, None], rng.normal(size=found.shape)


def fast(domain, tolerance, threads=1):
    kinds = fibers()
    interaction = EwaldInteraction.build(
        kinds, lambda _: domain, close_approach=FREE, tolerance=tolerance
    )
    return interaction.scene(placed(kinds), 0.0, Workers(threads))


def direct(domain):
    kinds = fibers()
    interaction = SpectralInteraction.build(
        kinds,
        domain,
        image_sum=ExactImages() if domain.lengths.any() else ImageSum(),
        close_approach=FREE,
        tolerance=1e-10,
    )
    return interaction.scene(placed(kinds), 0.0, Workers(1))


def rms(error: np.ndarray, value: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2) / np.mean(value**2)))


@pytest.mark.parametrize("domain", [Free(), Periodic((2.0, 0.0, 0.0))], ids=lambda d: d.kind)
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_fast_sum_is_the_direct_one_to_its_tolerance(domain, tolerance):
    force, resisted = forces(fibers())
    exact = direct(domain)
    scene = fast(domain, tolerance)
    expected = exact.velocity(force, resisted)
    error = rms(scene.velocity(force, resisted) - expected, expected)
    assert 1e-3 * tolerance < error < tolerance
    points = np.concatenate([np.random.default_rng(7).random((30, 3)) * 2.0, [[0.0, 0.0, 90.0]]])
    # relative to velocities near the fibers: far from them all is small
    error = scene.fluid(points, force, resisted) - exact.fluid(points, force, resisted)
    assert rms(error, expected) < tolerance


@pytest.mark.parametrize("place", arrangements(), ids=lambda a: a.name)
@pytest.mark.parametrize("tolerance", [1e-4, 1e-7])
def test_a_tenth_of_a_radius_from_contact_the_corrected_sum_is_the_integral(place, tolerance):
    eps = 1e-3
    source = SpectralSource.of(place.source, eps=eps, nodes=32)
    fiber = source.fiber
    other = fiber.fit(lambda s: place.target(s, 2.1 * eps).T)
    interaction = EwaldInteraction.build(
        (fiber, fiber),
        lambda _: Free(),
        close_approach=PaperCloseApproach(d0=1e-9),
        tolerance=tolerance,
    )
    scene = interaction.scene(np.stack([source.modes, other]), 0.0, Workers(1))
    force = np.stack([smooth_force(fiber.sigma), np.zeros((3, 32))])
    found = scene.velocity(force, np.zeros_like(force))[1].T
    nodes = np.ascontiguousarray(fiber.position(other, fiber.sigma).T)
    expected = exact_velocity(source.position, (smooth_force,), nodes, 0.5 * eps**2)[0]
    assert_close(found, expected, rtol=tolerance)


def test_near_fibers_are_what_the_corrections_are_for():
    force, resisted = forces(fibers())
    scene = fast(Free(), 1e-6)
    whole = scene.velocity(force, resisted)
    assert sum(len(found[0]) for found in scene._corrections) > 50
    scene._corrections = []
    assert rms(scene.velocity(force, resisted) - whole, whole) > 0.05


def test_a_single_point_is_not_moved_by_wrapping():
    point = np.array([[3.1, -2.2, 7.5]])
    lattice = Lattice.of(Sheared((2.0, 2.0, 1.7), 0.3))
    inside, taken = lattice.wrapped(point)
    np.testing.assert_array_equal(point, [[3.1, -2.2, 7.5]])
    np.testing.assert_allclose(inside.T + lattice.shift(taken.T), point, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("strain", [0.3, 0.5, 1.4])
def test_sheared_cell_repeats_after_a_strain_of_one_and_is_periodic_at_none(strain):
    force, resisted = forces(fibers())
    periods = (2.0, 2.0, 1.7)
    one = fast(Sheared(periods, strain), 1e-7).velocity(force, resisted)
    other = fast(Sheared(periods, strain - 1.0), 1e-7).velocity(force, resisted)
    assert rms(one - other, one) < 1e-10
    still = fast(Periodic(periods), 1e-7).velocity(force, resisted)
    assert rms(one - still, one) > 1e-2
    same = fast(Sheared(periods, 0.0), 1e-7).velocity(force, resisted)
    assert rms(same - still, still) < 1e-10


def test_moving_a_fiber_by_a_lattice_vector_changes_nothing():
    kinds = fibers()
    force, resisted = forces(kinds)
    domain = Sheared((2.0, 2.0, 1.7), 0.3)
    interaction = EwaldInteraction.build(
        kinds, lambda _: domain, close_approach=FREE, tolerance=1e-7
    )
    modes = placed(kinds)
    moved = modes.copy()
    moved[1, :, 0] += np.array([2.0 + 0.6, 2.0, -1.7]) / kinds[1].length
    found = [
        interaction.scene(m, 0.0, Workers(1)).velocity(force, resisted) for m in (modes, moved)
    ]
    assert rms(found[1] - found[0], found[0]) < 1e-7


def test_threads_change_no_bit():
    force, resisted = forces(fibers())
    one = fast(Periodic((2.0, 1.9, 1.8)), 1e-5).velocity(force, resisted)
    two = fast(Periodic((2.0, 1.9, 1.8)), 1e-5, threads=2).velocity(force, resisted)
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize(
    "domain",
    [Free(), Periodic((1.5, 0.0, 1.2)), Periodic((0.5, 0.6, 0.7)), Sheared((1.5, 1.4, 1.3), 0.4)],
    ids=["free", "two", "small", "sheared"],
)
def test_near_images_are_all_that_a_loop_finds(domain):
    rng = np.random.default_rng(3)
    balls = Balls(0.5 * rng.normal(size=(12, 3)), 0.3 * rng.random(12))
    reach = 0.2 + 0.1 * rng.random(12)
    lattice = Lattice.of(domain)
    found = near_images(balls, balls, reach, lattice, first=0)
    steps = [np.arange(-12, 13) if p else np.array([0]) for p in lattice.periodic]
    shifts = lattice.shift(np.stack(np.meshgrid(*steps, indexing="ij"), -1).reshape(-1, 3))
    total = 0
    for target in range(12):
        rows = slice(found.start[target], found.start[target + 1])
        expected = []
        for source in range(12):
            apart = balls.centres[target] + shifts - balls.centres[source]
            away = balls.radii[target] + balls.radii[source] + reach[source]
            near = np.linalg.norm(apart, axis=1) < away
            if source == target:
                near &= np.any(shifts != 0.0, axis=1)
            expected += [(source, *s) for s in shifts[near]]
        listed = [(k, *s) for k, s in zip(found.source[rows], found.shift[rows], strict=True)]
        assert len(listed) == len(expected)
        total += len(listed)
        np.testing.assert_allclose(sorted(listed), sorted(expected), rtol=0.0, atol=1e-12)
    assert total > 10
