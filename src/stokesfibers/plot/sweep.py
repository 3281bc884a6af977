"""A quantity of a sweep against a swept parameter: lines for a second one, panels for a third."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.plot.style import COLUMN, PAGE, new_panels, style, time_colours
from stokesfibers.plot.sweep_along import Along, Floats, is_log
from stokesfibers.plot.sweep_data import Cut, cut
from stokesfibers.plot.sweep_notes import alike
from stokesfibers.plot.theme import theme
from stokesfibers.plot.ticks import number_axes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_MOST_LINES = 12
_MOST_PANELS = 6
_LONG = 24  # characters of a name that leaves too little room beside a panel
_LIGHTEST = 0.88  # of the colours: thin lines need more contrast than areas
_MARKERS = "os^Dv<>p"  # lines are told apart without their colours too
_ACROSS = 3  # panels beside one another
_SIDE_BY_SIDE = 48  # characters of names that fit below one panel
_FLAT = 0.1  # of values that are all alike: what is shown to both sides


def sweep(
    data: xr.Dataset,
    name: str | None = None,
    *,
    x: str | None = None,
    at: Mapping[str, Any] | None = None,
    per: str | None = None,
    by: str | None = None,
    log: str | None = None,
    label: str | None = None,
    xlabel: str | None = None,
    legend: str | None = None,
    ax: Axes | None = None,
) -> NDArray[Any]:
    """Draw a variable of a sweep's dataset; return the axes, one for each panel.

    It is drawn against the swept parameter with the most values, or the time if it is a series;
    lines are those of a second, panels of a third. Seeds become their mean with one standard error,
    fibers their mean. What cannot be trusted is hollow, or dashed if it is a series, and so are
    means that lack a seed; cases that failed are left out. Axes are logarithmic where positive
    values spread over a factor of 30, or parameters grow by factors.

    Parameters
    ----------
    data
        The dataset, as ``xarray.open_zarr("DIR/sweep.zarr")`` or `stokesfibers.sweep` give it.
    name
        The variable; default the first that is one number for each case and fiber.
    x
        The dimension along the horizontal axis, or a coordinate that runs along some, as ``eta``
        does along those of mu_bar and slenderness.
    at
        Values of parameters to stay at, the nearest; or of a fiber, or component (``space``).
    per
        A swept parameter to divide the variable by.
    by
        A coordinate that names the lines or panels, such as ``flow_strain`` for frequencies.
    log
        Axes that are logarithmic: ``"x"``, ``"y"``, ``"xy"`` or ``""``; default as above.
    label, xlabel, legend
        Texts along the vertical and the horizontal axis and above the legend, in place of its own.
    ax
        Axes to draw on, if there is one panel.

    Returns
    -------
    ndarray of Axes : (panel,)

    Raises
    ------
    InputError
        If there is no such variable, dimension or value, too many are left, or none is known.
    """
    held = _checked(log, cut(data, name, x=x, at=at, per=per, by=by))
    axes = _axes(len(held.values), ax)
    with style():
        _draw_all(axes, held, log, (xlabel or held.x.label, label or held.label))
        _legend(axes, held.lines, legend)
    return axes


def _draw_all(axes: NDArray[Any], held: Cut, log: str | None, labels: tuple[str, str]) -> None:
    for k, panel in enumerate(axes):
        _draw(panel, held, k)
        _scales(panel, held, log)
        panel.set_xlabel(labels[0])
        panel.set_ylabel(labels[1] if k % _ACROSS == 0 else "")
    _share_heights(axes, held)
    number_axes(axes, plain_x=held.x.numbers is not None)
    _title(axes, held)


def _title(axes: NDArray[Any], held: Cut) -> None:
    """Name the panels, and what stays."""
    if held.panels is not None:
        for k, panel in enumerate(axes):
            panel.set_title(held.panels.said(k), loc="left")
    text = ", ".join(held.held)
    if held.panels is None:
        axes[0].set_title(text, loc="left")
    elif text:
        axes[0].figure.suptitle(text, x=0.02, ha="left")


def _axes(count: int, ax: Axes | None) -> NDArray[Any]:
    """Return axes for `count` panels on a figure of a column, or a page for several, or `ax`."""
    if ax is not None:
        if count > 1:
            raise InputError("ax", "no axes for several panels, or `at` a value of one more", "ax")
        return np.array([ax], dtype=object)
    across, down = min(count, _ACROSS), -(-count // _ACROSS)
    width = COLUMN if count == 1 else PAGE
    panels = new_panels(down, across, width=width, height=0.3 + 2.3 * down).ravel()
    for unused in panels[count:]:
        unused.set_visible(False)
    return panels[:count]


def _legend(axes: NDArray[Any], lines: Along | None, text: str | None) -> None:
    """Say which line is which: beside the last panel, or above the first if it takes much room."""
    if lines is None:
        return
    printed = re.sub(r"\\[a-zA-Z]+|[{}_^$]", "", max(lines.label.split("\n"), key=len))
    title = lines.label if len(printed) <= _LONG else f"{lines.symbol}{lines.unit}"
    options: dict[str, Any] = {"title": text or title, "alignment": "left"}
    if max(map(len, lines.texts)) <= _LONG:
        axes[-1].legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), **options)
    else:
        axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.08), **options)


def _checked(log: str | None, held: Cut) -> Cut:
    if log not in (None, "", "x", "y", "xy", "yx"):
        raise InputError("log", "x, y, xy or nothing", repr(log))
    _check(held, held.lines, "lines", _MOST_LINES)
    _check(held, held.panels, "panels", _MOST_PANELS)
    return held


def _check(held: Cut, direction: Along | None, what: str, most: int) -> None:
    if direction is not None and len(direction.values) > most:
        raise InputError(
            "at",
            f"at most {most} {what}",
            f"{len(direction.values)} values of {direction.name}",
            f"Stay at one of them, or draw along it: x = '{direction.name}', not '{held.x.name}'.",
        )


def _draw(ax: Axes, held: Cut, panel: int) -> None:
    """Draw the lines of one panel; one without a known value still is in the legend."""
    lines = held.lines
    for k, colour in enumerate(_colours(lines)):
        where, values, doubtful = (
            part[panel, k] for part in (held.places, held.values, held.doubtful)
        )
        errors = None if held.errors is None else held.errors[panel, k]
        known = np.flatnonzero(np.isfinite(values) & np.isfinite(where))
        known = known[np.argsort(where[known], kind="stable")]
        options: dict[str, Any] = {"color": colour}
        if not held.series:
            options |= {"marker": _MARKERS[k % len(_MARKERS)], "markersize": 3.5}
        elif doubtful[known].any():
            options |= {"linestyle": (0, (4, 2))}
        label = None if lines is None else lines.texts[k]
        ax.plot(where[known], values[known], label=label, **options)
        if errors is not None:
            _draw_errors(ax, held, (where[known], values[known], errors[known]), colour)
        hollow = known[doubtful[known]]
        if hollow.size and not held.series:
            options |= {"linestyle": "none", "markerfacecolor": theme().ground}
            # above all lines: those with equal values would hide them
            ax.plot(where[hollow], values[hollow], zorder=3.0, **options)


def _draw_errors(ax: Axes, held: Cut, line: tuple[Floats, Floats, Floats], colour: Any) -> None:
    where, values, errors = line
    if held.series:
        ends = values - errors, values + errors
        ax.fill_between(where, *ends, color=colour, alpha=0.2, linewidth=0.0)
        return
    bars = {"fmt": "none", "ecolor": colour, "elinewidth": 0.8, "capsize": 2.0}
    ax.errorbar(where, values, yerr=errors, **bars)


def _colours(lines: Along | None) -> list[Any]:
    """Return a colour per line: in the order of numbers, however far apart, else the palette's."""
    if lines is None:
        return [theme().palette[0]]
    if lines.numbers is None or not np.isfinite(lines.numbers).all():
        return [theme().palette[k % len(theme().palette)] for k in range(len(lines.values))]
    _, rank = np.unique(lines.numbers, return_inverse=True)
    return time_colours(rank.astype(np.float64), _LIGHTEST)


def _scales(ax: Axes, held: Cut, log: str | None) -> None:
    if held.x.numbers is None:
        ax.set_xticks(range(len(held.x.texts)), held.x.texts)
        if sum(map(len, held.x.texts)) > _SIDE_BY_SIDE:
            ax.tick_params(axis="x", labelrotation=20.0)
            for label in ax.get_xticklabels():
                label.set_horizontalalignment("right")
    elif held.x.is_log and not held.series if log is None else "x" in log:
        ax.set_xscale("log")
    if is_log(held.values) if log is None else "y" in log:
        ax.set_yscale("log")


def _share_heights(axes: NDArray[Any], held: Cut) -> None:
    """Give all panels the limits that hold what each shows; what does not vary is flat."""
    shown = [ax for ax, values in zip(axes, held.values, strict=True) if np.isfinite(values).any()]
    limits = np.array([ax.get_ylim() for ax in shown])
    low, high = limits[:, 0].min(), limits[:, 1].max()
    mean = np.nanmean(held.values)
    if mean and alike(held.values):
        low, high = mean - _FLAT * abs(mean), mean + _FLAT * abs(mean)
    for ax in axes:
        ax.set_ylim(low, high)
