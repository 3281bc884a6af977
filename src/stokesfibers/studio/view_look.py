"""How a run is shown in the viewer."""

from __future__ import annotations

from dataclasses import dataclass

from stokesfibers.core import checks
from stokesfibers.studio.view_slice import VelocitySlice


@dataclass(frozen=True)
class Look:
    """How a run is shown.

    Attributes
    ----------
    colour
        ``"tension"``, ``"curvature"``, ``"orientation"`` or ``"fiber"``.
    limit
        Where the colours of tension or curvature end; by default from the run.
    every
        Show each `every`-th record.
    least_radius
        Fibers are drawn at least this thick [length]; by default 0.3 % of the scene's size.
    wrap
        Whether whole fibers are shifted by periods so that their middles lie in the cell.
    fluid
        A plane in which the fluid's velocity is shown; default none. It is computed.
    """

    colour: str = "tension"
    limit: float | None = None
    every: int = 1
    least_radius: float | None = None
    wrap: bool = True
    fluid: VelocitySlice | None = None

    def __post_init__(self) -> None:
        checks.whole("every", self.every, 1)
        if self.least_radius is not None:
            checks.non_negative("least_radius", self.least_radius)
