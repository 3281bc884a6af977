"""Observables of straight fibers and arcs that can be written down by hand."""

from __future__ import annotations

import numpy as np
import pytest

from stokesfibers.domain import Free, Periodic, Sheared
from stokesfibers.load import StericRepulsion
from stokesfibers.observe import observables
from stokesfibers.observe.snapshot import Snapshot, Surroundings
from stokesfibers.slender.discrete import DiscreteFiber
from stokesfibers.slender.mobility import LocalDrag
from support import assert_close

FIBER = DiscreteFiber.build(2.0, 1e-2, rigidity=3.0, intervals=100, mobility=LocalDrag())
S = FIBER.nodes


def _moment(*positions, tension=0.0 * S, **surroundings) -> Snapshot:
    """Fibers of length 2 through nodes (node, 3), all with the same tension."""
    count = len(positions)
    return Snapshot.take(
        0.4,
        (FIBER,) * count,
        np.stack(positions),
        np.stack([tension] * count),
        surroundings=Surroundings(**surroundings),
    )


def _along_x(y=0.0, z=0.0):
    return np.stack([S, 0.0 * S + y, 0.0 * S + z], axis=1)


def _arc(radius):
    """An arc of a circle of that radius, by arclength."""
    return radius * np.stack([np.sin(S / radius), 1.0 - np.cos(S / radius), 0.0 * S], axis=1)


def test_the_largest_tension_may_be_a_compression():
    moment = _moment(_along_x(), tension=S * (2.0 - S) * (0.9 - S))
    dense = np.linspace(0.0, 2.0, 4001)
    expected = np.abs(dense * (2.0 - dense) * (0.9 - dense)).max()
    assert observables.largest_tension(moment)[0] == pytest.approx(expected, rel=1e-3)
    assert moment.tension.max() < 0.9 * expected


def test_curvature_and_energy_of_an_arc():
    """|x_ss| = 1 / R, and E L / (2 R^2) is stored."""
    moment = _moment(_arc(1.6))
    assert observables.largest_curvature(moment)[0] == pytest.approx(1.0 / 1.6, rel=1e-3)
    expected = 3.0 * 2.0 / (2.0 * 1.6**2)
    assert observables.elastic_energy(moment)[0] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("domain", [Free(), Periodic((0.0, 0.25, 0.0))])
def test_the_gap_is_the_distance_less_both_radii(domain):
    """r(L/2) = eps L = 0.02 for each."""
    moment = _moment(_along_x(), _along_x(y=0.08 if domain == Free() else 1.08), domain=domain)
    assert_close(observables.smallest_distance(moment), 0.08, rtol=1e-12)
    assert_close(observables.smallest_gap(moment), 0.08 - 2.0 * 0.02, rtol=1e-12)


def test_the_strain_is_that_of_the_cell():
    moment = _moment(_along_x(), domain=Sheared((3.0, 3.0, 3.0), 0.37))
    assert float(observables.strain(moment)) == 0.37


def test_a_load_sees_radii_at_mid_length_weights_and_time():
    """Parallel fibers 0.045 apart: surfaces 0.005 apart, a force of 8 (1 - 0.5)^2 at the range."""
    load = StericRepulsion(strength=8.0, range=0.01)
    moment = _moment(_along_x(), _along_x(y=0.045), load=load)
    assert_close(moment.loaded.radii, [0.02, 0.02], rtol=1e-14)
    assert moment.loaded.time == 0.4
    # opposite nodes are in range and the next, sqrt(0.045^2 + 0.02^2) = 0.0492 apart
    gap = np.array([0.005, np.hypot(0.045, 0.02) - 0.04])
    force = 8.0 * (1.0 - gap / 0.01) ** 2
    y_part = force * 0.045 / (gap + 0.04)
    weights = moment.weights[0]
    virial = weights @ weights * y_part[0] + 2.0 * weights[1:] @ weights[:-1] * y_part[1]
    assert observables.extra_stress(moment)[1, 1] == pytest.approx(-virial * 0.045, rel=1e-12)
