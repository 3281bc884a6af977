"""Averages over time with their error bars, over the series they come from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import Variable
from stokesfibers.plot import select
from stokesfibers.plot.case import time_axis
from stokesfibers.plot.style import COLUMN, new_panels, style
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr

_SMALL, _LARGE = 3, 5  # powers of ten between which numbers are written out
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Averaged:
    """A quantity and its average over time.

    Attributes
    ----------
    variable
        Symbol, unit and meaning.
    time, values : (n,)
        All that is recorded.
    after
        Time from which on the average is taken.
    mean, error
        The average and one standard error of it.
    settled
        False if the error is likely to be larger.
    """

    variable: Variable
    time: NDArray[Any]
    values: NDArray[Any]
    after: float
    mean: float
    error: float
    settled: bool = True

    def text(self) -> str:
        """Return mean and error: two digits of the error, and the mean to the same place."""
        more = "" if self.settled else " or more"
        return with_error(self.mean, self.error, more)


def with_error(mean: float, error: float, more: str = "") -> str:
    """Return ``mean ± error``: two digits of the error, and the mean rounded to the same place.

    Numbers from 1e5 on, and below 1e-3, stand before a common power of ten.

    Parameters
    ----------
    mean, error
        A number and its standard error; without a positive error the mean has four digits.
    more
        Words after the error.
    """
    if not (math.isfinite(mean) and math.isfinite(error) and error > 0.0):
        return f"{mean:.4g} ± {error:.2g}{more}".replace("-", "−")
    largest = max(abs(mean), error)
    power = math.floor(math.log10(largest))
    if -_SMALL <= power < _LARGE:
        power = 0
    mean, error = mean / 10.0**power, error / 10.0**power
    # the second digit of the error as it is printed: 0.0996 is 0.10
    place = 1 - int(f"{error:.1e}".partition("e")[2])
    digits = max(place, 0)
    shown = f"{round(mean, place) + 0.0:.{digits}f} ± {round(error, place):.{digits}f}"
    if power:
        shown = f"({shown}) × 10{str(power).translate(_RAISED)}"
    return shown.replace("-", "−") + more


def averages(data: xr.DataTree, found: Sequence[Averaged]) -> NDArray[Any]:
    """Draw each quantity against time, and its average with a band of one standard error.

    The band is drawn over the times the average is taken over.

    Parameters
    ----------
    data
        The stored run.
    found
        Quantities with their averages, which `stokesfibers.observe.averages` finds.

    Returns
    -------
    ndarray of Axes : (quantity,)

    Raises
    ------
    InputError
        If there is nothing to draw.
    """
    if not found:
        raise InputError("averages", "at least one quantity", "none")
    axes = new_panels(len(found), 1, width=COLUMN, height=0.5 + 1.25 * len(found))[:, 0]
    with style():
        for ax, one in zip(axes, found, strict=True):
            ax.plot(one.time, one.values, color=theme().palette[0], linewidth=0.6)
            over = [one.after, float(one.time[-1])]
            low, high = one.mean - one.error, one.mean + one.error
            # over the line, which would hide a narrow band
            ax.fill_between(over, low, high, color=theme().palette[1], alpha=0.35, linewidth=0.0)
            ax.plot(over, [one.mean, one.mean], color=theme().palette[1])
            ax.set_ylabel(f"${one.variable.symbol}${select.unit_text(one.variable)}")
            ax.set_title(f"{one.variable.meaning}: {one.text()}", loc="left")
            time_axis(ax, data, one.time)
            if ax is not axes[-1]:
                ax.set_xlabel("")
                ax.tick_params(labelbottom=False)
        symbol = select.describe(data, "observables", "time").symbol
        note = f"mean and standard error, from ${symbol} = {found[0].after:.6g}$ on"
        axes[0].figure.suptitle(note, x=0.02, ha="left")
        axes[0].figure.align_ylabels(list(axes))
    return axes
