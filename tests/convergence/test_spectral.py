"""Convergence of the spectral engine: operators and shapes in nodes, shapes in time, by order."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from reference.twins import continuous_finite_part
from stokesfibers.core.errors import InputError
from stokesfibers.fiber import curves
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import Shear
from stokesfibers.kernels import spectral as kernels
from stokesfibers.numerics.legendre import gauss_legendre, legendre_values
from stokesfibers.numerics.shape_free import shape_free_weights
from stokesfibers.numerics.step_control import AdaptiveSteps, FixedSteps
from stokesfibers.slender.mobility import NonLocal, slenderness_constant
from stokesfibers.slender.regularization import (
    ConstantRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.stepping.base import StepError
from stokesfibers.stepping.report import StepReport
from stokesfibers.stepping.spectral import SpectralStepper
from stokesfibers.stepping.spectral_carry import Carry, State
from support import LinearFlow, assert_close, assert_order, free_end_curve

CURVE = free_end_curve()
BENT = free_end_curve(bend=90.0)
MU_BAR, END = 1e5, 3.0


def _force(s):
    return np.stack([np.cos(3.0 * s), np.sin(2.0 * s) + s**2, np.exp(-s)])


def _fiber(nodes, eps=1e-2, regularization=None):
    mobility = NonLocal(regularization or SpheroidalRegularization())
    return SpectralFiber.build(1.0, eps, rigidity=1.0, nodes=nodes, mobility=mobility)


def _operator_error(nodes, eps, regularization) -> float:
    fiber = _fiber(nodes, eps, regularization)
    sigma = fiber.sigma
    modes = fiber.fit(lambda q: CURVE(q).T)
    found, _ = fiber.mobility_velocity(modes, _force(sigma))
    force, tangent = _force(sigma), CURVE(sigma, 1)
    local = fiber.local.a * force + fiber.local.b * tangent * np.sum(tangent * force, axis=0)
    delta = regularization.delta(sigma, eps)
    exact = [continuous_finite_part(CURVE, _force, s, d) for s, d in zip(sigma, delta, strict=True)]
    return float(np.abs(found - local - np.stack(exact, axis=1)).max())


@pytest.mark.parametrize("eps", [1e-3, 3e-2])
@pytest.mark.parametrize("choice", [SpheroidalRegularization(), ConstantRegularization()])
def test_the_finite_part_is_that_of_24_to_spectral_accuracy(choice, eps):
    coarse, fine = (_operator_error(n, eps, choice) for n in (12, 28))
    assert coarse > 1e-6, "the coarse grid must not be exact"
    assert fine < 1e-10


def test_force_and_tension_anywhere_agree_with_the_curve():
    fiber = SpectralFiber.build(
        3.0, 1e-2, rigidity=5.0, nodes=40, mobility=NonLocal(SpheroidalRegularization())
    )
    modes = fiber.fit(lambda q: 3.0 * CURVE(q).T)
    s = np.linspace(0.0, 3.0, 41)
    for order, allowed in ((0, 1e-13), (1, 1e-12), (2, 1e-10), (3, 1e-8), (4, 1e-6)):
        expected = 3.0 ** (1 - order) * CURVE(s / 3.0, order)
        assert_close(fiber.position(modes, s, order), expected, rtol=allowed)
    rng = np.random.default_rng(3)
    tension = rng.normal(size=39) / (1.0 + np.arange(39.0)) ** 3
    middle, h = s[1:-1], 1e-4
    f = fiber.integrated_force
    slope = (f(modes, tension, middle + h) - f(modes, tension, middle - h)) / (2.0 * h)
    assert_close(fiber.force(modes, tension, middle), slope, rtol=1e-5)
    ends = f(modes, tension, np.array([0.0, 3.0]))
    assert np.abs(ends).max() < 1e-9 * np.abs(f(modes, tension, s)).max()


def test_a_step_of_many_passes_solves_the_equations_written_out():
    """Euler's implicit step of (20) for a fiber in space, with length, load and a general flow."""
    length, rigidity, drag, h = 2.0, 3.0, 700.0, 0.05
    flow = LinearFlow(((0.1, 0.9, -0.3), (0.2, -0.4, 0.5), (0.7, -0.2, 0.3)))

    def load(points, t):  # noqa: ARG001
        return np.stack([0.3 * points[..., 1], 4.0 + 0.0 * points[..., 0], -points[..., 2]], -1)

    mobility = NonLocal(SpheroidalRegularization())
    fiber = SpectralFiber.build(length, 1e-2, rigidity=rigidity, nodes=20, mobility=mobility)
    stepper = SpectralStepper(
        (fiber,),
        drag=drag,
        flow=flow,
        control=FixedSteps(1e4 * h, 1),
        newton_passes=12,
        load=load,
        threads=1,
    )
    before = stepper.init((lambda q: length * CURVE(q).T,))
    after, report = stepper.step(before)
    assert report.step_size == h
    modes, tension = after.modes[0, 0], after.tensions[0, 0]
    s = fiber.sigma * length
    x, x_before = fiber.position(modes, s), fiber.position(before.modes[0, 0], s)
    force = fiber.force(modes, tension, s) - load(x.T, h).T
    resisted, _ = fiber.mobility_velocity(modes, force)
    moved = drag * ((x - x_before) / h - flow.velocity(x.T, h).T)
    assert np.abs(x - x_before).max() > 0.01
    assert_close(moved, -resisted, rtol=1e-10)
    places = gauss_legendre(19)[0] * length
    tangent = fiber.position(modes, places, 1)
    assert_close(np.sum(tangent**2, axis=0), np.ones(19), rtol=1e-13)
    velocity = stepper.velocity(State(after.modes[:, 0], after.tensions[:, 0]), h)[0]
    assert_close(velocity, (x - x_before) / h, rtol=1e-9)


def test_the_matrix_of_a_step_is_the_slope_of_its_equations_with_the_mobility_held():
    """All are quadratic in modes and tensions: central differences are exact."""
    fiber, alpha, drag = _fiber(10, 3e-2), 7.0, 50.0
    flow = LinearFlow(((0.1, 0.9, -0.3), (0.2, -0.4, 0.5), (0.7, -0.2, 0.3)))
    rng = np.random.default_rng(4)
    modes = fiber.fit(lambda q: CURVE(q).T)
    tension, load = rng.normal(size=9), rng.normal(size=(3, 10))
    rate, dx, pull = rng.normal(size=(3, 10)), rng.normal(size=(3, 10)), rng.normal(size=9)

    def at(step):
        """Return what the kernel returns, and U - x_t at the nodes."""
        moved, moving = modes + step * dx, rate + alpha * step * dx
        points = np.ascontiguousarray((moved @ fiber.tables[0].T).T)
        u = np.ascontiguousarray(flow.velocity(points, 0.0).T)
        gradient = np.ascontiguousarray(flow.gradient(points, 0.0))
        pulled = tension + step * pull
        arguments = (moved, pulled, moving, u, gradient, load, alpha, 1.0, drag)
        found = kernels.increment_system(*arguments, *fiber.kernel_tables)
        return found, u - moving @ fiber.tables[0].T

    (matrix, _, scale, _, force, resisted, mobility, *_), _ = at(0.0)
    xx, yy, zz, xy, xz, yz = mobility
    whole = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    assert_close(resisted, np.einsum("pqij,qj->pi", whole, force), rtol=1e-12)
    rows = []
    for step in (1e-2, -1e-2):
        found, apart = at(step)
        pushed = scale * np.einsum("pqij,qj->pi", whole, found[4])
        rows.append(np.concatenate([(apart / alpha - pushed).ravel(), found[1][30:]]))
    slope = (rows[0] - rows[1]) / 2e-2
    unknown = np.concatenate([dx.ravel(), scale * pull])
    assert_close((matrix @ unknown)[:30], -slope[:30], rtol=1e-9)
    assert_close((matrix @ unknown)[30:], -slope[30:], rtol=1e-9)
    assert scale == pytest.approx(1.0 / (drag * alpha))


def test_initial_tension_lets_nothing_stretch():
    stepper = _stepper(40, AdaptiveSteps(1e-4))
    carry = stepper.init((_start,))
    fiber = stepper.fibers[0]
    velocity = stepper.velocity(State(carry.modes[:, 0], carry.tensions[:, 0]), 0.0)[0]
    modes = fiber.basis.fit(velocity.T, fiber.sigma, fiber.quadrature)  # as many as nodes
    slopes = fiber.constraint @ modes
    tangent = carry.modes[0, 0] @ fiber.constraint.T
    stretching = np.sum(tangent.T * slopes, axis=1)
    assert np.abs(stretching).max() < 1e-6 * np.abs(slopes).max()


def _stepper(nodes, control, **options) -> SpectralStepper:
    return SpectralStepper(
        (_fiber(nodes),), drag=MU_BAR, flow=Shear(1.0), control=control, threads=1, **options
    )


def _start(q):
    return BENT(q).T


def _run(stepper, end=END) -> tuple[Carry, list[StepReport]]:
    carry, reports = stepper.init((_start,)), []
    while carry.time < end:
        carry, report = stepper.step(carry)
        reports.append(report)
    return carry, reports


def _shape(stepper, end=END):
    carry, _ = _run(stepper, end)
    state = stepper.interpolate(carry, end)
    return stepper.fibers[0].position(state.modes[0], np.linspace(0.0, 1.0, 31))


@cache
def _reference():
    return _shape(_stepper(40, FixedSteps(0.006, 5)))


@pytest.mark.parametrize(
    ("order", "between", "final"),
    [
        (1, (0.8, 1.2), 4e-3),
        (2, (1.7, 2.3), 5e-4),
        (3, (2.6, 4.0), 5e-6),
        (4, (3.4, 4.7), 2e-6),
        (5, (4.2, 6.5), 1e-7),
    ],
)
def test_order_in_time(order, between, final):
    errors = [
        float(np.abs(_shape(_stepper(40, FixedSteps(dt, order))) - _reference()).max())
        for dt in (0.06, 0.03)
    ]
    assert_order(errors, between=between, final=final)


def test_shapes_converge_spectrally_in_nodes():
    control = FixedSteps(0.02, 5)
    fine = _shape(_stepper(48, control))
    errors = [float(np.abs(_shape(_stepper(n, control)) - fine).max()) for n in (14, 22, 30)]
    assert errors[0] > 20.0 * errors[1] > 400.0 * errors[2]
    assert errors[2] < 1e-7


def test_the_error_follows_the_tolerance_through_a_buckling():
    """A bend of 4e-7 grows a millionfold, mu_bar = 4e5, before it shows."""
    fiber = Fiber(slenderness=1e-3)
    curve = curves.nearly_straight(fiber).at_fractions
    mobility = NonLocal(SpheroidalRegularization())
    spectral = SpectralFiber.build(1.0, 1e-3, rigidity=1.0, nodes=28, mobility=mobility)

    def shape(rtol):
        control = AdaptiveSteps(rtol)
        stepper = SpectralStepper(
            (spectral,), drag=4e5, flow=Shear(1.0), control=control, threads=1
        )
        carry, rejected = stepper.init((curve,)), 0
        while carry.time < 49.9:
            carry, report = stepper.step(carry)
            rejected += report.rejected
        assert rejected == carry.counters[4] <= 0.1 * carry.step
        state = stepper.interpolate(carry, 49.9)
        return spectral.position(state.modes[0], np.linspace(0.0, 1.0, 41)), carry.step

    exact, _ = shape(1e-7)
    assert np.abs(exact[0]).max() < 0.4, "it has buckled"
    for rtol, most_steps in ((1e-2, 130), (1e-3, 220), (1e-5, 520)):
        found, steps = shape(rtol)
        assert 0.05 * rtol < np.abs(found - exact).max() < 5.0 * rtol
        assert steps < most_steps


def test_length_error_is_the_square_of_a_steps_error_and_vanishes_with_a_second_pass():
    fiber = _fiber(40)
    worst = {}
    for passes in (1, 2):
        carry, reports = _run(_stepper(40, FixedSteps(0.1, 2), newton_passes=passes))
        assert reports[-1].iterations == passes
        tangent = carry.modes[0, 0] @ fiber.constraint.T
        worst[passes] = float(np.abs(np.sum(tangent**2, axis=0) - 1.0).max())
    assert 1e-6 < worst[1] < 1e-3
    assert worst[2] < 1e-3 * worst[1]


def _straight_force(nodes, eps, regularization):
    """Force per length on a straight rod moving with cos(3 s): (-c + S_delta) f = cos(3 s)."""
    sigma, _ = gauss_legendre(nodes)
    operator = shape_free_weights(regularization.delta(sigma, eps)).finite
    operator = operator - slenderness_constant(eps) * np.eye(nodes)
    force = np.linalg.solve(operator, np.cos(3.0 * sigma))
    modes = np.linalg.solve(legendre_values(sigma, nodes), force)
    return legendre_values(np.linspace(0.01, 0.99, 50), nodes) @ modes


def _straight_errors(counts, eps, regularization):
    fine = _straight_force(160, eps, regularization)
    return [np.abs(_straight_force(n, eps, regularization) - fine).max() for n in counts]


def test_smooth_regularisations_converge_spectrally_and_that_of_the_paper_algebraically():
    first, last = _straight_errors((12, 96), 1e-2, SpheroidalRegularization())
    assert first < 1e-8, "Legendre polynomials are nearly its eigenfunctions"
    assert last < 2e-10
    first, last = _straight_errors((24, 96), 1e-2, ConstantRegularization())
    assert first > 1e-7
    assert last < 1e-12
    first, last = _straight_errors((24, 96), 1e-3, PaperRegularization())
    assert 3.0 < first / last < 300.0, "its coefficients are only C^1"
    assert last > 1e-10


def test_restart_in_the_middle_is_bitwise_the_same():
    stepper = _stepper(16, AdaptiveSteps(1e-4))
    carry = stepper.init((_start,))
    for _ in range(25):
        carry, _ = stepper.step(carry)
    saved = {name: np.array(values) for name, values in carry.arrays().items()}
    restored = Carry.restored(carry.step, saved)
    other = _stepper(16, AdaptiveSteps(1e-4))
    for _ in range(20):
        carry, _ = stepper.step(carry)
        restored, _ = other.step(restored)
    assert restored.step == carry.step
    for name, values in carry.arrays().items():
        assert np.array_equal(values, restored.arrays()[name]), name


def test_interpolation_follows_the_steps_without_changing_them():
    stepper = _stepper(20, FixedSteps(0.02, 4))
    carry, _ = _run(stepper, 0.5)
    before = carry.times[1]
    fiber = stepper.fibers[0]
    there = stepper.interpolate(carry, before)
    assert_close(there.modes[0], carry.modes[0, 1], rtol=1e-12)
    fine = _stepper(20, FixedSteps(0.004, 5))
    t = 0.3 * before + 0.7 * carry.time
    exact, _ = _run(fine, t)
    s = np.linspace(0.0, 1.0, 11)
    found = fiber.position(stepper.interpolate(carry, t).modes[0], s)
    expected = fiber.position(fine.interpolate(exact, t).modes[0], s)
    assert_close(found, expected, atol=5e-8)
    with pytest.raises(InputError, match="t: expected a time from"):
        stepper.interpolate(carry, carry.time + 0.1)


def test_threads_and_neighbours_do_not_change_a_bit():
    mobility = NonLocal(SpheroidalRegularization())
    short = SpectralFiber.build(0.4, 2e-2, rigidity=0.1, nodes=12, mobility=mobility)
    kinds = {"long": (_fiber(12), _start), "short": (short, lambda q: 0.4 * CURVE(q).T)}

    def carry_of(threads, *names):
        stepper = SpectralStepper(
            tuple(kinds[name][0] for name in names),
            drag=MU_BAR,
            flow=Shear(1.0),
            control=FixedSteps(0.05, 3),
            threads=threads,
        )
        carry = stepper.init(tuple(kinds[name][1] for name in names))
        for _ in range(12):
            carry, _ = stepper.step(carry)
        return carry

    one, both = carry_of(1, "long", "short"), carry_of(None, "long", "short")
    assert np.array_equal(one.modes, both.modes)
    assert np.array_equal(one.tensions, both.tensions)
    for k, name in enumerate(("long", "short")):
        alone = carry_of(1, name)
        assert np.array_equal(one.modes[k : k + 1], alone.modes)
        assert np.array_equal(one.tensions[k : k + 1], alone.tensions)


def test_a_run_that_blows_up_says_so():
    stepper = _stepper(12, AdaptiveSteps(1e-4))
    carry = stepper.init((_start,))
    broken = Carry.restored(carry.step, carry.arrays() | {"tensions": carry.tensions * np.nan})
    with pytest.raises(StepError, match="No step from t = 0 succeeds"):
        stepper.step(broken)


def test_the_decay_of_modes_tells_the_error_and_the_nodes_needed():
    control = FixedSteps(0.02, 5)
    fine = _shape(_stepper(48, control))
    for nodes in (14, 22, 30):
        stepper = _stepper(nodes, control)
        carry, worst = stepper.init((_start,)), 0.0
        fiber = stepper.fibers[0]
        while carry.time < END:
            worst = max(worst, fiber.resolution(carry.modes[0, 0]).error)
            carry, _ = stepper.step(carry)
        assert float(np.abs(_shape(stepper) - fine).max()) < worst, "the worst shape decides"
    for nodes in (16, 24, 32):
        fiber = _fiber(nodes)
        first = fiber.resolution(fiber.fit(_start))
        wanted = int(first.nodes_for(0.01 * first.error))
        assert nodes + 4 <= wanted <= 2 * nodes
        better = _fiber(wanted).resolution(_fiber(wanted).fit(_start))
        assert 1e-5 * first.error < better.error < 0.05 * first.error


def test_nodes_can_be_added_in_the_middle_of_a_run():
    control = AdaptiveSteps(1e-4)
    coarse, fine = _stepper(32, control), _stepper(44, control)
    carry = coarse.init((_start,))
    while carry.time < 0.5 * END:
        carry, _ = coarse.step(carry)
    more = carry.resized(44)
    s = np.linspace(0.0, 1.0, 21)
    for order in (0, 2):
        kept = coarse.fibers[0].position(carry.modes[0, 0], s, order)
        assert_close(fine.fibers[0].position(more.modes[0, 0], s, order), kept, rtol=1e-13)
    kept = coarse.fibers[0].tension(carry.tensions[0, 0], s)
    assert_close(fine.fibers[0].tension(more.tensions[0, 0], s), kept, rtol=1e-13)
    rejected = 0
    while more.time < END:
        more, report = fine.step(more)
        rejected += report.rejected
    assert rejected <= 1
    found = fine.fibers[0].position(fine.interpolate(more, END).modes[0], np.linspace(0, 1, 31))
    assert np.abs(found - _reference()).max() < 1e-4
    back = more.resized(44).resized(60).resized(44)
    assert np.array_equal(back.modes, more.modes)
