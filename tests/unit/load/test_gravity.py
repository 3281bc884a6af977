"""Weight: its density, what it adds to the stress, both engines, and where it is refused."""

from __future__ import annotations

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.core.errors import InputError
from stokesfibers.domain import Free, Periodic
from stokesfibers.load import Gravity, LoadedState, StericRepulsion
from stokesfibers.observe.observables import extra_stress
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.problem.tables import problem_from_tables, problem_to_tables
from stokesfibers.run.moment import snapshot
from stokesfibers.slender.regularization import SpheroidalRegularization
from stokesfibers.stepping.paper import PaperStepper
from stokesfibers.stepping.spectral_run import SpectralRunStepper
from stokesfibers.summation.images import TruncatedSum
from support import advance, assert_close, assert_negligible, free_end_curve

FORCE = (3.0, -20.0, 5.0)
FIBER = sf.Fiber(length=1.0, slenderness=1e-2)
SPECTRAL = SpectralEngine(nodes=32, rtol=1e-7)
SPHEROIDAL = sf.NonLocal(SpheroidalRegularization())


def _problem(engine=SPECTRAL, **options):
    return sf.Problem(FIBER, mu_bar=50.0, load=Gravity(FORCE), engine=engine, **options)


def test_density_is_the_force_at_every_node():
    x = free_end_curve().nodes(20).T
    state = LoadedState(np.stack([x, x + 1.0]), np.full((2, 21), 0.05), np.full(2, 0.01), Free())
    density = Gravity(list(FORCE)).density(state)
    assert density.shape == (2, 21, 3)
    assert (density == np.array(FORCE)).all()
    density[0, 0] = 0.0  # its own memory
    assert Gravity(FORCE).density(state).all()


def _released(shift=(0.0, 0.0, 0.0)):
    """Return a stepper and its carry when a bent fiber is released."""
    points = free_end_curve()(np.linspace(0.0, 1.0, 401)).T + np.array(shift)
    stepper = SpectralRunStepper(_problem(), threads=1)
    return stepper, stepper.start((sf.shapes.through_points(points),))


def test_stress_is_that_of_all_forces_about_the_centre():
    stepper, carry = _released()
    fiber = stepper._discretised(32).stepper.fibers[0]
    z, w = np.polynomial.legendre.leggauss(80)
    s, w = 0.5 + 0.5 * z, 0.5 * w
    x = fiber.position(carry.modes[0, 0], s)
    force = fiber.force(carry.modes[0, 0], carry.tensions[0, 0], s) - np.array(FORCE)[:, None]
    assert_close(force @ w, -np.array(FORCE), rtol=1e-9)
    expected = np.einsum("n,in,jn->ij", w, force, x - (x @ w)[:, None])
    found = extra_stress(snapshot(stepper, carry, 0.0))
    assert_close(found, expected, rtol=1e-9)
    assert_negligible(found - found.T, scale=float(np.abs(found).max()), rtol=1e-9)
    about_origin = np.einsum("n,in,jn->ij", w, force, x)
    assert np.abs(about_origin - expected).max() > 0.1 * np.abs(expected).max()


def test_stress_does_not_know_the_origin():
    here, there = (
        snapshot(*_released(shift), 0.0) for shift in ((0.0, 0.0, 0.0), (9.0, -7.0, 5.0))
    )
    assert_close(extra_stress(there), extra_stress(here), rtol=1e-8)


@pytest.mark.parametrize("mobility", [sf.LocalDrag(), SPHEROIDAL])
def test_both_engines_agree_on_a_bent_fiber_that_falls(mobility):
    """The spectral engine has no tension equation, so the weight's part of it is checked too."""
    until, errors = 0.02, []
    exact = sf.simulate(
        _problem(mobility=mobility),
        free_end_curve()(np.linspace(0.0, 1.0, 401)).T,
        until=until,
        record=sf.every(until, points=11),
    ).data["trajectory"]["position"]
    for n in (40, 80):
        engine = sf.PaperEngine(intervals=n, dt=0.01 / n, beta=20.0)
        problem = _problem(engine, mobility=mobility)
        _, carry = advance(problem, free_end_curve().nodes(n), 2 * n)
        x = carry.positions[0, :: n // 10]
        errors.append(np.abs(x - exact[-1, 0].to_numpy()).max())
    fallen = np.abs(exact[-1, 0] - exact[0, 0]).max()
    assert fallen > 0.05
    assert errors[1] < 2e-3
    assert errors[1] < 0.4 * errors[0]


def test_a_fiber_far_from_another_falls_as_if_alone():
    """One fiber in free space takes its own path through the paper's scheme."""
    engine = sf.PaperEngine(intervals=30, dt=1e-4, beta=20.0)
    x = free_end_curve().nodes(30).T
    _, alone = advance(_problem(engine), x.T, 3)
    two = sf.Problem((FIBER, FIBER), mu_bar=50.0, load=Gravity(FORCE), engine=engine)
    stepper = PaperStepper(two, threads=1)
    carry = stepper.init(np.stack([x, x + np.array([0.0, 0.0, 1e7])]))
    for _ in range(3):
        carry, _ = stepper.step(carry)
    # The other's flow moves it by about L / distance of its own fall, the tension solver by 1e-6.
    moved = carry.positions[0] - x
    assert_close(moved, alone.positions[0] - x, rtol=1e-5)
    assert_close(carry.tension[0], alone.tension[0], rtol=1e-5)


def test_tables_of_a_case():
    tables = problem_to_tables(_problem())
    assert tables["load"] == {"kind": "gravity", "force": list(FORCE)}
    assert problem_from_tables(tables).load == Gravity(FORCE)
    tables["load"] = {"kind": "gravity"}
    with pytest.raises(InputError, match=r"load\.force"):
        problem_from_tables(tables)


@pytest.mark.parametrize("bad", [(0.0, 1.0), (0.0, np.nan, 1.0), 1.0, ("a", 0, 0)])
def test_bad_forces_are_refused(bad):
    with pytest.raises(InputError, match="force"):
        Gravity(bad)


@pytest.mark.parametrize(
    ("periods", "why"),
    [((2.0, 0.0, 0.0), "unbounded"), ((2.0, 2.0, 0.0), "Ewald"), ((2.0, 2.0, 2.0), "Ewald")],
)
def test_periodic_space_is_refused(periods, why):
    engine = sf.PaperEngine(intervals=20, dt=0.01, beta=20.0)
    options = {"domain": Periodic(periods), "image_sum": TruncatedSum(), "mu_bar": 50.0}
    with pytest.raises(InputError, match=why) as caught:
        sf.Problem(FIBER, engine=engine, load=Gravity(FORCE), **options)
    assert caught.value.where == "load"
    steric = StericRepulsion(strength=1.0, range=0.1)
    sf.Problem(FIBER, engine=engine, load=steric, **options)
