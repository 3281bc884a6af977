"""What fibers add to the viscosity: a straight rod by hand, and where it is recorded."""

from __future__ import annotations

from math import e, log, pi

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.domain import Periodic
from stokesfibers.summation.images import TruncatedSum
from support import assert_close

EPS = 1e-2


def _run(flow, domain=None, length=1.0, count=1):
    options = {} if domain is None else {"domain": domain, "image_sum": TruncatedSum()}
    problem = sf.Problem(
        sf.Fiber(length=length, slenderness=EPS, count=count),
        viscosity=0.7,
        flow=flow,
        mobility=sf.LocalDrag(),
        engine=sf.PaperEngine(intervals=40, dt=1e-3, beta=1.0),
        **options,
    )
    rod = np.linspace(0.0, length / np.sqrt(2.0), 41)[:, None] * np.array([1.0, 1.0, 0.0])
    start = np.stack([rod + k * np.array([0.0, 0.0, 2.0]) for k in range(count)])
    result = sf.simulate(problem, start, until=1e-3, record=sf.every(1e-3), threads=1)
    return result.data["observables"].to_dataset().isel(time=0)


@pytest.mark.parametrize("rate", [2.0, -0.5])
@pytest.mark.parametrize("length", [1.0, 3.0])
def test_a_rod_with_local_drag_at_45_degrees(rate, length):
    # T = 8 pi mu rate p_1 p_2 s (L - s) / (4 |c|), so Sigma_12 = (p_1 p_2)^2 pi mu rate L^3 / 3|c|
    expected = 0.25 * pi / (3.0 * abs(log(EPS**2 * e)))
    found = _run(sf.Shear(rate), length=length)
    assert_close(found["intrinsic_viscosity"].to_numpy(), expected, rtol=2.0 / 40**2)
    assert "specific_viscosity" not in found


def test_a_cell_gives_the_contribution_to_the_relative_viscosity():
    found = _run(sf.Shear(2.0), Periodic((4.0, 5.0, 6.0)), length=2.0, count=2)
    assert_close(
        found["specific_viscosity"].to_numpy(),
        found["intrinsic_viscosity"].to_numpy() * 2 * 2.0**3 / 120.0,
        rtol=1e-14,
    )
    stress = found["particle_stress"].to_numpy()[0, 1]
    assert_close(found["specific_viscosity"].to_numpy(), stress / (0.7 * 2.0), rtol=1e-14)


@pytest.mark.parametrize("flow", [sf.OscillatoryShear(frequency=1.0), sf.Extension(1.0)])
def test_without_a_steady_shear_there_is_no_viscosity(flow):
    found = _run(flow)
    assert "intrinsic_viscosity" not in found
    assert "specific_viscosity" not in found


def test_a_shear_that_stands_still_has_no_viscosity():
    assert "intrinsic_viscosity" not in _run(sf.Shear(0.0))
