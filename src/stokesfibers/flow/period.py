"""Period and strain of a flow that oscillates, from its plain values: averages count periods."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Any

from stokesfibers.flow.shear import OscillatoryShear
from stokesfibers.flow.sum import SumOfFlows


def period_of(flow: Mapping[str, Any]) -> float | None:
    """Return the period [time] of a flow; None of one that is steady, or whose table cannot tell.

    Parameters
    ----------
    flow
        The flow as `stokesfibers.flow.base.to_dict` and stored cases give it. Of a sum the longest
        period of its parts.
    """
    if flow.get("kind") == OscillatoryShear.kind:
        return 1.0 / float(flow["frequency"])
    if flow.get("kind") == SumOfFlows.kind:
        return max(filter(None, map(period_of, flow["flows"])), default=None)
    return None


def strain_of_half_a_cycle(flow: Mapping[str, Any]) -> float | None:
    """Return the strain by which an oscillating shear moves to and fro; None of another flow.

    It is |amplitude| / (pi frequency), the integral of the rate over half a period.

    Parameters
    ----------
    flow
        The flow as for `period_of`, or as a case file has it.
    """
    if flow.get("kind") != OscillatoryShear.kind:
        return None
    amplitude = flow.get("amplitude", OscillatoryShear.amplitude)
    return abs(float(amplitude)) / (pi * float(flow["frequency"]))
