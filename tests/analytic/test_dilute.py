"""The stress of a dilute suspension: the sum of the fibers' own, and what they do to one another.

Fibers of size L whose middles are a multiple R of L apart stir each other as force dipoles do.
With Sigma the stress (48) of a fiber, the fluid around it gets -f and so the dipole -Sigma:

    u_i(r) = Sigma_jk dG_ij/dx_k,   G_ij = (delta_ij / r + r_i r_j / r^3) / (8 pi mu),

whose gradient at the next fiber, ~ 1 / R^3, adds to the flow's and changes that fiber's stress.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.constraint.coupled import FixedPoint
from stokesfibers.core.arrays import Array
from stokesfibers.domain import Free, Periodic
from stokesfibers.observe import observables
from stokesfibers.run.moment import snapshot
from stokesfibers.stepping.paper import PaperStepper
from support import free_end_curve

INTERVALS = 24
GRADIENT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
DISTANCES = np.array([4.0, 8.0, 16.0, 32.0])
MIDDLES = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, -0.1], [0.3, 1.1, 0.2], [-0.2, 0.4, 1.0]])
"""Times R. Different directions, so that no symmetry helps."""
REACH = 20
"""The last image on either side that a run with one period counts."""


def _shapes() -> Array:
    """Bent fibers with free ends about 0, each turned at random, (fiber, node, 3)."""
    random = np.random.default_rng(11)
    curve = free_end_curve()(np.linspace(0.0, 1.0, INTERVALS + 1)).T
    curve = curve - curve.mean(axis=0)
    turned = []
    for _ in MIDDLES:
        rotation, _ = np.linalg.qr(random.normal(size=(3, 3)))
        turned.append(curve @ (rotation * np.sign(np.linalg.det(rotation))).T)
    return np.array(turned)


def _problem(count: int, gradient: Array = GRADIENT) -> sf.Problem:
    flow = sf.UserFlow(
        lambda x, _: x @ gradient.T, lambda x, _: np.broadcast_to(gradient, (len(x), 3, 3))
    )
    return sf.Problem(
        sf.Fiber(slenderness=1e-2, count=count),
        mu_bar=2e3,
        flow=flow,
        mobility=sf.NonLocal(sf.SpheroidalRegularization()),
        tension_solver=FixedPoint(tolerance=1e-13),
        engine=sf.PaperEngine(INTERVALS, dt=0.01, beta=20.0),
    )


def _stress(problem: sf.Problem, positions: Array) -> Array:
    """Return the extra stress of fibers at `positions` at time 0, (3, 3)."""
    stepper = PaperStepper(problem, 1)
    return observables.extra_stress(snapshot(stepper, stepper.init(positions)))


def _domain(kind: str, distance: float) -> Free | Periodic:
    return Free() if kind == "free" else Periodic((2.5 * distance, 0.0, 0.0))


def _added_stress(kind: str, distance: float, shapes: Array) -> Array:
    """Return the stress of the suspension minus the sum of each fiber's alone, (3, 3)."""
    problem = replace(_problem(len(shapes)), domain=_domain(kind, distance))
    together = _stress(problem, shapes + distance * MIDDLES[:, None, :])
    return together - sum(_stress(_problem(1), shape[None]) for shape in shapes)


def _dipole_gradient(r: Array, stress: Array, drag: float) -> Array:
    """Return du_i/dx_l of the velocity above at `r` from the fiber, (3, 3), by differences."""
    step = 1e-4 * float(np.linalg.norm(r))

    def velocity(at: Array) -> Array:
        # dG_ij/dx_k Sigma_jk for symmetric Sigma: only tr(Sigma) and r.Sigma.r are left
        size = np.linalg.norm(at)
        return at * (np.trace(stress) / size**3 - 3.0 * (at @ stress @ at) / size**5) / drag

    columns = [(velocity(r + step * e) - velocity(r - step * e)) / (2.0 * step) for e in np.eye(3)]
    return np.stack(columns, axis=1)


def _predicted(kind: str, distance: float, shapes: Array) -> Array:
    """Return the sum of the changes of each fiber's stress in the gradients of the others."""
    drag = _problem(1).drag
    own = [_stress(_problem(1), shape[None]) for shape in shapes]
    period = _domain(kind, distance).lengths
    images = range(-REACH, REACH + 1) if period.any() else (0,)
    total = np.zeros((3, 3))
    for k, shape in enumerate(shapes):
        gradient = GRADIENT.copy()
        for m, p in product(range(len(shapes)), images):
            r = distance * (MIDDLES[k] - MIDDLES[m]) - p * period
            if np.any(r != 0.0):
                gradient += _dipole_gradient(r, own[m], drag)
        total += _stress(_problem(1, gradient), shape[None]) - own[k]
    return total


@pytest.mark.parametrize("kind", ["free", "one period"])
def test_stress_of_a_dilute_suspension_is_the_sum_of_its_fibers(kind):
    shapes = _shapes()
    sizes = np.array([np.linalg.norm(_added_stress(kind, d, shapes)) for d in DISTANCES])
    sizes /= np.linalg.norm(sum(_stress(_problem(1), shape[None]) for shape in shapes))
    slope = np.polyfit(np.log(DISTANCES), np.log(sizes), 1)[0]
    assert -3.2 < slope < -2.8, sizes
    assert 8e-8 < sizes[-1] < 1.6e-7, sizes


@pytest.mark.parametrize("kind", ["free", "one period"])
def test_first_correction_is_that_of_force_dipoles(kind):
    """Its sign and size, which a slope does not see; the rest is smaller by 1 / R."""
    shapes = _shapes()
    errors = []
    for distance in DISTANCES[1:3]:
        expected = _predicted(kind, distance, shapes)
        found = _added_stress(kind, distance, shapes)
        errors.append(np.linalg.norm(found - expected) / np.linalg.norm(expected))
    assert errors[0] < 0.1, errors
    assert errors[1] < 0.6 * errors[0], errors
