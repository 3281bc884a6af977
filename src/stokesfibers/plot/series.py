"""Observables against time: any scalar, the stresses (the paper's Figs. 6, 7), the energy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.case import time_axis
from stokesfibers.plot.style import drawing
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_DASHES = ("-", (0, (4, 1.5)), (0, (1, 1.2)))  # lines also told apart without colour
_ROUNDING = 1e-9


def series(
    data: xr.DataTree, name: str, *, ax: Axes | None = None, fiber: int | None = None
) -> Axes:
    """Draw a scalar observable against time.

    An observable with one value per fiber gives one line per fiber, or, for more than 8 fibers,
    the mean over the fibers and a band from the smallest to the largest. Reversals of an
    oscillating shear are marked.

    Parameters
    ----------
    data
        The stored run.
    name
        Name in the group ``observables``, e.g. ``"shear_stress"``.
    ax
        Axes to draw on; default those of a new figure.
    fiber
        Number of the only fiber to draw; for observables with a value per fiber.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the run does not hold it, it is no scalar, or the fiber does not exist.
    """
    array = select.read(data, "observables", name)
    variable = select.describe(data, "observables", name)
    if set(array.dims) not in ({"time"}, {"time", "fiber"}):
        scalars = [
            str(key)
            for key, a in data["observables"].data_vars.items()
            if set(a.dims) <= {"time", "fiber"}
        ]
        raise InputError(
            f"observables.{name}",
            "a scalar, or a scalar per fiber",
            f"an array with axes ({', '.join(map(str, array.dims))})",
            f"Scalars of this run: {', '.join(sorted(scalars))}.",
        )
    if fiber is not None:
        if "fiber" not in array.dims:
            raise InputError("fiber", f"None, since {name} has no value per fiber", fiber)
        array = array.isel(fiber=select.pick_fibers(array.sizes["fiber"], fiber)[:1])
    with drawing(ax) as ax:
        draw_fibers(ax, data, array, first=0 if fiber is None else fiber)
        ax.set_ylabel(select.axis_label(variable))
        marked = time_axis(ax, data, select.numbers(data, "observables", "time"))
        if marked or fiber is not None or len(ax.get_legend_handles_labels()[0]) > 1:
            ax.legend()
    return ax


def stress(data: xr.DataTree, *, ax: Axes | None = None) -> Axes:
    """Draw the first normal stress difference and the shear stress against time.

    They are parts of the extra stress (48): N_1 = Sigma_11 - Sigma_22 and Sigma_12. The second
    normal stress difference N_2 = Sigma_22 - Sigma_33 is added unless it is zero to rounding.
    Reversals of an oscillating shear are marked.

    Parameters
    ----------
    data
        The stored run.
    ax
        Axes to draw on; default those of a new figure.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the run does not hold N_1 and Sigma_12.
    """
    names = ["first_normal_stress_difference", "shear_stress"]
    drawn = {n: select.numbers(data, "observables", n) for n in names}
    optional = "second_normal_stress_difference"
    if select.has(data, "observables", optional):
        second = select.numbers(data, "observables", optional)
        scale = max(np.nanmax(np.abs(v), initial=0.0) for v in drawn.values())
        if np.nanmax(np.abs(second), initial=0.0) > _ROUNDING * scale:
            drawn[optional] = second
    time = select.numbers(data, "observables", "time")
    with drawing(ax) as ax:
        ax.axhline(0.0, color=theme().faint, linewidth=0.5, zorder=0)
        for number, (name, line) in enumerate(drawn.items()):
            symbol = select.describe(data, "observables", name).symbol
            ax.plot(
                time,
                line,
                color=theme().palette[number],
                linestyle=_DASHES[number],
                label=f"${symbol}$",
            )
        unit = select.unit_text(select.describe(data, "observables", names[0]))
        ax.set_ylabel(rf"extra stress $\Sigma${unit}")
        time_axis(ax, data, time)
        ax.legend()
    return ax


def energy(data: xr.DataTree, *, ax: Axes | None = None) -> Axes:
    """Draw the elastic energy against time: all fibers together, and each of up to 7 fibers.

    Reversals of an oscillating shear are marked.

    Parameters
    ----------
    data
        The stored run.
    ax
        Axes to draw on; default those of a new figure.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the run does not hold the elastic energy.
    """
    array = select.read(data, "observables", "elastic_energy")
    time = select.numbers(data, "observables", "time")
    count = array.sizes.get("fiber", 1)
    total = select.values(select.total_over_rest(array, "time"))
    with drawing(ax) as ax:
        if 1 < count < select.MOST_FIBERS:
            draw_fibers(ax, data, array)
        colour = theme().palette[0] if count == 1 else theme().ink
        ax.plot(time, total, color=colour, label="all fibers", linewidth=1.2)
        ax.set_ylim(bottom=0.0)
        ax.set_ylabel(select.axis_label(select.describe(data, "observables", "elastic_energy")))
        time_axis(ax, data, time)
        if len(ax.get_lines()) > 1:
            ax.legend()
    return ax


def draw_fibers(ax: Axes, data: xr.DataTree, array: xr.DataArray, first: int = 0) -> None:
    """Draw an observable with or without a fiber axis: a line per fiber, or mean and band.

    Parameters
    ----------
    ax
        Axes to draw on.
    data
        The stored run.
    array : (time,) or (time, fiber)
    first
        Number of the array's first fiber, for the legend.
    """
    time = select.numbers(data, "observables", "time")
    lines = select.values(array.transpose("time", ...)).reshape(len(time), -1)
    if lines.shape[1] == 1:
        label = f"fiber {first}" if "fiber" in array.dims else ""
        ax.plot(time, lines[:, 0], color=theme().palette[0], label=label)
    elif lines.shape[1] <= select.MOST_FIBERS:
        for number, line in enumerate(lines.T):
            ax.plot(time, line, color=theme().palette[number], label=f"fiber {first + number}")
    else:
        known = np.ma.masked_invalid(lines)
        low, mean, high = (
            np.ma.filled(part, np.nan) for part in (known.min(1), known.mean(1), known.max(1))
        )
        ax.fill_between(
            time,
            low,
            high,
            color=theme().palette[5],
            alpha=0.35,
            linewidth=0.0,
            label="smallest to largest",
        )
        ax.plot(time, mean, color=theme().palette[0], label=f"mean of {lines.shape[1]}")
