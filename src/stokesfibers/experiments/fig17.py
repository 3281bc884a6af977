"""Fig. 17: error of the sum over images cut off at |p| = 1, and with one or two images more.

The printed "p = 2 added" fits one image more, the nearer one, not |p| <= 2 (errata, item 8).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import xarray as xr

from stokesfibers.experiments import images
from stokesfibers.experiments.base import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

run = images.run
PRINTED = {("cut", 0.9): 6.7, ("one_more", 0.9): 3.4}
"""Largest relative errors that the paper gives, in percent."""
_NOTE = "Range: a factor of two, which other shapes than the paper's make."


def figure(data: xr.Dataset) -> Figure:
    """Draw the errors without and with further images."""
    return images.draw_errors(data, ("cut", "one_more", "cut_at_two"))


def check(data: xr.Dataset) -> Sequence[Row]:
    """Compare with 6.7 and 3.4 %, and rank the cut-off sums."""
    rows = []
    for name in ("cut", "one_more", "other_one_more", "cut_at_two"):
        for line in images.LINES:
            printed = PRINTED.get((name, line))
            more = {} if printed is None else _within_two(printed)
            rows.append(images.error_row(data, name, line, **more))
    for line in images.LINES:
        cut = images.worst(data, "cut", line)
        for name, what in (("one_more", "the nearer of |p| = 2"), ("cut_at_two", "|p| = 2")):
            ratio = images.worst(data, name, line) / cut
            rows.append(
                Row(f"error with {what} over that without, x = {line}", ratio, None, 0.0, 1.0)
            )
    further = images.worst(data, "cut", 0.9) / images.worst(data, "cut", 0.3)
    statement = "largest for x = 0.9"
    rows.append(Row("error of |p| <= 1, x = 0.9 over x = 0.3", further, statement, low=1.0))
    return rows


def _within_two(printed: float) -> dict[str, float | str]:
    return {"paper": printed, "low": 0.5 * printed, "high": 2.0 * printed, "note": _NOTE}
