"""Averages over time with their error bars, over the series they come from."""

from __future__ import annotations

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
        """Return mean and error, the error with two digits."""
        more = "" if self.settled else " or more"
        return f"{self.mean:.4g} ± {self.error:.2g}{more}"


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
