"""The period of a flow, as averages need it, and its strain."""

from __future__ import annotations

import math

import pytest

from stokesfibers.flow import OscillatoryShear, Shear, SumOfFlows
from stokesfibers.flow.base import to_dict
from stokesfibers.flow.period import period_of, strain_of_half_a_cycle

SLOW, FAST = OscillatoryShear(frequency=0.25), OscillatoryShear(frequency=4.0)


@pytest.mark.parametrize(
    ("flow", "period"),
    [
        (SLOW, 4.0),
        (FAST, 0.25),
        (SumOfFlows((FAST, Shear(), SumOfFlows((SLOW,)))), 4.0),
        (Shear(), None),
        (SumOfFlows((Shear(), Shear())), None),
    ],
)
def test_the_period_is_the_longest_of_the_parts(flow, period):
    assert period_of(to_dict(flow)) == period


def test_an_oscillating_shear_moves_by_the_strain_of_half_a_cycle():
    """Its strain is largest after half a cycle."""
    flow = OscillatoryShear(-3.0, frequency=0.25)
    found = strain_of_half_a_cycle(to_dict(flow))
    assert found == pytest.approx(3.0 / (math.pi * 0.25))
    assert found == pytest.approx(abs(flow.strain(2.0)))
    table = {"kind": "oscillatory_shear", "frequency": 0.25}
    assert strain_of_half_a_cycle(table) == pytest.approx(1.0 / (math.pi * 0.25))
    assert strain_of_half_a_cycle(to_dict(Shear())) is None
