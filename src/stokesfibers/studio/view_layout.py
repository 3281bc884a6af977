"""How the panels of the viewer are laid out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.studio.view_series import stored_curves, title

if TYPE_CHECKING:
    import xarray as xr

_FROM = np.array([0.42, 0.36, 1.0])  # direction of the eye: x to the right, y up
_PLAYED_IN = 12.0  # seconds for the whole run
_FAR = 1.1  # its distance over the diagonal of the scene


def layout(
    rr: Any,
    data: xr.DataTree,
    box: NDArray[np.float64],
    *,
    timeline: str,
    last: float,
    fluid: bool = False,
) -> Any:
    """Return the Rerun blueprint: fibers and their scale, series, the text, the time slider.

    Parameters
    ----------
    rr
        The package rerun.
    data
        The stored run.
    box : (3, 2)
        Limits of the scene.
    timeline
        Name of the time line.
    last
        Where it ends.
    fluid
        Whether there is a scale of the fluid's speed beside that of the fibers.
    """
    bp = rr.blueprint
    scales = [_scale(bp, "legend", "colour")]
    if fluid:
        scales.append(_scale(bp, "speed", "fluid"))
    left = bp.Vertical(_space(bp, box), bp.Horizontal(*scales), row_shares=[8, 1])
    titles = {c.panel: title(data, c) for c in reversed(stored_curves(data))}
    panels = [
        bp.TimeSeriesView(
            origin=f"series/{panel}",
            name=text,
            plot_legend=bp.PlotLegend(corner="LeftTop"),
        )
        for panel, text in reversed(titles.items())
    ]
    right = bp.Tabs(
        bp.Grid(*panels, grid_columns=2, name="series"),
        bp.TextDocumentView(origin="about", name="about"),
    )
    return bp.Blueprint(
        bp.Horizontal(left, right, column_shares=[3, 2]),
        bp.TimePanel(
            state="collapsed",
            timeline=timeline,
            loop_mode="all",
            playback_speed=max(last, 1e-3) / _PLAYED_IN,
        ),
        bp.BlueprintPanel(state="collapsed"),
        bp.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _space(bp: Any, box: NDArray[np.float64]) -> Any:
    centre = box.mean(axis=1)
    diagonal = float(np.linalg.norm(box[:, 1] - box[:, 0]))
    eye = centre + _FAR * diagonal * _FROM / np.linalg.norm(_FROM)
    return bp.Spatial3DView(
        origin="space",
        name="fibers",
        background=[255, 255, 255],
        line_grid=False,
        eye_controls=bp.EyeControls3D(
            kind=bp.Eye3DKind.Orbital, position=eye, look_target=centre, eye_up=[0.0, 1.0, 0.0]
        ),
    )


def _scale(bp: Any, origin: str, name: str) -> Any:
    return bp.Spatial2DView(origin=origin, name=name, background=[255, 255, 255])
