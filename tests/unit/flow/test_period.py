"""The period of a flow, as averages need it."""

from __future__ import annotations

import pytest

from stokesfibers.flow import OscillatoryShear, Shear, SumOfFlows
from stokesfibers.flow.base import to_dict
from stokesfibers.flow.period import period_of

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
