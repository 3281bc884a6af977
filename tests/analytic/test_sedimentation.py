"""A straight fiber falls as slender theory and the exact spheroid say; a soft one bends (case B1).

A uniform weight W pulls a straight fiber with 8 pi mu V = [(2 - c) I - (2 + c) t t] W / L: the
finite part of a uniform force vanishes with every delta(s), so the answer is exact in the model.
"""

from __future__ import annotations

from math import log, pi

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.experiments.settling import cross_section, settled, slightly_bent, uniform
from stokesfibers.load import Gravity
from stokesfibers.problem.engine import SpectralEngine
from stokesfibers.slender.mobility import slenderness_constant
from stokesfibers.slender.regularization import PaperRegularization, SpheroidalRegularization
from support import assert_close, assert_negligible

LENGTH, RIGIDITY, VISCOSITY = 2.5, 3.0, 0.7
WEIGHT = np.array([0.3, -2.0, 0.5])  # per length
ENGINES = {
    "paper": sf.PaperEngine(intervals=24, dt=0.02, beta=20.0),
    "spectral": SpectralEngine(rtol=1e-6),
}
NON_LOCAL = sf.NonLocal(SpheroidalRegularization())


def fall(engine, mobility, angle, eps=1e-2):
    """Return what a straight fiber has moved at its points in the time 1, (point, 3)."""
    fiber = sf.Fiber(length=LENGTH, slenderness=eps, rigidity=RIGIDITY)
    problem = sf.Problem(
        fiber,
        viscosity=VISCOSITY,
        mobility=mobility,
        load=Gravity(tuple(WEIGHT)),
        engine=ENGINES[engine],
    )
    curve = sf.shapes.straight(fiber, angle=angle, centre=(0.4, -0.2, 0.1))
    result = sf.simulate(problem, curve, until=1.0, record=sf.every(1.0, points=9), threads=1)
    assert result.status.code == "done"
    x = result.data["trajectory"]["position"].to_numpy()[:, 0]
    return x[-1] - x[0]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    "mobility", [sf.LocalDrag(), NON_LOCAL, sf.NonLocal(PaperRegularization())], ids=repr
)
@pytest.mark.parametrize("angle", [0.0, 0.5 * pi, 2.2])
def test_straight_fiber_falls_with_the_drag_of_slender_theory(engine, mobility, angle):
    tangent = np.array([np.cos(angle), np.sin(angle), 0.0])
    c = slenderness_constant(1e-2)
    across, along = (-c, -2.0 * c) if isinstance(mobility, sf.LocalDrag) else (2.0 - c, -2.0 * c)
    pulled = tangent * (tangent @ WEIGHT)
    expected = (across * (WEIGHT - pulled) + along * pulled) / (8.0 * pi * VISCOSITY)
    moved = fall(engine, mobility, angle)
    assert_close(moved, np.broadcast_to(expected, moved.shape), rtol=1e-6)
    sideways = np.linalg.norm(expected - WEIGHT * (expected @ WEIGHT) / (WEIGHT @ WEIGHT))
    assert sideways > 0.03 * np.linalg.norm(expected), "an oblique fiber drifts"


def spheroid_mobility(aspect: float) -> tuple[float, float]:
    """Return 8 pi mu L V / W along and across the axis of a prolate spheroid, exactly."""
    e = (1.0 - aspect**-2.0) ** 0.5
    q = log((1.0 + e) / (1.0 - e))
    along = 8.0 / 3.0 * e**3 / (-2.0 * e + (1.0 + e**2) * q)
    across = 16.0 / 3.0 * e**3 / (2.0 * e + (3.0 * e**2 - 1.0) * q)
    # F = 6 pi mu (L / 2) X V
    return 8.0 / (3.0 * along), 8.0 / (3.0 * across)


@pytest.mark.parametrize(("aspect", "error"), [(10.0, 9.1e-3), (100.0, 9.5e-5), (1000.0, 9.6e-7)])
def test_exact_spheroid(aspect, error):
    """The slender answer errs by eps^2 log eps; listed errors are of the drag along the axis."""
    along, across = spheroid_mobility(aspect)
    if aspect == 10.0:  # F / (mu U b) as listed, b = L / (2 aspect)
        factor = 8.0 * pi * 2.0 * aspect
        assert (factor / along, factor / across) == pytest.approx((49.897338, 71.845619), abs=1e-6)
    falls = {}
    for name, angle in (("along", 0.5 * pi), ("across", 0.0)):
        moved = fall("spectral", NON_LOCAL, angle, eps=0.5 / aspect)
        falls[name] = moved[4, 1] / WEIGHT[1] * 8.0 * pi * VISCOSITY
    assert along / falls["along"] - 1.0 == pytest.approx(error, rel=0.05, abs=2e-8)
    assert abs(across / falls["across"] - 1.0) < 0.1 * error


def test_a_straight_fiber_has_no_tension_under_a_uniform_weight():
    fiber = sf.Fiber(slenderness=1e-2)
    problem = sf.Problem(
        fiber, mu_bar=10.0, load=Gravity((0.0, -50.0, 0.0)), engine=ENGINES["spectral"]
    )
    curve = sf.shapes.straight(fiber, angle=1.0)
    data = sf.simulate(problem, curve, until=0.1, record=sf.every(0.1), threads=1).data
    assert_negligible(data["trajectory"]["tension"].to_numpy(), scale=50.0, rtol=1e-8)
    assert_negligible(data["observables"]["extra_stress"].to_numpy(), scale=50.0, rtol=1e-8)


@pytest.mark.parametrize("mobility", [sf.LocalDrag(), NON_LOCAL], ids=repr)
def test_weak_bending_is_the_same_in_every_model(mobility):
    """y_ssss = B P_2: sag 11 B / 3840, largest curvature B / 32; corrections are of order B^3."""
    found = settled(1.0, mobility, 1e-2)
    assert found.sag == pytest.approx(11.0 / 3840.0, rel=2e-5)
    assert found.curvature == pytest.approx(1.0 / 32.0, rel=4e-5)
    assert found.velocity == pytest.approx(1.0, abs=5e-5)


def test_force_balance_of_a_hairpin_with_local_drag():
    """In a steady fall the total drag of the shape, summed by hand, carries the weight."""
    found = settled(300.0, sf.LocalDrag(), 1e-2)
    tangent = np.gradient(found.shape, 1.0 / 200.0, axis=1, edge_order=2)
    # drag per length along the fall over that across: 1 - t_y^2 / 2
    drag = 1.0 - 0.5 * tangent[1] ** 2
    carried = found.velocity * np.trapezoid(drag, dx=1.0 / 200.0)
    assert carried == pytest.approx(1.0, abs=2e-4)
    assert found.velocity > 1.4


def test_a_tilted_fiber_turns_across_the_force_if_it_bends():
    bent = settled(100.0, NON_LOCAL, 1e-2, start=slightly_bent(1.2))
    level = settled(100.0, NON_LOCAL, 1e-2)
    assert abs(bent.angle) < 1e-4
    assert_close(bent.shape, level.shape, atol=1e-4)
    straight = settled(100.0, NON_LOCAL, 1e-2, weight=uniform, start=slightly_bent(1.2))
    assert straight.angle > 0.5
    assert straight.span == pytest.approx(1.0, abs=1e-6)


def test_weights_have_the_mean_one():
    z, w = np.polynomial.legendre.leggauss(8)
    sigma = 0.5 + 0.5 * z
    for weight in (uniform, cross_section):
        assert 0.5 * w @ weight(sigma) == pytest.approx(1.0, rel=1e-14)
