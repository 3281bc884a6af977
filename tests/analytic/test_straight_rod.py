"""The exact solution (44), (45) of a straight filament in shear, and Jeffery's (46)."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import legendre

import stokesfibers as sf
from reference.twins import graded_nodes
from stokesfibers.constraint.line_tension import solve_tension
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.mobility import slenderness_constant
from support import advance, assert_close, assert_negligible, assert_order

ANGLES = np.pi * np.array([0.05, 0.25, 0.4, 0.6, 0.75, 0.9936])
MOBILITIES = (
    sf.NonLocal(sf.PaperRegularization()),
    sf.NonLocal(sf.SpheroidalRegularization()),
    sf.NonLocal(sf.NoRegularization()),
    sf.LocalDrag(),
)


def rod(angle: float, intervals: int) -> np.ndarray:
    """Return a centred straight rod, (3, node)."""
    direction = np.array([np.cos(angle), np.sin(angle), 0.0])
    return np.outer(direction, np.linspace(-0.5, 0.5, intervals + 1))


def problem(
    mobility, intervals: int, *, rate: float = 1.0, eps: float = 1e-2, dt: float = 0.02
) -> sf.Problem:
    return sf.Problem(
        sf.Fiber(slenderness=eps),
        mu_bar=1e4,
        flow=sf.Shear(rate=rate),
        mobility=mobility,
        engine=sf.PaperEngine(intervals=intervals, dt=dt),
    )


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("intervals", [8, 15, 28])
def test_tension_44_is_exact_on_any_grid_without_regularisation(angle, intervals):
    """T is quadratic and K_0 of a linear T_s is linear: every approximation of 3.1 is exact."""
    case = problem(sf.NonLocal(sf.NoRegularization()), intervals, rate=2.0)
    _, carry = advance(case, rod(angle, intervals), 0)
    s = np.linspace(0.0, 1.0, intervals + 1)
    c = slenderness_constant(1e-2)
    expected = -1e4 / 8.0 * 2.0 * np.sin(2.0 * angle) / (c + 2.0) * s * (1.0 - s)
    assert_close(carry.tension[0], expected, rtol=1e-12)
    # Compression (T < 0) while the rod points into the second quadrant.
    assert np.sign(expected[intervals // 2]) == np.sign(np.sin(2.0 * angle))


def test_local_drag_tension_is_exact_on_any_grid():
    """Without K and without the 2 (I - ss): 2c T_ss = mu_bar sin(theta) cos(theta)."""
    _, carry = advance(problem(sf.LocalDrag(), 16), rod(0.75 * np.pi, 16), 0)
    s = np.linspace(0.0, 1.0, 17)
    expected = 1e4 * 0.5 / (4.0 * slenderness_constant(1e-2)) * s * (1.0 - s)
    assert_close(carry.tension[0], expected, rtol=1e-12)


def spectral_tension(regularization, eps: float, s: np.ndarray, count: int = 40) -> np.ndarray:
    """Return the tension of a regularised straight rod under unit stretching and unit drag.

    Collocation of the integrated equation (B.2), 2 (c T_s - S_delta[T_s]) = s - 1/2 + constant,
    at Gauss nodes with Legendre polynomials P_1 ... for T_s.
    """
    alpha, _ = legendre.leggauss(count)
    places, c = 0.5 * (alpha + 1.0), slenderness_constant(eps)
    matrix = np.full((count, count), -1.0)  # first unknown: the constant
    for row, (a, place) in enumerate(zip(alpha, places, strict=True)):
        delta = float(regularization.delta(np.array(place), eps))
        other, weight = graded_nodes(place, 0.25 * delta, 32)
        own = legendre.legvander(np.array([a]), count - 1)
        apart = legendre.legvander(2.0 * other - 1.0, count - 1) - own
        integral = (weight / np.hypot(other - place, delta)) @ apart
        matrix[row, 1:] = 2.0 * (c * own[0] - integral)[1:]
    series = np.linalg.solve(matrix, places - 0.5)
    series[0] = 0.0
    return legendre.legval(2.0 * s - 1.0, 0.5 * legendre.legint(series, lbnd=-1))


def discrete_tension(regularization, eps: float, intervals: int) -> np.ndarray:
    fiber = DiscreteFiber.build(
        1.0, eps, rigidity=1.0, intervals=intervals, mobility=sf.NonLocal(regularization)
    )
    stretching = np.ones(intervals + 1)
    return solve_tension(fiber, fiber.shape(rod(1.0, intervals)), stretching, drag=1.0, beta=20.0)


@pytest.mark.parametrize(
    ("regularization", "eps", "final"),
    [
        (sf.ConstantRegularization(), 4e-2, 2e-6),
        (sf.ConstantRegularization(), 1e-2, 1.6e-6),
        (sf.SpheroidalRegularization(), 4e-2, 8e-8),
    ],
)
def test_regularised_tension_approaches_a_spectral_solution(regularization, eps, final):
    s = np.linspace(0.0, 1.0, 26)
    exact = spectral_tension(regularization, eps, s)
    errors = [
        np.abs(discrete_tension(regularization, eps, n)[:: n // 25] - exact).max()
        / np.abs(exact).max()
        for n in (50, 100, 200)
    ]
    assert_order(errors, between=(1.8, 2.2), final=final)


def test_regularised_tension_of_thin_rods_approaches_44():
    """The difference is O(eps^2 log eps): 7.4e-3, 1.3e-3, 2.6e-4, 5.3e-5 for spheroidal delta."""
    s = np.linspace(0.0, 1.0, 26)
    for regularization, final in (
        (sf.SpheroidalRegularization(), 7e-5),
        (sf.PaperRegularization(), 1e-4),
    ):
        errors = []
        for eps in (4e-2, 2e-2, 1e-2, 5e-3):
            exact = -s * (1.0 - s) / (4.0 * (slenderness_constant(eps) + 2.0))
            found = discrete_tension(regularization, eps, 25)
            errors.append(np.abs(found - exact).max() / np.abs(exact).max())
        assert_order(errors, between=(2.0, 2.5), final=final)


@pytest.mark.parametrize("mobility", MOBILITIES, ids=lambda m: getattr(m, "kind", None))
def test_straight_rod_rotates_as_45_at_second_order(mobility):
    """cot(theta) = cot(theta_0) + t, whatever the model: the velocity across is the flow's."""
    angle, until = 0.75 * np.pi, 1.92
    exact_angle = np.pi / 2.0 - np.arctan(1.0 / np.tan(angle) + until)
    exact = np.array([np.cos(exact_angle), np.sin(exact_angle), 0.0])
    errors, lengths = [], []
    for dt in (0.032, 0.016, 0.008):
        case = problem(mobility, 12, dt=dt)
        _, carry = advance(case, rod(angle, 12), round(until / dt))
        x = carry.x[0]
        ends = x[:, -1] - x[:, 0]
        assert_negligible(x.mean(axis=1), scale=1.0, rtol=1e-6)
        assert_negligible(np.diff(x, 2), scale=1.0, rtol=1e-6)
        length = np.linalg.norm(ends)
        errors.append(np.linalg.norm(ends / length - exact))
        lengths.append(abs(length - 1.0))
    assert_order(errors, between=(1.9, 2.1), final=3e-5)
    assert_order(lengths, between=(1.7, 2.2), final=1.5e-6)


def test_angular_velocity_differs_from_jeffery_by_four_eps_squared():
    """(46) with 2 eps for eps (errata): the difference is 4 eps^2 cos(2 theta) / (1 + 4 eps^2)."""
    angle = 0.6
    across = np.array([-np.sin(angle), np.cos(angle), 0.0])
    differences = []
    for eps in (4e-2, 2e-2, 1e-2):
        _, carry = advance(problem(sf.NonLocal(), 20, eps=eps), rod(angle, 20), 0)
        velocity = carry.slow[0] / 1e4
        found = across @ (velocity[:, -1] - velocity[:, 0])
        assert found == pytest.approx(-(np.sin(angle) ** 2), rel=1e-12)
        jeffery = -(np.sin(angle) ** 2 + (2 * eps * np.cos(angle)) ** 2) / (1 + 4 * eps**2)
        differences.append(abs(found - jeffery))
        assert differences[-1] == pytest.approx(
            4 * eps**2 * np.cos(2 * angle) / (1 + 4 * eps**2), rel=1e-9
        )
    assert_order(differences, between=(1.99, 2.01), final=2e-4)


@pytest.mark.parametrize(("beta", "dt"), [(20.0, 1 / 30), (50.0, 1 / 75)])
def test_penalisation_limits_the_step_to_two_thirds_of_its_time(beta, dt):
    """|x_s|^2 - 1 relaxes at the rate 2 beta; extrapolated BDF2 needs 2 beta dt < 4/3."""

    def length_error(step: float) -> float:
        engine = sf.PaperEngine(intervals=16, dt=step, beta=beta)
        fiber = sf.Fiber(slenderness=1e-2)
        case = sf.Problem(fiber, mu_bar=1e4, flow=sf.Shear(), engine=engine)
        _, carry = advance(case, rod(0.8 * np.pi, 16), 80)
        return abs(np.linalg.norm(np.diff(carry.x[0]), axis=0).sum() - 1.0)

    assert length_error(0.97 * dt) < 5e-5
    assert length_error(1.08 * dt) > 1e-2


def test_straight_rod_in_oscillating_shear_follows_45():
    """cot(theta) = cot(theta_0) + int rate dt; after a period it is back where it began."""
    angle, rate, frequency = 0.7 * np.pi, 2.0, 0.5
    errors = []
    for dt in (0.02, 0.01, 0.005):
        flow = sf.OscillatoryShear(amplitude=rate, frequency=frequency)
        engine = sf.PaperEngine(intervals=10, dt=dt, beta=20.0)
        fiber = sf.Fiber(slenderness=1e-2)
        case = sf.Problem(fiber, mu_bar=1e4, flow=flow, engine=engine)
        found = []
        for steps in (round(1.0 / dt), round(2.0 / dt)):
            _, carry = advance(case, rod(angle, 10), steps)
            ends = carry.x[0, :, -1] - carry.x[0, :, 0]
            found.append(ends[0] / ends[1])
        strain = rate / (2.0 * np.pi * frequency) * 2.0  # of half a period
        expected = 1.0 / np.tan(angle) + np.array([strain, 0.0])
        errors.append(np.abs(np.array(found) - expected).max())
    assert_order(errors, between=(1.9, 2.1), final=2e-4)
