"""Convergence of interacting fibers in the spectral engine: time, nodes, and the paper's scheme."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.constraint.coupled import Krylov
from stokesfibers.domain import Free, Periodic
from stokesfibers.flow import Shear
from stokesfibers.numerics.step_control import AdaptiveSteps, FixedSteps
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import SpheroidalRegularization
from stokesfibers.slender.spectral import SpectralFiber
from stokesfibers.slender.spectral_suspension import SpectralInteraction
from stokesfibers.stepping.paper import PaperStepper
from stokesfibers.stepping.spectral import SpectralStepper
from stokesfibers.summation.close_approach import PaperCloseApproach, SmoothCloseApproach
from stokesfibers.summation.images import ImageSum
from stokesfibers.summation.periodic_kernel import ExactImages
from support import assert_order, free_end_curve

CURVE = free_end_curve(bend=60.0)
S = np.linspace(0.0, 1.0, 21)


def _stepper(count, control, *, nodes=28, mu_bar=1e4, domain=None, **options):
    mobility = NonLocal(SpheroidalRegularization())
    fibers = tuple(
        SpectralFiber.build(1.0, 1e-2, rigidity=1.0, nodes=nodes, mobility=mobility)
        for _ in range(count)
    )
    interaction = SpectralInteraction.build(
        fibers,
        domain or Free(),
        image_sum=options.pop("image_sum", ExactImages()),
        close_approach=options.pop("close_approach", SmoothCloseApproach()),
        tolerance=options.pop("tolerance", 1e-9),
    )
    return SpectralStepper(
        fibers,
        drag=mu_bar,
        flow=Shear(1.0),
        control=control,
        threads=1,
        interaction=interaction,
        **options,
    )


def _run(stepper, curves, end):
    carry, iterations = stepper.init(curves), 0
    while carry.time < end:
        carry, report = stepper.step(carry)
        iterations = max(iterations, report.iterations)
    state = stepper.interpolate(carry, end)
    shapes = [f.position(m, S) for f, m in zip(stepper.fibers, state.modes, strict=True)]
    return np.stack(shapes), iterations


def _parallel(count, gap):
    return tuple(lambda q, k=k: CURVE(q).T + np.array([0.0, 0.0, gap * k]) for k in range(count))


def _crossed(count):
    """Curves turned about z by a right angle each, one above the other."""
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return tuple(
        lambda q, k=k: CURVE(q).T @ np.linalg.matrix_power(turn, k).T + [0.1 * k, 0.0, 0.12 * k]
        for k in range(count)
    )


CASES = {
    "2 parallel": (_parallel(2, 0.05), None),
    "5 free": (_crossed(5), None),
    "2 periodic": (_crossed(2), Periodic((1.3, 0.0, 0.0))),
}
OTHERS = [case for case in CASES if case != "2 parallel"]
SLOW = pytest.mark.slow


@cache
def _shapes(case, dt, order):
    curves, domain = CASES[case]
    stepper = _stepper(len(curves), FixedSteps(dt, order), domain=domain)
    return _run(stepper, curves, 1.2)[0]


@pytest.mark.parametrize(
    ("order", "between", "final"),
    [(2, (1.8, 2.4), 2e-4), (3, (2.7, 3.6), 1.5e-5), (4, (3.6, 5.8), 4e-7), (5, (4.2, 8.5), 1e-7)],
)
@pytest.mark.parametrize("case", ["2 parallel", *(pytest.param(c, marks=SLOW) for c in OTHERS)])
def test_order_in_time_of_coupled_steps(case, order, between, final):
    errors = [
        float(np.abs(_shapes(case, dt, order) - _shapes(case, 0.006, 5)).max())
        for dt in (0.06, 0.03)
    ]
    assert_order(errors, between=between, final=final)


def test_shapes_of_coupled_fibers_converge_spectrally_in_nodes():
    def shapes(nodes):
        stepper = _stepper(2, FixedSteps(0.03, 4), nodes=nodes, tolerance=1e-10)
        return _run(stepper, _parallel(2, 0.07), 0.6)[0]

    fine = shapes(44)
    errors = [float(np.abs(shapes(n) - fine).max()) for n in (8, 12, 18)]
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]
    assert errors[2] < 1e-6


@pytest.mark.parametrize("gap", [pytest.param(0.1, marks=SLOW), 0.05])
@pytest.mark.parametrize(
    ("order", "dt"),
    [pytest.param(2, 0.25, marks=SLOW), (3, 0.25), pytest.param(4, 0.2, marks=SLOW), (5, 0.16)],
)
def test_close_parallel_fibers_are_stable_at_the_step_of_one_fiber(gap, order, dt):
    """Extrapolated forces of the other would be unstable above second order, whatever dt."""

    def shapes(curves, step, order):
        stepper = _stepper(len(curves), FixedSteps(step, order), mu_bar=1e5, nodes=20)
        return _run(stepper, curves, 5.0)

    two, iterations = shapes(_parallel(2, gap), dt, order)
    one, _ = shapes(_parallel(1, gap), dt, order)
    alone = float(np.abs(one - shapes(_parallel(1, gap), 0.04, 5)[0]).max())
    error = float(np.abs(two - shapes(_parallel(2, gap), 0.04, 5)[0]).max())
    assert error < 3.0 * alone < 0.03
    assert iterations <= 6


@pytest.mark.slow
def test_the_error_of_coupled_fibers_follows_the_tolerance():
    def shapes(rtol):
        tolerance = max(1e-2 * rtol, 1e-11)
        stepper = _stepper(3, AdaptiveSteps(rtol), mu_bar=5e4, tolerance=tolerance, nodes=36)
        return _run(stepper, _crossed(3), 3.0)[0]

    exact = shapes(1e-8)
    errors = {rtol: float(np.abs(shapes(rtol) - exact).max()) for rtol in (1e-2, 1e-3, 1e-5)}
    for rtol, error in errors.items():
        assert error < rtol
    assert errors[1e-2] > 1e-5
    assert errors[1e-2] > 100.0 * errors[1e-5]


@pytest.mark.parametrize(
    "domain",
    [pytest.param(Free(), marks=SLOW), Periodic((1.6, 0.0, 0.0))],
    ids=["free", "periodic"],
)
def test_the_papers_scheme_converges_to_it_at_second_order(domain):
    close, images = PaperCloseApproach(d0=2e-3, near=0.0), ImageSum(reach=20)
    curves, end, mu_bar = _crossed(2), 0.5, 2e3

    def paper(intervals):
        problem = sf.Problem(
            sf.Fiber(slenderness=1e-2, count=2),
            mu_bar=mu_bar,
            flow=sf.Shear(1.0),
            mobility=sf.NonLocal(sf.SpheroidalRegularization()),
            engine=sf.PaperEngine(intervals, dt=0.25 / intervals, beta=20.0),
            domain=domain,
            image_sum=images,
            close_approach=close,
            tension_solver=Krylov(1e-10),
        )
        stepper = PaperStepper(problem, 1)
        s = np.linspace(0.0, 1.0, intervals + 1)
        carry = stepper.init(np.stack([c(s) for c in curves]))
        for _ in range(round(end * intervals / 0.25)):
            carry, _ = stepper.step(carry)
        return carry.positions[:, :: intervals // 20].transpose(0, 2, 1)

    control = AdaptiveSteps(1e-7)
    options = {"domain": domain, "image_sum": images, "close_approach": close}
    exact, _ = _run(_stepper(2, control, mu_bar=mu_bar, **options), curves, end)
    alone, _ = _run(_stepper(1, control, mu_bar=mu_bar), curves[:1], end)
    errors = [float(np.abs(paper(n) - exact).max()) for n in (20, 40, 80)]
    assert_order(errors, between=(1.7, 2.4), final=2e-3)
    assert np.abs(exact[0] - alone[0]).max() > 5.0 * errors[-1], "the coupling shows"


@pytest.mark.slow
def test_differences_between_image_sums_shrink_with_the_period():
    def final(image_sum, period):
        stepper = _stepper(
            2,
            AdaptiveSteps(1e-6),
            mu_bar=2e3,
            domain=Periodic((period, 0.0, 0.0)),
            image_sum=image_sum,
            nodes=20,
        )
        return _run(stepper, _crossed(2), 0.5)[0]

    free = _run(_stepper(2, AdaptiveSteps(1e-6), mu_bar=2e3, nodes=20), _crossed(2), 0.5)[0]
    periods = (2.0, 4.0, 8.0)
    apart = [float(np.abs(final(ExactImages(), d) - free).max()) for d in periods]
    orders = [np.log2(a / b) for a, b in pairwise(apart)]
    assert orders[-1] > 1.5
    for d in periods[:2]:
        exact, moments = final(ExactImages(), d), final(ImageSum(about="centre_of_mass"), d)
        difference = float(np.abs(exact - moments).max())
        assert 1e-8 < difference < 0.2 * float(np.abs(exact - free).max())
