"""Doubtful choices: each doubt is raised where it should be and nowhere else."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.constraint.coupled import FixedPoint, Krylov
from stokesfibers.core.errors import InputError
from stokesfibers.fiber import curves
from stokesfibers.fiber.initial import NearlyStraight
from stokesfibers.fiber.parameters import Fiber
from stokesfibers.flow import (
    Extension,
    NoFlow,
    OscillatoryShear,
    PlanarExtension,
    Rotation,
    Shear,
    Uniform,
    UserFlow,
)
from stokesfibers.problem import checks, engine_checks
from stokesfibers.problem.checks import doubts
from stokesfibers.problem.doubt import Plan
from stokesfibers.problem.engine import PaperEngine, SpectralEngine
from stokesfibers.problem.groups import BUCKLING_THRESHOLD, compressive_rate, groups
from stokesfibers.problem.problem import Problem
from stokesfibers.run.schedule import every
from stokesfibers.run.simulate import nodal_positions, simulate
from stokesfibers.slender.mobility import LocalDrag, NonLocal
from stokesfibers.slender.regularization import (
    ConstantRegularization,
    NoRegularization,
    PaperRegularization,
    SpheroidalRegularization,
)
from support import assert_close

PAPERS_RUN = Problem(
    Fiber(slenderness=1e-3), mu_bar=3e5, flow=Shear(), engine=PaperEngine(100, 0.0128, 20.0)
)


def plan_of(problem: Problem, *, amplitude: float = -1e-4, **changes: float) -> Plan:
    shape = curves.nearly_straight(problem.fibers[0], amplitude=amplitude)
    times = {"until": 61.44, "positions_every": 0.256, "observables_every": 0.0256, **changes}
    return Plan(**times, positions=nodal_positions(shape, problem))


PLAN = plan_of(PAPERS_RUN)


def wheres(problem: Problem, **changes: float) -> set[str]:
    return {d.where for d in doubts(problem, plan_of(problem, **changes))}


def test_papers_run_is_not_doubtful():
    assert doubts(PAPERS_RUN, plan_of(PAPERS_RUN)) == ()


@pytest.mark.parametrize(("eps", "doubted"), [(0.05, False), (0.051, True)])
def test_thick_fibers(eps, doubted):
    problem = replace(PAPERS_RUN, fiber=Fiber(slenderness=eps))
    assert bool(list(checks.thick_fibers(problem))) is doubted


@pytest.mark.parametrize(
    ("angle", "said"), [(2.967, ""), (-6.28, ""), (170.0, "2.96706"), (-45.0, "-0.785")]
)
def test_angles_in_degrees(angle, said):
    for name in ("angle", "tilt"):
        plan = replace(PLAN, **{name: angle})
        found = [str(doubt) for doubt in checks.angle_in_degrees(plan)]
        assert bool(found) is bool(said)
        assert all(said in text and "radians" in text for text in found)
        assert all(text.startswith(f"initial.{name}") for text in found)


@pytest.mark.parametrize(("angle", "share"), [(1.3, ""), (-1.35, "0.22"), (1.6, "0.029")])
def test_a_bend_along_the_fiber(angle, share):
    """|cos 1.3| = 0.267 is let pass; the rest says what is left of the bend."""
    across = NearlyStraight(angle=angle).across
    found = [str(doubt) for doubt in checks.bend_along_the_fiber(replace(PLAN, across=across))]
    assert bool(found) is bool(share)
    assert all(f"{share} of the bend is across the fiber" in text for text in found)


def test_what_is_across_is_what_bends_the_fiber():
    """The curve leaves its chord by the share |cos(angle)| of d_y / 256, to first order."""
    fiber = Fiber(slenderness=1e-2)
    for angle, tilt in ((0.0, 0.0), (1.0, 0.0), (2.5, 0.0), (2.5, -1.1), (1.6, 0.5)):
        shape = NearlyStraight(angle=angle, tilt=tilt, amplitude=1e-3)
        (curve,) = shape.curves((fiber,), np.zeros(3))
        x = curve.at_fractions(np.linspace(0.0, 1.0, 201))
        chord = (x[-1] - x[0]) / np.linalg.norm(x[-1] - x[0])
        away = x - x[0] - np.outer((x - x[0]) @ chord, chord)
        expected = shape.across * 1e-3 / 256.0
        assert_close(np.linalg.norm(away, axis=1).max(), expected, rtol=1e-4)


def test_a_straight_fiber_has_no_bend_along_it():
    assert NearlyStraight(angle=1.6, amplitude=0.0).across == 1.0


@pytest.mark.parametrize("rate", [1.0, -4.0])
def test_large_step_goes_with_spacing_and_rate(rate):
    dt = 1.28 / (50 * abs(rate))
    for factor, doubted in ((1.0, False), (1.001, True)):
        problem = replace(PAPERS_RUN, flow=Shear(rate), engine=PaperEngine(50, factor * dt, 0.0))
        assert bool(list(engine_checks.large_step(problem))) is doubted


def test_no_rate_no_advice_on_the_step():
    problem = replace(PAPERS_RUN, flow=NoFlow(), engine=PaperEngine(50, 10.0, 0.0))
    assert list(engine_checks.large_step(problem)) == []


@pytest.mark.parametrize(("beta_dt", "doubted"), [(0.62, False), (0.72, True)])
def test_unstable_penalty_limit_is_the_schemes(beta_dt, doubted):
    """What is doubted indeed blows up, and what is not does not."""
    beta = 20.0
    problem = Problem(
        Fiber(slenderness=1e-2),
        mu_bar=1e3,
        flow=Shear(),
        engine=PaperEngine(8, beta_dt / beta, beta),
    )
    assert bool(list(engine_checks.unstable_penalty(problem))) is doubted
    shape = curves.nearly_straight(problem.fibers[0])
    result = simulate(problem, shape, until=25.0, record=every(10.0))
    assert result.status.code == ("failed" if doubted else "done")


@pytest.mark.parametrize(("intervals", "doubted"), [(56, True), (57, False)])
def test_few_intervals_on_the_buckling_wave(intervals, doubted):
    """At mu_bar = 4e5 the wave is 2 pi sqrt(32 |c| / (mu_bar / 2)) = 0.2845 long: 56.2 needed."""
    problem = replace(PAPERS_RUN, mu_bar=4e5, engine=PaperEngine(intervals))
    found = list(engine_checks.few_intervals(problem, plan_of(problem)))
    assert bool(found) is doubted
    if doubted:
        assert "Take 57 intervals or more" in found[0].remedy


def test_fiber_that_does_not_buckle_needs_no_intervals_for_it():
    problem = replace(PAPERS_RUN, mu_bar=3000.0, engine=PaperEngine(8))
    assert list(engine_checks.few_intervals(problem, plan_of(problem))) == []


@pytest.mark.parametrize(("intervals", "doubted"), [(20, False), (21, True)])
def test_intervals_below_the_radius(intervals, doubted):
    problem = replace(
        PAPERS_RUN, fiber=Fiber(radius=0.1, length=2.0), engine=PaperEngine(intervals)
    )
    assert bool(list(engine_checks.fine_grid(problem))) is doubted


@pytest.mark.parametrize(
    ("regularization", "intervals", "said"),
    [
        (PaperRegularization(), 50, None),
        (PaperRegularization(), 85, "close to losing its sign"),
        (PaperRegularization(), 100, "has lost its positive sign"),
        (ConstantRegularization(), 200, None),
        (SpheroidalRegularization(), 200, None),
        (NoRegularization(), 50, "has lost its positive sign"),
    ],
)
def test_resolution_limit_of_the_regularisations(regularization, intervals, said):
    problem = replace(
        PAPERS_RUN,
        fiber=Fiber(slenderness=1e-2),
        mobility=NonLocal(regularization),
        engine=PaperEngine(intervals),
    )
    found = list(engine_checks.lost_positivity(problem))
    if said is None:
        assert found == []
    else:
        (doubt,) = found
        assert said in doubt.what


def test_local_drag_has_no_resolution_limit():
    problem = replace(PAPERS_RUN, fiber=Fiber(slenderness=1e-2), mobility=LocalDrag())
    assert list(engine_checks.lost_positivity(problem)) == []


@pytest.mark.parametrize(("amplitude", "doubted"), [(0.0, False), (-1e-4, True)])
def test_no_regularisation_is_for_straight_fibers(amplitude, doubted):
    problem = replace(PAPERS_RUN, mobility=NonLocal(NoRegularization()))
    plan = plan_of(problem, amplitude=amplitude)
    assert bool(list(checks.bent_without_regularization(problem, plan))) is doubted
    regular = replace(PAPERS_RUN)
    assert list(checks.bent_without_regularization(regular, plan)) == []


def test_end_that_the_step_does_not_divide():
    (doubt,) = engine_checks.undivided_end(PAPERS_RUN, plan_of(PAPERS_RUN, until=1.0))
    assert "t = 1.0112" in doubt.remedy  # 79 steps of 0.0128
    assert list(engine_checks.undivided_end(PAPERS_RUN, plan_of(PAPERS_RUN))) == []


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"positions_every": 0.01}, {"record.positions_every"}),
        ({"observables_every": 0.0127}, {"record.observables_every"}),
        ({"positions_every": 100.0}, {"record.positions_every"}),
        ({"observables_every": 0.0128}, set()),
        ({"positions_every": 61.44}, set()),
    ],
)
def test_recording_intervals(changes, where):
    assert wheres(PAPERS_RUN, **changes) == where


def test_memory_of_this_machine(monkeypatch):
    problem = replace(PAPERS_RUN, engine=PaperEngine(1999))
    assert checks.memory_bytes(problem) == 400 * 2000**2
    for have, doubted in ((None, False), (2**32, False), (2**30, True)):
        monkeypatch.setattr(checks, "_physical_memory", lambda have=have: have)
        assert bool(list(checks.large_memory(problem))) is doubted


def test_doubt_reads_as_one_line_with_numbers_and_remedy():
    problem = replace(PAPERS_RUN, engine=PaperEngine(100, 0.025, 20.0))
    (doubt,) = engine_checks.large_step(problem)
    assert str(doubt) == (
        "stepping.dt: a step larger than in the paper's runs, which may be unstable "
        "(dt = 0.025, 1.28 / (intervals x rate) = 0.0128). Take dt = 0.0128 or less."
    )


@pytest.mark.parametrize(
    ("flow", "rate"),
    [
        (Shear(-3.0), 1.5),
        (PlanarExtension(2.0), 2.0),
        (Extension(2.0), 1.0),
        (Extension(-2.0), 2.0),
        (Rotation((0.0, 0.0, 5.0)), 0.0),
        (Uniform(), 0.0),
        (NoFlow(), 0.0),
        (UserFlow(lambda x, _t: x * [-3.0, 1.0, 2.0]), 3.0),
    ],
    ids=lambda value: getattr(value, "kind", str(value)),
)
def test_compressive_rate(flow, rate):
    assert compressive_rate(flow, 10.0) == pytest.approx(rate, abs=1e-6)


def test_compressive_rate_finds_the_peak_of_an_oscillation():
    # A period of 0.1 in a run of 10: equally spaced times would meet its zeros only.
    flow = OscillatoryShear(4.0, frequency=10.0)
    assert compressive_rate(flow, 10.0) == pytest.approx(2.0, rel=1e-2)


def test_compressive_rate_of_a_flow_that_fails_at_the_origin():
    def vortex(x, _t):
        if (np.abs(x).max(axis=1) < 1e-3).any():
            raise ValueError("singular")
        return x

    flow = UserFlow(vortex)
    assert compressive_rate(flow, 1.0) == pytest.approx(0.5 * flow.rate_scale(), rel=1e-12)


def test_groups_do_not_depend_on_units():
    """The same fiber in metres, seconds and newtons, and in units of its own."""
    length, rigidity, rate = 2e-5, 7e-26, 0.01
    viscosity = 3e5 * rigidity / (8.0 * pi * rate * length**4)
    physical = replace(
        PAPERS_RUN,
        fiber=Fiber(length=length, radius=1e-3 * length, rigidity=rigidity),
        mu_bar=None,
        viscosity=viscosity,
        flow=Shear(rate),
    )
    ours = groups(PAPERS_RUN, PAPERS_RUN.fibers[0], 61.44)
    theirs = groups(physical, physical.fibers[0], 6144.0)
    for name in ("eps", "c", "mu_bar", "eta", "compression", "wavelength"):
        assert getattr(theirs, name) == pytest.approx(getattr(ours, name), rel=1e-12)
    c = np.log(1e-6) + 1.0
    assert ours.mu_bar == 3e5
    assert ours.eta == pytest.approx(-3e5 / c, rel=1e-14)
    assert ours.compression == pytest.approx(-1.5e5 / c / BUCKLING_THRESHOLD, rel=1e-14)
    assert ours.wavelength == pytest.approx(2.0 * pi * sqrt(32.0 * -c / 1.5e5), rel=1e-14)


def test_everything_doubtful_is_found_at_once():
    problem = Problem(
        Fiber(slenderness=0.1),
        mu_bar=1e6,
        flow=Shear(),
        mobility=NonLocal(NoRegularization()),
        engine=PaperEngine(20, 0.1, 20.0),
    )
    found = doubts(problem, plan_of(problem, until=1.05, positions_every=2.0))
    assert len(found) == 10
    with pytest.raises(InputError):
        Fiber(slenderness=0.3)


def test_memory_of_a_suspension_grows_with_the_square_of_all_nodes():
    def need(count):
        fiber = sf.Fiber(slenderness=1e-2, count=count)
        problem = sf.Problem(fiber, mu_bar=1.0, flow=Shear(1.0), engine=sf.PaperEngine(102))
        return checks.memory_bytes(problem)

    assert need(300) > 8 * (300 * 101) ** 2
    assert 3.5 < need(300) / need(150) < 4.0


def test_the_high_order_engine_needs_memory_in_proportion_to_the_fibers() -> None:
    def need(count: int) -> int:
        engine = SpectralEngine(nodes=24, rtol=1e-3)
        many = Problem(Fiber(slenderness=1e-2, count=count), mu_bar=1e4, engine=engine)
        return checks.memory_bytes(many)

    assert need(10_000) == 10 * need(1000)
    assert 1e8 < need(1000) < 1e9  # a step of 1,000 fibers was seen to take 0.13 GiB more than one


def test_the_spectral_engine_has_no_other_tension_solver():
    for engine, doubted in ((PAPERS_RUN.engine, False), (sf.SpectralEngine(), True)):
        for solver in (FixedPoint(), FixedPoint(most=50), Krylov()):
            problem = replace(PAPERS_RUN, engine=engine, tension_solver=solver)
            found = list(engine_checks.tension_solver_without_effect(problem))
            assert bool(found) is (doubted and solver != FixedPoint())
            assert set(found) <= set(checks.doubts(problem, PLAN))


@pytest.mark.parametrize(
    ("changes", "doubted"),
    [
        ({}, False),
        ({"fiber": Fiber(slenderness=1e-3, rigidity=25.0)}, True),
        (
            {"fiber": Fiber(slenderness=1e-3, rigidity=25.0), "mu_bar": None, "viscosity": 1.0},
            False,
        ),
        (
            {
                "fiber": (
                    Fiber(slenderness=1e-3, rigidity=25.0),
                    Fiber(slenderness=1e-3, rigidity=2.0),
                )
            },
            False,
        ),
        ({"fiber": Fiber(slenderness=1e-3, rigidity=25.0), "load": sf.Gravity((0, -1, 0))}, False),
    ],
)
def test_rigidity_beside_mu_bar_has_no_effect(changes, doubted):
    problem = replace(PAPERS_RUN, **changes)
    found = [str(doubt) for doubt in checks.rigidity_without_effect(problem)]
    assert bool(found) is doubted
    assert all("25 for all fibers" in text for text in found)
