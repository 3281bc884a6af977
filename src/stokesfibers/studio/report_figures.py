"""The figures of a report: those that fit the run, each for a light and a dark ground."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

import stokesfibers.plot as plot
from stokesfibers.core.errors import InputError
from stokesfibers.plot import select
from stokesfibers.plot.style import rendered
from stokesfibers.studio.report_averages import has_averages, run_averages
from stokesfibers.studio.report_html import figure, image

if TYPE_CHECKING:
    import xarray as xr

_LARGEST_SVG = 400_000  # bytes; a drawing of very many lines is smaller as a picture
_DPI = 220
_FLAT = 1e-6  # extent across a plane, over the largest, below which shapes lie in it


@dataclass(frozen=True)
class Drawing:
    """One figure of a report.

    Attributes
    ----------
    draw
        Draws it; InputError where the run cannot show it.
    caption
        What it shows.
    across
        Whether it takes the whole width.
    lines
        Whether a drawing of lines is small; False for very many, which go in as a picture.
    """

    draw: Callable[[], Any]
    caption: str
    across: bool = False
    lines: bool = True


def figures(data: xr.DataTree) -> Iterator[str]:
    """Yield the figures that fit the run, as HTML; what cannot be drawn is said instead."""
    for drawing in drawings(data):
        try:
            pictures = "".join(_pictures(drawing))
        except InputError as error:
            yield figure("", f"{drawing.caption} Not drawn: {error}", across=drawing.across)
            continue
        yield figure(pictures, drawing.caption, across=drawing.across)


def drawings(data: xr.DataTree) -> Iterator[Drawing]:
    """Yield what fits the run: shapes of a planar one, snapshots of others, series and health."""
    if select.has(data, "trajectory", "position"):
        yield from _shapes(data)
    if not select.has(data, "observables", "time"):
        return
    time = select.numbers(data, "observables", "time")
    span = f"from t = {time[0]:.6g} to {time[-1]:.6g}"
    yield Drawing(partial(plot.energy, data), f"Elastic energy {span}.{_peak(data)}")
    stress = "Normal stress differences and shear stress of all fibers, the extra stress (48)"
    yield Drawing(partial(plot.stress, data), f"{stress}, {span}.")
    if has_averages(data):
        averages = partial(lambda: plot.averages(data, run_averages(data)))
        says = "Stress per volume, with averages over the second half; bands are standard errors."
        yield Drawing(averages, says)
    if select.read(data, "trajectory", "position").sizes["fiber"] > 1:
        yield from _of_many(data, span)
    bent = "Curvature along all fibers: its quantiles against time, and its distribution."
    yield Drawing(partial(plot.curvature, data), bent)
    watched = "Health of the run: length error, step size, wall time and largest curvature."
    yield Drawing(partial(plot.health, data), watched)


def _shapes(data: xr.DataTree) -> Iterator[Drawing]:
    stored = select.numbers(data, "trajectory", "time")
    plane = _plane(data)
    if plane is None:
        for time in dict.fromkeys((float(stored[0]), float(stored[-1]))):
            says = f"All fibers at t = {time:.6g} in the cell, coloured by their tension."
            yield Drawing(partial(plot.perspective, data, time=time), says, lines=False)
        return
    panels = partial(plot.shape_panels, data, plane=plane)
    says = "Centrelines at a few times, where the elastic energy is largest if fibers bend."
    yield Drawing(panels, says, across=True)
    over = partial(plot.shapes, data, plane=plane)
    yield Drawing(over, "The same centrelines over one another, dark to light with time.")
    along = "Line tension along the first fiber at these times; below 0 it is compressed."
    yield Drawing(partial(plot.tension, data), along)


def _of_many(data: xr.DataTree, span: str) -> Iterator[Drawing]:
    ordered = f"Orientation tensor of the end-to-end vectors, and nematic order S, {span}."
    yield Drawing(partial(plot.order, data), ordered)
    turned = "Angles of the fibers to the flow direction, at the first and the last record."
    yield Drawing(partial(plot.orientation, data), turned)
    if select.has(data, "observables", "smallest_gap"):
        gap = partial(plot.series, data, "smallest_gap")
        yield Drawing(gap, f"Smallest gap between surfaces of fibers, {span}.")
    ends = "Distance from end to end over the length: its quantiles, and its distribution."
    yield Drawing(partial(plot.end_to_end, data), ends)


def _plane(data: xr.DataTree) -> str | None:
    """Return the plane that all shapes lie in, or None; a suspension is not flat."""
    array = select.read(data, "trajectory", "position")
    if array.sizes["fiber"] > select.MOST_FIBERS:
        return None
    points = select.values(array).reshape(-1, 3)
    extent = np.nanmax(points, axis=0) - np.nanmin(points, axis=0)
    across = int(np.argmin(extent))
    if extent[across] > _FLAT * extent.max():
        return None
    return "xyz".replace("xyz"[across], "")


def _peak(data: xr.DataTree) -> str:
    if not select.has(data, "observables", "elastic_energy"):
        return ""
    total = select.values(
        select.total_over_rest(select.read(data, "observables", "elastic_energy"), "time")
    )
    if not np.isfinite(total).any():
        return ""
    time = select.numbers(data, "observables", "time")
    return f" Its peak is {np.nanmax(total):.4g} at t = {time[np.nanargmax(total)]:.6g}."


def _pictures(drawing: Drawing) -> Iterator[str]:
    for ground in (plot.LIGHT, plot.DARK):
        with plot.on(ground):
            drawn = drawing.draw()
            content, kind = b"", "svg+xml"
            if drawing.lines:
                content = rendered(drawn, "svg", as_paths=True)
            if not 0 < len(content) <= _LARGEST_SVG:
                content, kind = rendered(drawn, "png", _DPI), "png"
        yield image(content, kind, (f"on-{ground.name}", drawing.caption))
