"""Numbers along axes that neither lack nor overlap, on a log axis of less than a decade too."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.plot import select
from stokesfibers.plot.sweep_along import plain, power_text

_STEPS = ((1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
_LEAST, _MOST = 3, 6  # numbers on an axis
_DIGITS = 4
_ROUNDING = 1.0 + 1e-9
_GAP = {"x": 0.24, "y": 0.1}  # numbers are broader than high


def number_axes(axes: NDArray[Any], *, plain_x: bool) -> None:
    """Number the axes of each panel for the limits they have now.

    Parameters
    ----------
    axes
        Panels.
    plain_x
        Whether a linear horizontal axis is of numbers, which are then written out.
    """
    from matplotlib.ticker import FuncFormatter, MaxNLocator, ScalarFormatter

    for ax in axes:
        if plain_x and ax.get_xscale() == "linear":
            ax.xaxis.set_major_locator(MaxNLocator(_MOST - 1))
            ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: select.number_text(value)))
        written = ax.yaxis.get_major_formatter()
        if isinstance(written, ScalarFormatter):  # not one that the caller chose
            written.set_useOffset(False)
        for axis in (ax.xaxis, ax.yaxis):
            if axis.get_scale() == "log":
                _number_log(axis)


def log_ticks(low: float, high: float, gap: float = 0.1) -> list[float]:
    """Return some round numbers between two positive ones, spread as on a log scale.

    Parameters
    ----------
    low, high
        Ends of the axis.
    gap
        Least distance of two numbers, over the length of the axis.
    """
    span = np.log10(high / low)
    powers = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    decades = [v for v in 10.0**powers if low <= v * _ROUNDING and v <= high * _ROUNDING]
    if len(decades) >= _LEAST:
        return decades[:: -(-len(decades) // _MOST)]
    for steps in _STEPS:
        found: list[float] = []
        for tick in (step * 10.0**power for power in powers for step in steps):
            inside = low <= tick * _ROUNDING and tick <= high * _ROUNDING
            if inside and (not found or np.log10(tick / found[-1]) >= gap * span):
                found.append(float(tick))
        if len(found) >= _LEAST:
            return found
    from matplotlib.ticker import MaxNLocator

    return [v for v in MaxNLocator(_LEAST).tick_values(low, high) if low <= v <= high]


def _number_log(axis: Any) -> None:
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullFormatter

    ticks = log_ticks(*sorted(axis.get_view_interval()), gap=_GAP[axis.axis_name])
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FixedFormatter([_text(tick, ticks) for tick in ticks]))
    axis.set_minor_formatter(NullFormatter())


def _text(tick: float, ticks: list[float]) -> str:
    """Return a number as it is, or as a power of ten if some are very small or large."""
    if plain(ticks):
        return f"{tick:.6g}"
    return power_text(tick, _DIGITS)
