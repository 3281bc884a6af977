"""Distributions over the fibers: curvature along them, and distance from end to end.

Both are found from the recorded positions. No bins have to be chosen before a run, a run stored
long ago has them too, and any quantile can be asked for. The curvature's second moment and its
largest value are recorded more often, as the elastic energy and ``largest_curvature``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.plot import geometry, select
from stokesfibers.plot.case import time_axis
from stokesfibers.plot.sample import Sample
from stokesfibers.plot.style import COLUMN, new_panels, style, time_colours
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
Quantity = Literal["curvature", "end_to_end"]

_MOST_RECORDS = 400  # more than a column can show
_LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
_PIECES = 4000  # of all fibers together, at least, whose curvature makes a smooth curve
_LEAST = {"curvature": 0.1, "end_to_end": 0.004}  # range of the axis if nothing bends


@dataclass(frozen=True)
class _Kind:
    """How a quantity is found from (fiber, node, 3) and (fiber, node), and what it is called."""

    sample: Callable[[Floats, Floats], tuple[Floats, Floats]]
    label: str
    of_what: str
    between: Callable[[Floats, Floats], tuple[Floats, Floats]] | None = None
    """Finds it between the recorded points too, where it is a function of arclength."""

    @property
    def two_lines(self) -> str:
        """The label for an axis too short for it, broken before its symbol."""
        return self.label.replace(" $", "\n$") if len(self.label) > 30 else self.label


def curvature(data: xr.DataTree, *, times: ArrayLike | None = None) -> NDArray[Any]:
    """Draw how the curvature kappa L is distributed along all fibers.

    Above, against time: the median, and the bands that hold the inner half and the inner nine
    tenths of the fibers' length. Below, at a few times: the share of the fibers' length that is
    bent more than a value, which needs no bins. Each piece of a fiber counts with its
    arclength. The curvature is that of circles through three recorded points; below it is
    interpolated between them, so that the curve is as smooth as the shapes.

    Parameters
    ----------
    data
        The stored run.
    times
        Times of the lower panel; the nearest stored record stands for each. Default: up to four,
        chosen as for `shapes`.

    Returns
    -------
    ndarray of Axes : (2,)

    Raises
    ------
    InputError
        If a time lies outside the stored range or a record holds no finite position.
    """
    return _figure(data, "curvature", times)


def end_to_end(data: xr.DataTree, *, times: ArrayLike | None = None) -> NDArray[Any]:
    """Draw how the distance from end to end, over the length, is distributed over the fibers.

    1 is a straight fiber. Panels, parameters and errors are those of `curvature`; each fiber
    counts once.

    Returns
    -------
    ndarray of Axes : (2,)
    """
    return _figure(data, "end_to_end", times)


def distribution(
    data: xr.DataTree,
    quantity: Quantity,
    *,
    bins: int | ArrayLike = 40,
    times: ArrayLike | None = None,
) -> xr.DataArray:
    """Return the density of a quantity at the recorded times, as numbers for further use.

    Parameters
    ----------
    data
        The stored run.
    quantity
        ``"curvature"``: kappa L along all fibers, weighted by arclength; ``"end_to_end"``: the
        distance from end to end over the length, each fiber once.
    bins
        Edges of the bins, growing; or their number, between 0 and the largest value.
    times
        Times; the nearest stored record stands for each. Default: all records.

    Returns
    -------
    DataArray : (time, bin)
        Density: its sum over bins times their ``width`` is the share of values within the
        edges. Coordinates: ``time``, and along ``bin`` the middle, ``bin``, and ``width``.

    Raises
    ------
    InputError
        If the quantity is none of these, a time lies outside the stored range, a record holds
        no finite position or the edges do not grow.
    """
    import xarray as xr

    if quantity not in _KINDS:
        raise InputError("quantity", f"one of {', '.join(_KINDS)}", repr(quantity))
    stored = select.numbers(data, "trajectory", "time")
    records = select.pick_records(data, stored if times is None else times)
    samples = [_sample(data, quantity, record) for record in records]
    edges = _edges(bins, max(float(s.values[-1]) for s in samples))
    shares = [np.histogram(s.values, edges, weights=s.shares)[0] for s in samples]
    width = np.diff(edges)
    return xr.DataArray(
        np.array(shares) / width,
        dims=("time", "bin"),
        coords={
            "time": stored[records],
            "bin": 0.5 * (edges[1:] + edges[:-1]),
            "width": ("bin", width),
        },
        name=f"{quantity}_density",
        attrs={"units": "1", "long_name": f"density of the {_KINDS[quantity].label}"},
    )


def _figure(data: xr.DataTree, quantity: str, times: ArrayLike | None) -> NDArray[Any]:
    picked = select.pick_records(data, times, most=4)
    stored = select.numbers(data, "trajectory", "time")
    stride = -(-len(stored) // _MOST_RECORDS)
    history = np.arange(0, len(stored), stride, dtype=np.intp)
    lines = np.array([_sample(data, quantity, k).quantiles((0.0, *_LEVELS, 1.0)) for k in history])
    smooth = _KINDS[quantity].between is not None
    samples = [_sample(data, quantity, k, between=smooth) for k in picked]
    span = _span(quantity, [lines, *(s.values for s in samples)])
    axes = new_panels(2, 1, width=COLUMN, height=3.9)[:, 0]
    colours = time_colours(stored[picked])
    with style():
        _history(axes[0], data, stored[history], lines)
        axes[0].set(ylim=span, ylabel=_KINDS[quantity].two_lines)
        for sample, time, colour in zip(samples, stored[picked], colours, strict=True):
            line = sample.curve(span, smooth=smooth)
            style_of = "default" if smooth else "steps-post"
            axes[1].plot(*line, drawstyle=style_of, color=colour, label=select.number_text(time))
            # the same colour on the time axis above
            axes[0].plot(
                time,
                1.0,
                marker="v",
                markersize=4,
                color=colour,
                clip_on=False,
                transform=axes[0].get_xaxis_transform(),
            )
        axes[1].set(xlim=span, ylim=(0.0, 1.03), xlabel=_KINDS[quantity].label)
        axes[1].set_ylabel(f"share of the {_KINDS[quantity].of_what}\nwith a larger value")
        for ax, direction in zip(axes, "yx", strict=True):
            ax.ticklabel_format(axis=direction, useOffset=False)
        title = select.time_label(data)
        axes[1].legend(title=title, loc="upper left", bbox_to_anchor=(1.0, 1.0), alignment="left")
        axes[0].figure.align_ylabels(list(axes))
    return axes


def _history(ax: Axes, data: xr.DataTree, time: Floats, lines: Floats) -> None:
    """Draw bands of the quantiles 0, `_LEVELS`, 1 against time: (time, 7)."""
    if lines.shape[0] and np.any(lines[:, 0] < lines[:, -1]):
        # as opaque as they look, so that they print the same on any ground
        for low, high, colour, label in (
            (1, 5, theme().bands[0], "inner 90 %"),
            (2, 4, theme().bands[1], "inner half"),
        ):
            ax.fill_between(
                time, lines[:, low], lines[:, high], color=colour, linewidth=0.0, label=label
            )
        for extreme in (0, 6):
            label = "" if extreme else "extremes"
            ax.plot(time, lines[:, extreme], color=theme().palette[1], linewidth=0.5, label=label)
        ax.plot(time, lines[:, 3], color=theme().ink, label="median")
    else:
        ax.plot(time, lines[:, 3], color=theme().palette[0])
    time_axis(ax, data, time)
    if ax.get_legend_handles_labels()[1]:
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _sample(data: xr.DataTree, quantity: str, record: np.intp, *, between: bool = False) -> Sample:
    position = select.read(data, "trajectory", "position").isel(time=int(record))
    points = select.values(position.transpose("fiber", "node", "space"))
    arclength = select.numbers(data, "trajectory", "arclength")
    kind = _KINDS[quantity]
    found = kind.between if between and kind.between is not None else kind.sample
    values, weights = found(points, arclength)
    known = np.isfinite(values)
    if not known.any():
        raise InputError("trajectory.position", "finite positions", "none in one of these records")
    values, weights = values[known], weights[known]
    order = np.argsort(values, kind="stable")
    return Sample(values[order], weights[order] / weights.sum())


def _curvatures(points: Floats, arclength: Floats) -> tuple[Floats, Floats]:
    steps = np.diff(arclength, axis=1)
    weights = 0.5 * (np.pad(steps, ((0, 0), (1, 0))) + np.pad(steps, ((0, 0), (0, 1))))
    scaled = geometry.curvature(points) * arclength[:, -1:]
    # the ends' curvature is set to zero, even where they are lost
    known = np.isfinite(points).all(axis=-1)
    return np.where(known, scaled, np.nan).ravel(), weights.ravel()


def _curvatures_between(points: Floats, arclength: Floats) -> tuple[Floats, Floats]:
    """Return the curvature on equal parts of each interval, linear between the points."""
    scaled = geometry.curvature(points) * arclength[:, -1:]
    scaled = np.where(np.isfinite(points).all(axis=-1), scaled, np.nan)
    steps = np.diff(arclength, axis=1)
    parts = -(-_PIECES // steps.size)
    at = (np.arange(parts) + 0.5) / parts
    inside = scaled[:, :-1, None] * (1.0 - at) + scaled[:, 1:, None] * at
    return inside.ravel(), np.repeat(steps.ravel() / parts, parts)


def _distances(points: Floats, arclength: Floats) -> tuple[Floats, Floats]:
    ends = np.linalg.norm(points[:, -1] - points[:, 0], axis=-1)
    return ends / arclength[:, -1], np.ones(len(ends))


def _edges(bins: int | ArrayLike, largest: float) -> Floats:
    if isinstance(bins, int) and not isinstance(bins, bool) and bins > 0:
        return np.linspace(0.0, largest or 1.0, bins + 1)
    edges = np.asarray(bins, dtype=np.float64)
    if edges.ndim != 1 or len(edges) < 2 or not np.all(np.diff(edges) > 0.0):
        raise InputError("bins", "a number of bins above 0, or edges that grow", bins)
    return edges


def _span(quantity: str, drawn: list[Floats]) -> tuple[float, float]:
    """Return the limits of the axis of values: from 0 for curvatures, to about 1 for distances."""
    low, high = min(np.min(v) for v in drawn), max(np.max(v) for v in drawn)
    least = _LEAST[quantity]
    if quantity == "curvature":
        return 0.0, max(1.04 * float(high), least)
    high = max(float(high), 1.0)
    margin = 0.04 * max(high - float(low), least)
    return max(min(float(low), high - least) - margin, 0.0), high + margin


_KINDS: dict[str, _Kind] = {
    "curvature": _Kind(_curvatures, r"curvature $\kappa L$", "fibers' length", _curvatures_between),
    "end_to_end": _Kind(
        _distances, r"end-to-end distance $|\mathbf{x}(L)-\mathbf{x}(0)|/L$", "fibers"
    ),
}
