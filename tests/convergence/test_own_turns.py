"""A fiber that nears itself: where its nodes fail is found, and more nodes stand in for them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from reference.twins import finite_part_anywhere
from stokesfibers.experiments.close_pair_curves import Filament
from stokesfibers.experiments.contact_scenes import smooth_force
from stokesfibers.flow import NoFlow
from stokesfibers.numerics.legendre import gauss_legendre, legendre_values
from stokesfibers.numerics.step_control import AdaptiveSteps, FixedSteps
from stokesfibers.slender.mobility import LocalDrag, NonLocal
from stokesfibers.slender.regularization import (
    ConstantRegularization,
    NoRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_own import nodes_error
from stokesfibers.stepping.spectral import SpectralStepper
from stokesfibers.stepping.spectral_carry import Carry

RISE = Polynomial([0.0, 0.0, 0.0, 1.0 / 3.0, -1.0 / 2.0, 1.0 / 5.0])
TOLERANCE = 1e-6
MANY = 192


def coil(slope: float, turn: float = 180.0) -> Filament:
    """Return a filament coiled once, by `turn` / 30 radians, that rises by `slope`."""
    return Filament.build(lambda s: turn * RISE(s), lambda s: np.full_like(s, slope), 0.5, 0.0)


@cache
def coiled(slope, nodes, tolerance=TOLERANCE, *, eps=1e-3, turn=180.0, choice=None):
    """Return the fiber and the modes of a coil."""
    mobility = choice if isinstance(choice, LocalDrag) else NonLocal(choice)
    fiber = SpectralFiber.build(
        1.0, eps, rigidity=1.0, nodes=nodes, mobility=mobility, tolerance=tolerance
    )
    curve = coil(slope, turn)
    return fiber, fiber.fit(lambda s: curve.sample(s).x.T)


def finite_part(fiber, modes, s, choice=None):
    """Return K of the smooth force at s by adaptive quadrature, for the shape of the modes."""
    delta = (choice or SpheroidalRegularization()).delta(s, fiber.eps)
    found = [
        finite_part_anywhere(lambda q, order: fiber.position(modes, q, order), smooth_force, *at)
        for at in zip(s, delta, strict=True)
    ]
    return np.stack(found, axis=1)


def operator(fiber, modes):
    """Return K of the smooth force at the nodes, as the engine has it."""
    force, tangent = smooth_force(fiber.sigma), fiber.position(modes, fiber.sigma, 1)
    found, _ = fiber.mobility_velocity(modes, np.ascontiguousarray(force))
    along = tangent * np.sum(tangent * force, axis=0)
    return found - fiber.local.a * force - fiber.local.b * along


def relative(found, exact):
    return np.abs(found - exact).max() / np.abs(exact).max()


def projected(fiber, values):
    """Return values at `MANY` nodes, projected on what N modes hold, at the fiber's nodes."""
    s, weights = gauss_legendre(MANY)
    norms = 2.0 * np.arange(fiber.count) + 1.0
    series = (values * weights) @ legendre_values(s, fiber.count) * norms
    return series @ legendre_values(fiber.sigma, fiber.count).T


@pytest.mark.parametrize("nodes", [24, 32, 48])
@pytest.mark.parametrize("slope", [0.2, 0.1, 0.05, 0.025])
def test_the_error_by_the_nodes_alone_is_foretold(slope, nodes):
    """From above, and not by much, over six decades; K is a tenth of the whole velocity."""
    fiber, modes = coiled(slope, nodes)
    alone = operator(replace(fiber, tolerance=1.0), modes)
    whole, _ = fiber.mobility_velocity(modes, np.ascontiguousarray(smooth_force(fiber.sigma)))
    error = np.abs(alone - finite_part(fiber, modes, fiber.sigma)).max() / np.abs(whole).max()
    nearest = fiber.own_turns.nearest(modes)
    if error < 0.1 * TOLERANCE:
        assert nearest == np.inf
    else:
        assert error < nodes_error(nodes * np.log(nearest)) < 50.0 * error


@pytest.mark.parametrize(
    ("slope", "eps", "tolerance"), [(0.1, 1e-3, 1e-8), (0.04, 1e-3, 1e-5), (0.04, 1e-2, 1e-4)]
)
def test_on_more_nodes_the_operator_meets_its_tolerance(slope, eps, tolerance):
    """In all that N modes hold of the velocity; the last fiber is one radius from touching."""
    fiber, modes = coiled(slope, 32, tolerance, eps=eps)
    exact = projected(fiber, finite_part(fiber, modes, gauss_legendre(MANY)[0]))
    assert fiber.own_turns.operator(modes).error == 0.0
    assert relative(operator(fiber, modes), exact) < tolerance
    alone = operator(replace(fiber, tolerance=1.0), modes)
    assert relative(alone, exact) > 30.0 * tolerance, "the nodes alone fail"


@pytest.mark.parametrize("choice", [PaperRegularization(), ConstantRegularization()])
def test_every_regularisation_has_it(choice):
    fiber, modes = coiled(0.05, 32, 1e-4, choice=choice)
    exact = projected(fiber, finite_part(fiber, modes, gauss_legendre(MANY)[0], choice))
    assert fiber.own_turns.operator(modes).given.size
    # that of the paper has coefficients that N modes do not resolve, wherever the fiber is
    assert relative(operator(fiber, modes), exact) < 2e-4


def test_without_a_regularisation_the_nodes_converge_to_it():
    found = [
        fiber.between_nodes(operator(fiber, modes), np.linspace(0.1, 0.9, 9))
        for fiber, modes in (
            coiled(0.1, nodes, 1e-8, choice=NoRegularization()) for nodes in (40, 64)
        )
    ]
    assert relative(*found) < 2e-4


def test_local_drag_has_nothing_to_err():
    fiber, modes = coiled(0.02, 32, choice=LocalDrag())
    own = fiber.own_turns.operator(modes)
    assert (own.given.size, own.error) == (0, 0.0)


def test_what_most_nodes_do_not_resolve_is_told():
    fiber, modes = coiled(0.006, 32)
    own = fiber.own_turns.operator(modes)
    nearest = fiber.own_turns.nearest(modes)
    assert own.error == nodes_error(256 * np.log(nearest)) > 1e-3
    assert own.ratio == 0.0


def test_turns_within_their_own_thickness_are_lost():
    fiber, modes = coiled(0.005, 32, eps=1e-2)
    assert fiber.own_turns.operator(modes).ratio >= 1.0
    assert fiber.weights.remainder(fiber.mobility_velocity(modes, 0.0 * modes)[1]) == np.inf


@pytest.mark.parametrize("turn", [0.0, 60.0, 100.0])
def test_fibers_that_stay_away_from_themselves_keep_their_nodes(turn):
    fiber, modes = coiled(0.0, 32, turn=turn)
    assert fiber.own_turns.nearest(modes) == np.inf
    assert fiber.own_turns.operator(modes).given.size == 0


def test_a_reversed_and_turned_coil_is_judged_alike():
    fiber, modes = coiled(0.05, 32)
    curve, (turn, _) = coil(0.05), np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    other = fiber.fit(lambda s: (turn @ curve.sample(1.0 - s).x).T)
    one, two = fiber.own_turns.nearest(modes), fiber.own_turns.nearest(other)
    assert one - 1.0 == pytest.approx(two - 1.0, rel=1e-6)
    force = np.ascontiguousarray(smooth_force(fiber.sigma))
    back = np.ascontiguousarray(turn @ force[:, ::-1])
    found, _ = fiber.mobility_velocity(other, back)
    expected, _ = fiber.mobility_velocity(modes, force)
    assert relative(found[:, ::-1], turn @ expected) < 1e-9


def uncoiling(nodes, tolerance, control):
    fiber, _ = coiled(0.05, nodes, tolerance)
    stepper = SpectralStepper((fiber,), drag=1e5, flow=NoFlow(), control=control, threads=1)
    return stepper, stepper.init((lambda s: coil(0.05).sample(s).x.T,))


def test_a_run_converges_faster_than_by_the_nodes_alone():
    """Turns 0.03 L apart, uncoiling; with 32 nodes and with 40."""
    s = np.linspace(0.0, 1.0, 101)

    def shape(nodes, tolerance):
        stepper, carry = uncoiling(nodes, tolerance, FixedSteps(0.1, 3))
        while carry.time < 2.0:
            carry, _ = stepper.step(carry)
        return stepper.fibers[0].position(carry.modes[0, 0], s)

    exact = shape(64, 1e-7)
    coarse, fine = (np.abs(shape(n, 1e-7) - exact).max() for n in (32, 40))
    alone = np.abs(shape(40, 1.0) - exact).max()
    assert fine < 0.4 * coarse
    assert fine < 0.4 * alone
    assert fine < 2e-7


def test_a_restart_near_itself_is_bitwise_the_same():
    stepper, carry = uncoiling(24, 1e-5, AdaptiveSteps(1e-4))
    for _ in range(6):
        carry, _ = stepper.step(carry)
    saved = {name: np.array(values) for name, values in carry.arrays().items()}
    other, _ = uncoiling(24, 1e-5, AdaptiveSteps(1e-4))
    restored = Carry.restored(carry.step, saved)
    for _ in range(4):
        carry, _ = stepper.step(carry)
        restored, _ = other.step(restored)
    assert stepper.fibers[0].own_turns.operator(carry.modes[0, 0]).given.size, "it must be near"
    for name, values in carry.arrays().items():
        assert np.array_equal(values, restored.arrays()[name]), name
