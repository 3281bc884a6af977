"""A scale of colours in the viewer: values become colours, and the scale a picture."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stokesfibers.plot.style import style

if TYPE_CHECKING:
    from matplotlib.colors import Colormap

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class Scale:
    """Colours of values.

    Attributes
    ----------
    colours
        A map of matplotlib.
    low, high
        Values at its ends; those beyond get the colour of the end.
    label
        Text of the scale, with matplotlib's formulas.
    ends
        Which end is pointed, since values go beyond it: ``"neither"``, ``"max"`` or ``"both"``.
    """

    colours: Colormap
    low: float
    high: float
    label: str
    ends: str = "neither"

    def rgba(self, values: Floats) -> Bytes:
        """Return the colours (..., 4) of values (...); values that are not known get the lowest."""
        table = (255.0 * self.colours(np.linspace(0.0, 1.0, 256)) + 0.5).astype(np.uint8)
        share = np.nan_to_num((values - self.low) / (self.high - self.low))
        index = np.clip(share * len(table), 0, len(table) - 1)
        return table[index.astype(np.intp)]

    def picture(self) -> bytes:
        """Return a picture of the scale as the bytes of a PNG."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize
        from matplotlib.figure import Figure

        out = io.BytesIO()
        with style():
            figure = Figure(figsize=(3.2, 0.55), layout="constrained")
            FigureCanvasAgg(figure)
            drawn = ScalarMappable(Normalize(self.low, self.high), self.colours)
            axes = figure.add_subplot()
            bar = figure.colorbar(drawn, cax=axes, orientation="horizontal", extend=self.ends)
            bar.set_label(self.label)
            bar.outline.set_linewidth(0.4)  # pyright: ignore[reportCallIssue]
            figure.savefig(out, format="png", dpi=220)
        return out.getvalue()
