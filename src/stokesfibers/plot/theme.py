"""Colours on a light or a dark ground: every figure asks for them here and is legible on both.

A theme holds inside ``with on(DARK):`` only; without it figures are for paper. Lines are told apart
by all common kinds of colour blindness: Okabe & Ito's colours on light grounds, the same hues
lifted to a contrast of at least 4.5 on dark ones. Maps of values are even in lightness.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.colors import Colormap

OKABE_ITO = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
    "#000000",
    "#F0E442",
)
"""Told apart by all common kinds of colour blindness; weakest on white last."""


@dataclass(frozen=True)
class Theme:
    """Colours of one kind of ground.

    Attributes
    ----------
    name
        ``"light"`` or ``"dark"``.
    ground
        Background of figure and axes.
    ink
        Text, axes, and the line that counts most.
    faint
        Help lines.
    alarm
        Text that must be seen.
    palette
        Lines, in the order they are taken.
    bands
        Filled bands, the outer one first; as opaque as they look.
    hidden
        Where nothing is known, in a map.
    signed
        Map from negative over zero to positive values.
    growing
        Name of the map from zero to large values, with its ends; large values stand out.
    passing
        Name of the map of times, with its ends.
    pale
        Name of the map that lines are drawn over, with its ends.
    """

    name: str
    ground: str
    ink: str
    faint: str
    alarm: str
    palette: tuple[str, ...]
    bands: tuple[str, str]
    hidden: str
    signed: tuple[str, ...]
    growing: tuple[str, float, float]
    passing: tuple[str, float, float]
    pale: tuple[str, float, float]

    def map_of(self, use: tuple[str, float, float]) -> Colormap:
        """Return the part of a map of matplotlib that `growing`, `passing` or `pale` names."""
        import matplotlib
        from matplotlib.colors import ListedColormap

        name, first, last = use
        return ListedColormap(matplotlib.colormaps[name](np.linspace(first, last, 256)))

    def signed_map(self) -> Colormap:
        """Return the map of values centred at 0: blue below, red above."""
        from matplotlib.colors import LinearSegmentedColormap

        return LinearSegmentedColormap.from_list("signed", self.signed)

    def settings(self) -> dict[str, str]:
        """Return matplotlib's settings of colours."""
        cycle = ", ".join(f"'{c}'" for c in self.palette)
        inked = ("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color")
        grounds = ("figure.facecolor", "axes.facecolor")
        return {
            **dict.fromkeys(inked, self.ink),
            **dict.fromkeys(grounds, self.ground),
            # the figure's own: a dark one stays dark wherever it is saved
            "savefig.facecolor": "auto",
            "axes.prop_cycle": f"cycler('color', [{cycle}])",
        }


LIGHT = Theme(
    name="light",
    ground="#FFFFFF",
    ink="#222222",
    faint="#9A9A9A",
    alarm="#D55E00",
    palette=OKABE_ITO,
    bands=("#CFE3F1", "#8FC1E3"),
    hidden="#BDBDBD",
    signed=("#08408A", "#3C8CCB", "#B9B9B9", "#E8743B", "#A31A0E"),
    growing=("viridis_r", 0.12, 1.0),  # without the lightest part, which is lost on white
    passing=("viridis", 0.0, 0.88),
    pale=("Blues", 0.0, 0.72),
)
"""Paper."""

DARK = Theme(
    name="dark",
    ground="#14171C",
    ink="#E6E6E6",
    faint="#7D838C",
    alarm="#FF9A4D",
    palette=(
        "#4DA8E8",
        "#F58238",
        "#2CC295",
        "#E39BC5",
        "#F0B429",
        "#9AD4F7",
        "#FFFFFF",
        "#F0E442",
    ),
    bands=("#1F3A50", "#2F6590"),
    hidden="#4A4F57",
    signed=("#8FD0FF", "#3F97DB", "#63666B", "#EB7A40", "#FFC09A"),
    growing=("viridis", 0.25, 1.0),
    passing=("viridis", 0.3, 1.0),
    pale=("Blues_r", 0.0, 0.55),
)
"""Screens and slides."""

THEMES = {theme.name: theme for theme in (LIGHT, DARK)}

_held: ContextVar[Theme] = ContextVar("theme", default=LIGHT)


def theme() -> Theme:
    """Return the colours to draw with now."""
    return _held.get()


@contextmanager
def on(ground: Theme) -> Iterator[Theme]:
    """Draw with the colours of `ground` inside a ``with`` block."""
    token = _held.set(ground)
    try:
        yield ground
    finally:
        _held.reset(token)


@contextmanager
def dark() -> Iterator[Theme]:
    """Draw on a dark ground inside a ``with`` block."""
    with on(DARK) as held:
        yield held
