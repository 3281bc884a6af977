"""Groups of suspensions and of weight, and what `check` says of them."""

from __future__ import annotations

from math import inf, pi

import pytest

import stokesfibers as sf
from stokesfibers.domain import Periodic
from stokesfibers.load import Gravity
from stokesfibers.problem.checks import crowded_cell
from stokesfibers.problem.groups import crowding, weight


def _suspension(count: int, side: float, eps: float = 0.01) -> sf.Problem:
    long = sf.Fiber(length=2.0, slenderness=eps, count=1)
    short = sf.Fiber(length=1.0, slenderness=eps, count=count - 1)
    return sf.Problem(
        (long, short), mu_bar=1e3, flow=sf.Shear(1.0), domain=sf.Sheared((side, side, side))
    )


def test_a_cell_is_as_full_as_its_fibers_are_long_and_thick():
    """One fiber of length 2 and seven of length 1 in a cell of volume 27: sum L^3 = 15."""
    found = crowding(_suspension(8, 3.0))
    assert found is not None
    assert found.concentration == pytest.approx(15.0 / 27.0)
    assert found.contacts == pytest.approx(0.02 * 15.0 / 27.0)
    # a spheroid of length L and radius a has the volume 2/3 pi a^2 L
    volumes = 2.0 / 3.0 * pi * (0.02**2 * 2.0 + 7.0 * 0.01**2 * 1.0)
    assert found.volume_fraction == pytest.approx(volumes / 27.0)


@pytest.mark.parametrize("domain", [sf.Free(), Periodic((4.0, 0.0, 0.0))])
def test_without_a_volume_nothing_is_said(domain):
    problem = sf.Problem(sf.Fiber(slenderness=1e-2), mu_bar=1e3, flow=sf.Shear(1.0), domain=domain)
    assert problem.domain.volume == inf
    assert crowding(problem) is None
    assert not list(crowded_cell(problem))


def test_a_cell_in_which_rods_touch_is_doubtful():
    """n L^2 d = 0.02 x 62 / 1.2 ... from 1 on."""
    assert not list(crowded_cell(_suspension(40, 2.0, eps=0.05)))
    (doubt,) = crowded_cell(_suspension(90, 2.0, eps=0.05))
    assert doubt.where == "domain.periods"
    assert "1.21" in doubt.compared


def test_weight_is_held_against_rigidity():
    fiber = sf.Fiber(length=2.0, slenderness=1e-2, rigidity=4.0)
    falling = sf.Problem(fiber, viscosity=1.0, load=Gravity((0.0, -30.0, 40.0)))
    assert weight(falling, fiber) == pytest.approx(50.0 * 8.0 / 4.0)
    assert weight(sf.Problem(fiber, viscosity=1.0, flow=sf.Shear(1.0)), fiber) is None
