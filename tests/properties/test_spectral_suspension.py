"""Interacting fibers in the spectral engine: the equations written out, and what must hold."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import stokesfibers as sf
from reference.pair_twins import plain
from stokesfibers.domain import Free, Periodic
from stokesfibers.flow import Shear
from stokesfibers.load import LoadedState
from stokesfibers.load.steric import StericRepulsion
from stokesfibers.numerics.krylov import gmres
from stokesfibers.numerics.step_control import AdaptiveSteps, FixedSteps
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import SpheroidalRegularization
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_suspension import SpectralInteraction
from stokesfibers.stepping import spectral_solve
from stokesfibers.stepping.spectral import SpectralStepper
from stokesfibers.stepping.spectral_carry import Carry, State
from stokesfibers.summation.close_approach import PaperCloseApproach, SmoothCloseApproach
from stokesfibers.summation.images import ImageSum
from stokesfibers.summation.periodic_kernel import ExactImages
from support import LinearFlow, assert_close, assert_order, free_end_curve

CURVE = free_end_curve(bend=60.0)
PERIODIC = Periodic((2.0, 0.0, 0.0))


def _fiber(length=1.0, eps=1e-2, rigidity=1.0, nodes=16):
    mobility = NonLocal(SpheroidalRegularization())
    return SpectralFiber.build(length, eps, rigidity=rigidity, nodes=nodes, mobility=mobility)


def _stepper(fibers, domain=None, *, control=None, close=None, images=None, **options):
    interaction = SpectralInteraction.build(
        fibers,
        domain or Free(),
        image_sum=images or ExactImages(),
        close_approach=close or SmoothCloseApproach(),
        tolerance=options.pop("tolerance", 1e-9),
    )
    return SpectralStepper(
        fibers,
        drag=options.pop("drag", 2e3),
        flow=options.pop("flow", Shear(1.0)),
        control=control or FixedSteps(0.04, 3),
        interaction=interaction,
        threads=options.pop("threads", 1),
        **options,
    )


def _curves(count, spread=0.5, seed=4, scale=1.0):
    """Bent fibers turned and shifted at random, as functions of the fraction."""
    random = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        shift = spread * random.normal(size=3)
        found.append(lambda q, t=turn, s=shift: scale * (CURVE(q).T @ t.T + s))
    return tuple(found)


def _raised(q, z):
    return CURVE(q).T + np.array([0.0, 0.0, z])


def _shapes(stepper, carry):
    """Positions now, over the length, at some fractions, (fiber, 3, point)."""
    s = np.linspace(0.0, 1.0, 9)
    pairs = zip(stepper.fibers, carry.modes[:, 0], strict=True)
    return np.stack([f.position(m, s * f.length) / f.length for f, m in pairs])


def _end(stepper, curves, steps=12):
    return _shapes(stepper, _advanced(stepper, curves, steps))


def _advanced(stepper, curves, steps=12):
    carry = stepper.init(curves)
    for _ in range(steps):
        carry, _ = stepper.step(carry)
    return carry


def _field(points, fibers, modes, forces, shifts):
    """Velocity by (7) + (8), times 8 pi mu, without the minus of (6), of all `shifts`, by twins."""
    total = np.zeros(points.shape)
    for fiber, m, f in zip(fibers, modes, forces, strict=True):
        weight = 0.5 * (fiber.eps * fiber.length) ** 2
        coefficients = fiber.to_legendre @ f.T
        for shift, (i, p) in product(shifts, enumerate(points)):
            total[i] += fiber.length * plain(
                p + shift,
                lambda q, fiber=fiber, m=m: fiber.position(m, q * fiber.length),
                lambda q, c=coefficients: np.polynomial.legendre.legval(2.0 * q - 1.0, c),
                weight,
                60,
            )
    return total


@pytest.mark.parametrize(
    ("domain", "images"),
    [(Free(), ExactImages()), (Periodic((2.6, 0.0, 0.0)), ImageSum(reach=1))],
    ids=["free", "near images"],
)
def test_a_step_of_many_passes_solves_the_coupled_equations_written_out(domain, images):
    """Euler's implicit step of (6) for two different fibers in space, with loads."""
    drag, h = 700.0, 0.05
    flow = LinearFlow(((0.1, 0.9, -0.3), (0.2, -0.4, 0.5), (0.7, -0.2, 0.3)))
    fibers = (_fiber(2.0, 1e-2, 3.0), _fiber(1.3, 3e-2, 0.7))

    def load(points, t):  # noqa: ARG001
        return np.stack([3.0 * points[..., 1], 4.0 + 0.0 * points[..., 0], -points[..., 2]], -1)

    stepper = _stepper(
        fibers,
        domain,
        images=images,
        close=PaperCloseApproach(d0=1e-6),
        control=FixedSteps(1e4 * h, 1),
        newton_passes=14,
        load=load,
        flow=flow,
        drag=drag,
        tolerance=1e-11,
    )
    curves = (
        lambda q: 2.0 * CURVE(q).T,
        lambda q: 1.3 * CURVE(q).T[:, [1, 2, 0]] + [0.2, 0.1, 0.4],
    )
    before = stepper.init(curves)
    after, report = stepper.step(before)
    assert report.step_size == h
    modes, tensions = after.modes[:, 0], after.tensions[:, 0]
    x, forces = [], []
    for k, fiber in enumerate(fibers):
        s = fiber.sigma * fiber.length
        x.append(fiber.position(modes[k], s))
        forces.append(fiber.force(modes[k], tensions[k], s))
    forces = [f - load(xk.T, h).T for f, xk in zip(forces, x, strict=True)]
    period = domain.lengths[0]
    rates = []
    for k, fiber in enumerate(fibers):
        own, _ = fiber.mobility_velocity(modes[k], forces[k])
        shifts = np.array([[p * period, 0.0, 0.0] for p in ((-1, 0, 1) if period else (0,))])
        middles = [m[:, 0] * f.length for m, f in zip(modes, fibers, strict=True)]
        induced = np.zeros((fiber.count, 3))
        for j, other in enumerate(fibers):
            apart = middles[k] - middles[j]
            nearest = domain.nearest_image(apart) - apart
            seen = [q + nearest for q in shifts if j != k or np.any(q)]
            if seen:
                induced += _field(x[k].T, (other,), (modes[j],), (forces[j],), seen)
        before_k = fiber.position(before.modes[k, 0], fiber.sigma * fiber.length)
        rates.append((x[k] - before_k) / h)
        moved = drag * (rates[k] - flow.velocity(x[k].T, h).T)
        assert np.abs(induced).max() > 0.02 * np.abs(own).max(), "the others matter"
        assert_close(moved, -(own + induced.T), rtol=3e-8)
    velocity = stepper.velocity(State(modes, tensions), h)
    assert_close(velocity, np.stack(rates), rtol=1e-7)


def test_initial_tensions_let_nothing_stretch():
    stepper = _stepper((_fiber(nodes=32), _fiber(nodes=32)))
    carry = stepper.init(_curves(2, spread=0.2))
    velocity = stepper.velocity(State(carry.modes[:, 0], carry.tensions[:, 0]), 0.0)
    for k, fiber in enumerate(stepper.fibers):
        modes = fiber.basis.fit(velocity[k].T, fiber.sigma, fiber.quadrature)
        slopes = fiber.constraint @ modes
        tangent = carry.modes[k, 0] @ fiber.constraint.T
        stretching = np.sum(tangent.T * slopes, axis=1)
        assert np.abs(stretching).max() < 1e-4 * np.abs(slopes).max()


@pytest.mark.parametrize("images", [ExactImages(), ImageSum()], ids=["exact", "moments"])
def test_threads_do_not_change_a_bit(images):
    fibers = tuple(_fiber(eps=eps) for eps in (1e-2, 2e-2, 1e-2, 1e-2, 3e-2))
    curves = _curves(5, spread=0.3)
    one, two = (
        _advanced(_stepper(fibers, PERIODIC, images=images, threads=t), curves) for t in (1, 2)
    )
    for name, values in one.arrays().items():
        assert np.array_equal(values, two.arrays()[name]), name


def test_restart_in_the_middle_is_bitwise_the_same():
    fibers, curves = (_fiber(), _fiber(), _fiber()), _curves(3, spread=0.3)
    stepper = _stepper(fibers, PERIODIC, control=AdaptiveSteps(1e-4))
    carry = _advanced(stepper, curves, 20)
    saved = {name: np.array(values) for name, values in carry.arrays().items()}
    restored = Carry.restored(carry.step, saved)
    other = _stepper(fibers, PERIODIC, control=AdaptiveSteps(1e-4))
    for _ in range(15):
        carry, _ = stepper.step(carry)
        restored, _ = other.step(restored)
    for name, values in carry.arrays().items():
        assert np.array_equal(values, restored.arrays()[name]), name


@pytest.mark.parametrize("domain", [Free(), PERIODIC], ids=["free", "periodic"])
def test_relabelling_fibers_relabels_the_run(domain):
    kinds = [_fiber(), _fiber(0.8, 2e-2, 0.5), _fiber(), _fiber(1.1, 3e-2, 2.0)]
    curves, order = _curves(4, spread=0.4), [2, 0, 3, 1]
    curves = [lambda q, c=c, f=f: f.length * c(q) for c, f in zip(curves, kinds, strict=True)]
    run = _end(_stepper(tuple(kinds), domain), tuple(curves))
    again = _end(_stepper(tuple(kinds[k] for k in order), domain), tuple(curves[k] for k in order))
    assert_close(again, run[order], rtol=1e-11)


@pytest.mark.parametrize("axis", [0, 2])
def test_a_shift_by_periods_changes_nothing_but_the_position(axis):
    lengths = [0.0, 0.0, 0.0]
    lengths[axis] = 1.5
    fibers, curves = (_fiber(), _fiber(), _fiber()), _curves(3, spread=0.4)
    shift = 6.0 * np.eye(3)[axis]
    moved = (curves[0], lambda q: curves[1](q) + shift, curves[2])
    # without a flow, since a shear tells heights apart
    stepper = _stepper(
        fibers, Periodic(tuple(lengths)), drag=20.0, flow=LinearFlow(((0.0,) * 3,) * 3)
    )
    run, again = (_end(stepper, c, 25) for c in (curves, moved))
    start = _shapes(stepper, stepper.init(curves))
    assert np.abs(run - start).max() > 1e-3, "they move"
    run[1] += shift[:, None]
    assert_close(again, run, rtol=1e-9)


def test_fibers_far_apart_move_as_each_alone():
    curves = _curves(2, spread=0.0)
    alone = [_end(_stepper((_fiber(),)), (c,), 28)[0] for c in curves]
    errors = []
    for distance in (15.0, 30.0, 60.0):
        shift = np.array([0.0, 0.0, distance])
        apart = (curves[0], lambda q, s=shift: curves[1](q) + s)
        found = _end(_stepper((_fiber(), _fiber())), apart, 28)
        found[1] -= shift[:, None]
        errors.append(float(np.abs(found - alone).max()))
    assert_order(errors, between=(1.8, 2.3), final=2e-7)


def test_one_fiber_in_free_space_needs_no_interaction():
    curves = _curves(1)
    fiber = _fiber()
    bare = SpectralStepper(
        (fiber,), drag=2e3, flow=Shear(1.0), control=FixedSteps(0.04, 3), threads=1
    )
    with_it, without = _advanced(_stepper((fiber,)), curves), _advanced(bare, curves)
    for name, values in with_it.arrays().items():
        assert np.array_equal(values, without.arrays()[name]), name


def test_a_fiber_sees_its_own_images():
    curves, fiber = _curves(1), _fiber()
    free = _end(_stepper((fiber,)), curves, 28)
    apart = [
        float(np.abs(_end(_stepper((fiber,), Periodic((d, 0, 0))), curves, 28) - free).max())
        for d in (4.0, 8.0, 16.0)
    ]
    assert_order(apart, between=(2.6, 3.4), final=3e-7)


def test_mirror_images_stay_mirror_images():
    """Two fibers that mirror each other at z = 0, in a shear in the plane, keep doing so."""
    mirror = np.array([1.0, 1.0, -1.0])
    curves = (
        lambda q: _raised(q, 0.25),
        lambda q: (_raised(q, 0.25)) * mirror,
    )
    one, other = _end(_stepper((_fiber(), _fiber())), curves, 30)
    assert_close(other, one * mirror[:, None], rtol=1e-11)


def test_iterations_are_reported_and_grow_with_the_coupling():
    most = []
    for gap in (0.5, 0.05):
        curves = (lambda q: CURVE(q).T, lambda q, g=gap: _raised(q, g))
        stepper = _stepper((_fiber(), _fiber()))
        carry, count = stepper.init(curves), []
        for _ in range(10):
            carry, report = stepper.step(carry)
            count.append(report.iterations)
        most.append(max(count))
    assert 1 <= most[0] < most[1] <= 6


@pytest.mark.parametrize("close", [PaperCloseApproach(), SmoothCloseApproach()])
def test_fibers_that_cross_at_half_the_blending_distance_go_on_moving(close):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    middle = CURVE(0.5)
    one, other = (lambda q: CURVE(q).T - middle), (lambda q: (CURVE(q).T - middle) @ turn.T)
    stepper = _stepper(
        (_fiber(), _fiber()), close=close, tolerance=1e-7, control=AdaptiveSteps(1e-3)
    )
    carry = stepper.init((one, lambda q: other(q) + np.array([0.0, 0.0, 0.01])))
    for _ in range(30):
        carry, report = stepper.step(carry)
        assert report.iterations <= 25
    assert carry.time > 0.01
    gap = _shapes(stepper, carry)[1, :, 4] - _shapes(stepper, carry)[0, :, 4]
    assert 0.0 < gap[2] < 0.02


def test_units_do_not_matter_where_fibers_blend():
    """Twice as long, three times as stiff, in the same flow: for the same drag number."""

    def end(length, rigidity):
        fiber = _fiber(length, rigidity=rigidity)
        drag = 2e3 * rigidity / length**4
        stepper = _stepper((fiber, fiber), drag=drag, control=FixedSteps(0.02, 2), tolerance=1e-7)

        def turned(q):
            middle = CURVE(0.5)
            # 0.03 apart: between d_0 = 0.02 and twice as much
            return (CURVE(q).T - middle) * [-1.0, 1.0, 1.0] + middle + [0.0, 0.0, 0.03]

        curves = (lambda q: length * CURVE(q).T, lambda q: length * turned(q))
        return _end(stepper, curves, steps=6)

    one, other = end(1.0, 1.0), end(2.0, 3.0)
    assert_close(other, one, rtol=1e-9)


def test_steric_repulsion_keeps_fibers_apart_and_pushes_neither_together():
    fibers = (_fiber(), _fiber())
    weights = np.stack([f.quadrature for f in fibers])

    def load(points, t):  # noqa: ARG001
        state = LoadedState(points, weights, np.array([0.01, 0.01]), Free())
        return StericRepulsion(strength=4e4, range=0.05).density(state)

    still = LinearFlow(((0.0,) * 3,) * 3)
    curves = (lambda q: CURVE(q).T, lambda q: _raised(q, 0.06))
    options = {"flow": still, "drag": 1e3, "control": AdaptiveSteps(1e-4), "tolerance": 1e-7}
    ends = []
    for g in (load, None):
        stepper = _stepper(fibers, load=g, **options)
        carry = stepper.init(curves)
        while carry.time < 5e-3:
            carry, _ = stepper.step(carry)
        state = stepper.interpolate(carry, 5e-3)
        ends.append(np.stack([fibers[0].position(m, np.linspace(0, 1, 9)) for m in state.modes]))
    pushed, alone = ends
    assert ((pushed[1] - pushed[0])[2] > (alone[1] - alone[0])[2] + 1e-3).all()
    assert_close(pushed.mean(axis=(0, 2)), alone.mean(axis=(0, 2)), atol=1e-4)


def test_gmres_solves_and_says_when_it_cannot():
    random = np.random.default_rng(0)
    matrix = np.eye(30) + 0.02 * random.normal(size=(30, 30))
    right = random.normal(size=(5, 6))
    table = random.normal(size=(4, 30))

    def operator(v):
        return (matrix @ v.ravel()).reshape(v.shape), table @ v.ravel()

    found, iterations = gmres(operator, right, reduction=1e-12, most=30)
    assert_close(found, table @ np.linalg.solve(matrix, right.ravel()), rtol=1e-10)
    assert 5 < iterations < 25
    rough, few = gmres(operator, right, reduction=1e-2, most=30)
    assert few < 5
    assert_close(rough, found, rtol=2e-2)
    zero, _ = gmres(operator, 0.0 * right, reduction=1e-2, most=30)
    assert not zero.any()
    with pytest.raises(np.linalg.LinAlgError, match="in 3 iterations"):
        gmres(operator, right, reduction=1e-12, most=3)
    with pytest.raises(np.linalg.LinAlgError, match="not finite"):
        gmres(operator, np.nan * right, reduction=1e-2, most=3)
    with pytest.raises(np.linalg.LinAlgError, match="singular"):
        gmres(lambda v: (0.0 * v, v), right, reduction=1e-2, most=3)


def test_gmres_finds_the_smallest_residual_of_each_number_of_iterations():
    """|b - A u| over u in the span of b, A b, ..., by least squares."""
    random = np.random.default_rng(1)
    matrix, right = random.normal(size=(12, 12)), random.normal(size=12)
    columns = [right]
    for _ in range(4):
        columns.append(matrix @ columns[-1])
    image = matrix @ np.stack(columns[:4], axis=1)
    _, (left, *_), *_ = np.linalg.lstsq(image, right, rcond=None)
    least = np.sqrt(left) / np.linalg.norm(right)
    found, iterations = gmres(
        lambda v: (matrix @ v, v), right, reduction=least * (1.0 + 1e-9), most=12
    )
    assert iterations == 4
    off = np.linalg.norm(right - matrix @ found) / np.linalg.norm(right)
    assert off == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize(("basis", "allowed"), [(10**7, 300), (1, 60), (20_000, 20_000 // 192)])
def test_iterations_are_as_many_as_memory_allows(basis, allowed, monkeypatch):
    """Two fibers of 32 nodes: 192 forces."""
    asked = []

    def watched(operator, right, *, reduction, most):
        asked.append((right.size, most))
        return gmres(operator, right, reduction=reduction, most=most)

    monkeypatch.setattr(spectral_solve, "gmres", watched)
    monkeypatch.setattr(spectral_solve, "_BASIS", basis)
    stepper = _stepper([_fiber(nodes=32)] * 2)
    stepper.step(stepper.init(_curves(2)))
    assert set(asked) == {(192, allowed)}


def test_filaments_that_settle_into_each_other_are_solved_in_one_step_each():
    """Near contact the solves take more than 60 iterations; halved steps would take thousands."""
    fiber = sf.Fiber(slenderness=1e-2, count=2)
    load = sf.Gravity((0.0, -1000.0, 0.0))
    problem = sf.Problem(fiber, mu_bar=1.0, load=load, engine=sf.SpectralEngine(rtol=1e-3))
    along = np.linspace(-0.5, 0.5, 11)
    points = np.array([[[s, y, 0.0] for s in along] for y in (0.0, 0.5)])
    steps = []

    def watch(moment):
        steps.append(moment.time)
        assert len(steps) < 300

    record = sf.every(4e-4, observables=1e-5)
    result = sf.simulate(problem, points, until=8e-4, record=record, threads=1, watch=watch)
    assert (result.status.code, result.status.trust) == ("done", "trusted")
    assert 60 < result.data["numerics"]["iterations"].max() < 200
    gap = result.data["observables"]["smallest_gap"].to_numpy()
    assert 0.0 < gap.min() < 1e-3, "a tenth of the radius"
