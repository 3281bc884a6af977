"""What the colour of a fiber can show: tension, curvature, orientation, or which fiber it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.core.variables import Variable
from stokesfibers.plot import geometry, select
from stokesfibers.plot.theme import theme

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.cm import ScalarMappable

Floats = NDArray[np.float64]
Colour = Literal["tension", "curvature", "orientation", "fiber"]

COLOURS: tuple[Colour, ...] = ("tension", "curvature", "orientation", "fiber")
"""What a colour can show, beside None for one colour."""
_ANGLE = Variable(
    "angle", "observables", ("time",), "rad", r"\theta", "angle to the flow direction"
)


@dataclass(frozen=True)
class Paint:
    """Colours of the nodes' values.

    Attributes
    ----------
    kind
        What they show.
    label
        Of the colour bar.
    low, high
        Values at the ends of the map.
    """

    kind: Colour
    label: str
    low: float
    high: float

    def mappable(self) -> ScalarMappable:
        """Return the map in the theme's colours, for a colour bar."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        here = theme()
        colours = here.signed_map() if self.kind == "tension" else here.map_of(here.growing)
        return ScalarMappable(Normalize(self.low, self.high), colours)

    def of_segments(self, values: Floats) -> NDArray[np.float64]:
        """Return colours (fiber * (node - 1), 4) of the segments between nodes with `values`."""
        from matplotlib.colors import to_rgba_array

        middle = 0.5 * (values[:, :-1] + values[:, 1:]).ravel()
        if self.kind == "fiber":
            palette = to_rgba_array(theme().palette)
            return palette[middle.astype(np.intp) % len(palette)]
        return np.asarray(self.mappable().to_rgba(middle), dtype=np.float64)


def checked(colour: str | None) -> Colour | None:
    """Return the colour's name.

    Raises
    ------
    InputError
        If it is not one of `COLOURS` or None.
    """
    for known in COLOURS:
        if colour == known:
            return known
    if colour is None:
        return None
    raise InputError("colour", f"one of {', '.join(COLOURS)}, or none for one colour", repr(colour))


def node_values(kind: Colour, position: Floats, tension: Floats | None) -> Floats:
    """Return what the colour shows at the nodes, (fiber, node).

    Parameters
    ----------
    kind
        One of `COLOURS`.
    position : (fiber, node, 3)
    tension : (fiber, node)
        Needed for ``"tension"`` only.
    """
    if kind == "curvature":
        return geometry.curvature(position)
    if kind == "orientation":
        along = np.gradient(position, axis=1)
        return np.arctan2(np.hypot(along[..., 1], along[..., 2]), np.abs(along[..., 0]))
    if kind == "fiber":
        return np.repeat(
            np.arange(position.shape[0], dtype=np.float64)[:, None], position.shape[1], 1
        )
    assert tension is not None
    return tension


def paint(data: xr.DataTree, kind: Colour, largest: float) -> Paint:
    """Return the colours for values up to `largest` in magnitude.

    Tension is centred at 0 (negative, blue: compressed), curvature begins at 0, and angles to the
    flow direction x always go from 0 to pi / 2.
    """
    top = largest or 1.0
    if kind == "tension":
        label = select.axis_label(select.describe(data, "trajectory", "tension"))
        return Paint(kind, label, -top, top)
    if kind == "curvature":
        most = select.describe(data, "observables", "largest_curvature")
        local = replace(most, name="curvature", symbol=r"\kappa", meaning="curvature")
        return Paint(kind, select.axis_label(local), 0.0, top)
    if kind == "orientation":
        return Paint(kind, select.axis_label(_ANGLE), 0.0, 0.5 * np.pi)
    return Paint(kind, "fiber", 0.0, top)
