"""House style of the figures: sizes for a journal column, colours, and saving to a file.

Nothing here touches the global settings of matplotlib: the style holds inside `style()` only,
and figures are made without pyplot, so none stays open behind the caller's back.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError
from stokesfibers.plot.theme import LIGHT, theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colorbar import Colorbar
    from matplotlib.figure import Figure

COLUMN = 3.5
"""Width of one journal column in inches."""
PAGE = 7.2
"""Width of a journal page (two columns) in inches."""
PALETTE = LIGHT.palette
INK = LIGHT.ink
FAINT = LIGHT.faint
"""Colours on paper, for figures that are made for it; others ask `theme()`."""
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
        "figure.titlesize": 8.0,
        "figure.figsize": (COLUMN, 0.75 * COLUMN),
        "axes.labelsize": 8.5,
        "axes.titlesize": 8.0,
        "axes.titlepad": 3.0,
        "axes.linewidth": 0.5,
        "axes.grid": False,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.formatter.limits": [-3, 4],
        "axes.formatter.use_mathtext": True,
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
        # Text stays text: it can be searched, and edited by the journal.
        "savefig.dpi": 300,
        "svg.fonttype": "none",
        "pdf.fonttype": 42,
        # With the dates left out in `save`, the same data give the same bytes.
        "svg.hashsalt": "stokesfibers",
    }
)
"""Settings of matplotlib that hold inside `style()`, with the colours of the theme."""


@contextmanager
def style() -> Iterator[None]:
    """Hold the house style inside a ``with`` block; the settings before it come back after it."""
    import matplotlib

    settings: dict[Any, Any] = {**STYLE, **theme().settings()}
    with matplotlib.rc_context(settings):
        yield


@contextmanager
def drawing(ax: Axes | None, *, height: float = 2.3) -> Iterator[Axes]:
    """Give the axes to draw on inside the house style: `ax`, or those of a new figure.

    Parameters
    ----------
    ax
        Axes the caller wants drawn on, or None.
    height
        Height of a new figure in inches; its width is a journal column.
    """
    with style():
        yield new_axes(height=height) if ax is None else ax


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
        for ax in axes.flat:
            ink_ticks(ax)
    return np.asarray(axes, dtype=object)


def ink_ticks(ax: Axes) -> None:
    """Give ticks the theme's colour for good: matplotlib makes them only when it draws."""
    ax.tick_params(which="both", color=theme().ink, labelcolor=theme().ink)


def time_colours(
    times: NDArray[np.float64], last: float = 1.0
) -> list[tuple[float, float, float, float]]:
    """Return one colour per time: dark to light with growing time, perceptually uniform.

    The map is viridis without the end that is lost on the ground. A single time has the first
    colour of the palette.

    Parameters
    ----------
    times : (n,)
    last
        How far along the map the last one is.
    """
    from matplotlib.colors import to_rgba

    if len(times) == 1:
        return [to_rgba(theme().palette[0])]
    first = float(np.min(times))
    span = float(np.max(times)) - first
    where = (times - first) / span if span > 0.0 else np.zeros(len(times))
    colours = theme().map_of(theme().passing)
    return [colours(last * float(w)) for w in where]


def colour_bar(ax: Axes, drawn: ScalarMappable, label: str, **options: Any) -> Colorbar:
    """Add a colour bar beside the axes in house style; options are those of matplotlib."""
    options = {"aspect": 25, "pad": 0.02, "shrink": 0.9, **options}
    bar = ax.figure.colorbar(drawn, ax=ax, **options)
    bar.set_label(label)
    bar.outline.set_linewidth(0.4)  # pyright: ignore[reportCallIssue]
    ink_ticks(bar.ax)
    return bar


def save(drawn: Figure | Axes | NDArray[Any], path: str | os.PathLike[str], dpi: int = 300) -> Path:
    """Write a figure to a file and return its path.

    Parameters
    ----------
    drawn
        What a plot function returned: axes or an array of axes; or a figure.
    path
        File to write; its suffix, .png, .pdf or .svg, picks the format. Replaced if it exists, once
        the new one is whole.
    dpi
        Dots per inch of a png.

    Raises
    ------
    InputError
        If the suffix is none of these, the folder does not exist, or dpi is not positive.
    """
    target = checked_path(path)
    if not dpi > 0:
        raise InputError("dpi", "a positive number", dpi)
    part = target.with_name(f".{target.name}.partial")
    try:
        part.write_bytes(rendered(drawn, target.suffix.lower()[1:], dpi))
        os.replace(part, target)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
    return target


def checked_path(path: str | os.PathLike[str]) -> Path:
    """Return the path of a figure that can be written; ask it before a figure is drawn.

    Raises
    ------
    InputError
        If the suffix is none that works, or the folder does not exist.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        hint = "png for screens, pdf and svg for print."
        raise InputError("path", f"a file name ending in {', '.join(SUFFIXES)}", str(path), hint)
    if not target.parent.is_dir():
        hint = f"Make {target.parent} first."
        raise InputError("path", "a file in a folder that exists", str(path), hint)
    if target.is_dir():
        raise InputError("path", "a file", f"{path}, a folder")
    return target


def rendered(
    drawn: Figure | Axes | NDArray[Any], kind: str, dpi: int = 200, *, as_paths: bool = False
) -> bytes:
    """Return a figure as the content of a file of `kind` png, pdf or svg; as `save`.

    With `as_paths` the text of an svg is drawn: it looks alike where the fonts are missing.
    """
    import matplotlib

    no_date = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
    file = BytesIO()
    fonts: dict[Any, Any] = {"svg.fonttype": "path"} if as_paths else {}
    with style(), matplotlib.rc_context(fonts):
        _figure_of(drawn).savefig(
            file,
            format=kind,
            dpi=dpi,
            bbox_inches="tight",
            pad_inches=0.03,
            metadata=no_date[kind],
        )
    return file.getvalue()


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
