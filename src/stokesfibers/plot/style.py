"""House style of the figures: sizes for a journal column, colours, and saving to a file.

Nothing here touches the global settings of matplotlib: the style holds inside `style()` only,
and figures are made without pyplot, so none stays open behind the caller's back.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN = 3.5
"""Width of one journal column in inches."""
PAGE = 7.2
"""Width of a journal page (two columns) in inches."""
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
"""Okabe-Ito colours, told apart by all common kinds of colour blindness; weakest on white last."""
INK = "#222222"
FAINT = "#9A9A9A"
SUFFIXES = (".png", ".pdf", ".svg")

_SERIF = ("STIXGeneral", "Times New Roman", "Times", "DejaVu Serif")

STYLE: Mapping[Any, Any] = MappingProxyType(
    {
        # The STIX fonts come with matplotlib: text and formulas match, on every machine.
        "font.family": ["STIXGeneral", "serif"],
        "font.serif": list(_SERIF),
        "font.size": 8.0,
        "mathtext.fontset": "stix",
        "text.usetex": False,
        "text.color": INK,
        "figure.facecolor": "white",
        "figure.titlesize": 8.0,
        "axes.facecolor": "white",
        "axes.edgecolor": INK,
        "axes.labelcolor": INK,
        "axes.labelsize": 8.5,
        "axes.titlesize": 8.0,
        "axes.titlepad": 3.0,
        "axes.linewidth": 0.5,
        "axes.grid": False,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.prop_cycle": "cycler('color', [" + ", ".join(f"'{c}'" for c in PALETTE) + "])",
        "axes.formatter.limits": [-3, 4],
        "axes.formatter.use_mathtext": True,
        "xtick.color": INK,
        "ytick.color": INK,
        "xtick.labelsize": 7.5,
        "ytick.labelsize": 7.5,
        "xtick.major.width": 0.5,
        "ytick.major.width": 0.5,
        "xtick.minor.width": 0.35,
        "ytick.minor.width": 0.35,
        "xtick.major.size": 2.5,
        "ytick.major.size": 2.5,
        "xtick.minor.size": 1.5,
        "ytick.minor.size": 1.5,
        "xtick.direction": "out",
        "ytick.direction": "out",
        "lines.linewidth": 1.0,
        "lines.solid_capstyle": "round",
        "lines.solid_joinstyle": "round",
        "legend.fontsize": 7.5,
        "legend.title_fontsize": 7.5,
        "legend.frameon": False,
        "legend.handlelength": 1.6,
        "legend.labelspacing": 0.25,
        "legend.borderaxespad": 0.2,
        "savefig.facecolor": "white",
        # Text stays text: it can be searched, and edited by the journal.
        "svg.fonttype": "none",
        "pdf.fonttype": 42,
        # With the dates left out in `save`, the same data give the same bytes.
        "svg.hashsalt": "stokesfibers",
    }
)
"""Settings of matplotlib that hold inside `style()`."""


@contextmanager
def style() -> Iterator[None]:
    """Hold the house style inside a ``with`` block; the settings before it come back after it."""
    import matplotlib

    with matplotlib.rc_context(dict(STYLE)):
        yield


def new_axes(*, width: float = COLUMN, height: float = 2.3) -> Axes:
    """Return the axes of a new figure in house style that pyplot does not know of.

    Parameters
    ----------
    width, height
        Size of the figure in inches.
    """
    return new_panels(1, 1, width=width, height=height)[0, 0]


def new_panels(
    rows: int, columns: int, *, width: float, height: float, shared_scale: bool = False
) -> NDArray[Any]:
    """Return a (rows, columns) array of axes on one new figure in house style.

    Parameters
    ----------
    rows, columns
        Number of panels down and across.
    width, height
        Size of the figure in inches.
    shared_scale
        Whether all panels share both axes, and sit close though their scales are equal.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    layout = "compressed" if shared_scale else "constrained"
    with style():
        figure = Figure(figsize=(width, height), layout=layout)
        FigureCanvasAgg(figure)
        axes = figure.subplots(
            rows, columns, sharex=shared_scale, sharey=shared_scale, squeeze=False
        )
    return np.asarray(axes, dtype=object)


def time_colours(times: NDArray[np.float64]) -> list[tuple[float, float, float, float]]:
    """Return one colour per time: dark to light with growing time, perceptually uniform.

    The map is viridis without its lightest part, which is lost on white paper.

    Parameters
    ----------
    times : (n,)
    """
    import matplotlib

    first, last = float(np.min(times)), float(np.max(times))
    span = last - first
    where = (times - first) / span if span > 0.0 else np.zeros(len(times))
    viridis = matplotlib.colormaps["viridis"]
    return [viridis(0.88 * float(w)) for w in where]


def save(drawn: Figure | Axes | NDArray[Any], path: str | os.PathLike[str], dpi: int = 200) -> Path:
    """Write a figure to a file and return its path.

    Parameters
    ----------
    drawn
        What a plot function returned: axes or an array of axes; or a figure.
    path
        File to write; its suffix, .png, .pdf or .svg, picks the format. Replaced if it exists.
    dpi
        Dots per inch of a png.

    Raises
    ------
    InputError
        If the suffix is none of these, the folder does not exist, or dpi is not positive.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError("path", f"a file name ending in {', '.join(SUFFIXES)}", str(path))
    if not target.parent.is_dir():
        raise InputError(
            "path", "a file in a folder that exists", str(path), f"Make {target.parent} first."
        )
    if not dpi > 0:
        raise InputError("dpi", "a positive number", dpi)
    no_date = {".png": {}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    with style():
        _figure_of(drawn).savefig(
            target,
            format=suffix[1:],
            dpi=dpi,
            bbox_inches="tight",
            pad_inches=0.03,
            metadata=no_date[suffix],
        )
    return target


def _figure_of(drawn: Figure | Axes | NDArray[Any]) -> Figure:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

    first: Any = drawn.flat[0] if isinstance(drawn, np.ndarray) and drawn.size else drawn
    if not isinstance(first, Artist):
        raise InputError("drawn", "a figure, axes or an array of axes", type(drawn).__name__)
    # Axes of a subfigure lead to the figure in two steps.
    while not isinstance(first, Figure):
        first = first.figure
    return first
