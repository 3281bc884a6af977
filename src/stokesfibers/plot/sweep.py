"""A quantity of a sweep against a swept parameter: lines for a second one, panels for a third."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.plot.style import COLUMN, PAGE, new_panels, style, time_colours
from stokesfibers.plot.sweep_data import Along, Cut, cut, is_log
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_MOST_LINES = 12
_MOST_PANELS = 6
_DECADES = 1.7  # below which a logarithmic scale is numbered between powers of ten too

Floats = NDArray[np.float64]


def sweep(
    data: xr.Dataset,
    name: str | None = None,
    *,
    x: str | None = None,
    at: Mapping[str, Any] | None = None,
) -> NDArray[Any]:
    """Draw a variable of a sweep's dataset; return the axes, one for each panel.

    It is drawn against the swept parameter with the most values, or the time if it is a series;
    lines are those of a second parameter, panels those of a third. Seeds become their mean with one
    standard error, and so do fibers, of which the mean is drawn. Points whose result cannot be
    trusted are hollow; cases that failed are left out. Axes of positive values that spread over
    more than a factor of 30 are logarithmic.

    Parameters
    ----------
    data
        The dataset, as ``xarray.open_zarr("DIR/sweep.zarr")`` or `stokesfibers.sweep` give it.
    name
        The variable; default the first that is one number for each case and fiber.
    x
        The dimension along the horizontal axis.
    at
        Values of swept parameters to stay at, the nearest of each.

    Returns
    -------
    ndarray of Axes : (panel,)

    Raises
    ------
    InputError
        If there is no such variable, dimension or value, more than three parameters are left, there
        are too many lines or panels, or no value is known.
    """
    held = cut(data, name, x=x, at=at or {})
    lines, panels = _at_most(held, held.lines, "lines", _MOST_LINES), held.panels
    _at_most(held, panels, "panels", _MOST_PANELS)
    count = 1 if panels is None else len(panels.values)
    width = COLUMN if count == 1 else PAGE
    across = min(count, 3)
    down = -(-count // across)
    axes = new_panels(down, across, width=width, height=0.3 + 2.3 * down).ravel()
    log_x, log_y = is_log(held.x.numbers), is_log(held.values)
    with style():
        for k, ax in enumerate(axes):
            if k >= count:
                ax.set_visible(False)
                continue
            _draw(ax, held, k, lines)
            _scales(ax, held, log_x=log_x, log_y=log_y)
            if panels is not None:
                ax.set_title(panels.said(k), loc="left")
            ax.set_xlabel(held.x.label)
            ax.set_ylabel(held.label if k % across == 0 else "")
        _share_heights(axes[:count])
        if lines is not None:
            axes[count - 1].legend(
                title=lines.label,
                loc="upper left",
                bbox_to_anchor=(1.02, 1.0),
                alignment="left",
            )
    return axes[:count]


def _at_most(held: Cut, direction: Along | None, what: str, most: int) -> Along | None:
    if direction is not None and len(direction.values) > most:
        raise InputError(
            "at",
            f"at most {most} {what}",
            f"{len(direction.values)} values of {direction.name}",
            f"Stay at one of them, or draw along it: x = '{direction.name}', not '{held.x.name}'.",
        )
    return direction


def _draw(ax: Axes, held: Cut, panel: int, lines: Along | None) -> None:
    """Draw the lines of one panel."""
    count = 1 if lines is None else len(lines.values)
    for k, colour in enumerate(_colours(lines)):
        values, errors, doubtful = (
            part[panel, k] if part is not None else None
            for part in (held.values, held.errors, held.doubtful)
        )
        assert values is not None
        known = np.isfinite(values)
        if not known.any():
            continue
        where = np.arange(len(values), dtype=float) if held.x.numbers is None else held.x.numbers
        label = lines.texts[k] if lines is not None and count > 1 else None
        if held.series:
            ax.plot(where[known], values[known], color=colour, label=label)
            if errors is not None:
                ends = values - errors, values + errors
                ax.fill_between(where, *ends, color=colour, alpha=0.2, linewidth=0.0)
            continue
        ax.plot(where[known], values[known], color=colour, label=label, marker="o", markersize=3.5)
        if errors is not None:
            bars = {"fmt": "none", "ecolor": colour, "elinewidth": 0.8, "capsize": 2.0}
            ax.errorbar(where[known], values[known], yerr=errors[known], **bars)
        hollow = known & (np.zeros_like(known) if doubtful is None else doubtful)
        options = {"color": colour, "marker": "o", "markersize": 3.5, "linestyle": "none"}
        ax.plot(where[hollow], values[hollow], markerfacecolor=theme().ground, **options)


def _colours(lines: Along | None) -> list[Any]:
    """Return a colour per line: growing with numbers, else those of the palette."""
    if lines is None:
        return [theme().palette[0]]
    if lines.numbers is None:
        return [theme().palette[k % len(theme().palette)] for k in range(len(lines.values))]
    return time_colours(np.log(lines.numbers) if is_log(lines.numbers) else lines.numbers)


def _scales(ax: Axes, held: Cut, *, log_x: bool, log_y: bool) -> None:
    if held.x.numbers is None:
        ax.set_xticks(range(len(held.x.texts)), held.x.texts)
    elif log_x and not held.series:
        ax.set_xscale("log")
        _number(ax.xaxis, held.x.numbers)
    if log_y:
        ax.set_yscale("log")
        _number(ax.yaxis, held.values)


def _share_heights(axes: NDArray[Any]) -> None:
    """Give all panels the limits that hold the lines of each."""
    limits = np.array([ax.get_ylim() for ax in axes])
    for ax in axes:
        ax.set_ylim(limits[:, 0].min(), limits[:, 1].max())


def _number(axis: Any, values: Floats) -> None:
    """Number a logarithmic axis so that labels neither lack nor overlap."""
    from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

    known = values[np.isfinite(values) & (values > 0.0)]
    if np.log10(known.max() / known.min()) < _DECADES:
        axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        axis.set_major_formatter(LogFormatterSciNotation(minor_thresholds=(np.inf, np.inf)))
    axis.set_minor_formatter(NullFormatter())
