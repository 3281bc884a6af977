"""Figures of a stored run, from its dataset alone: no solver is needed to draw.

Every function takes the run as an `xarray.DataTree` and returns the axes it drew on; ``ax.figure``
is the figure, `save` writes it to a file. matplotlib is imported when the first figure is drawn.
Inside ``with dark():`` figures are for a dark ground.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from stokesfibers.plot.averages import Averaged, averages
from stokesfibers.plot.distribution import curvature, distribution, end_to_end
from stokesfibers.plot.health import health
from stokesfibers.plot.orientation import order, orientation
from stokesfibers.plot.panels import shape_panels
from stokesfibers.plot.perspective import perspective
from stokesfibers.plot.plane import Plane, plane_of
from stokesfibers.plot.series import energy, series, stress
from stokesfibers.plot.shapes import shapes
from stokesfibers.plot.slice import velocity_slice
from stokesfibers.plot.style import new_axes, save, style
from stokesfibers.plot.sweep import sweep
from stokesfibers.plot.tension import tension
from stokesfibers.plot.theme import DARK, LIGHT, THEMES, dark, on, theme

KINDS: dict[str, Callable[..., Any]] = {
    "shapes": shapes,
    "panels": shape_panels,
    "tension": tension,
    "stress": stress,
    "energy": energy,
    "health": health,
    "3d": perspective,
    "orientation": orientation,
    "order": order,
    "curvature": curvature,
    "end_to_end": end_to_end,
}
"""Kinds of figure of the command ``plot``, each a function of the run.

Its kinds ``slice`` and ``averages`` are not among them: there is something to compute first. The
name of a scalar observable is a kind too, drawn by `series`.
"""

__all__ = [
    "DARK",
    "KINDS",
    "LIGHT",
    "THEMES",
    "Averaged",
    "Plane",
    "averages",
    "curvature",
    "dark",
    "distribution",
    "end_to_end",
    "energy",
    "health",
    "new_axes",
    "on",
    "order",
    "orientation",
    "perspective",
    "plane_of",
    "save",
    "series",
    "shape_panels",
    "shapes",
    "stress",
    "style",
    "sweep",
    "tension",
    "theme",
    "velocity_slice",
]
