"""A run as a Rerun recording: tubes, cell, colour scale and series, one record after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import MissingExtraError
from stokesfibers.plot.geometry import wrapped
from stokesfibers.plot.style import PALETTE
from stokesfibers.studio.records import Record, RunFacts, facts_of, needs_shapes, records
from stokesfibers.studio.shapes import (
    EDGES,
    cell_box,
    cell_corners,
    tangents,
    tube_triangles,
    tubes,
)
from stokesfibers.studio.view_about import about
from stokesfibers.studio.view_colours import Colouring, colouring
from stokesfibers.studio.view_layout import layout
from stokesfibers.studio.view_look import Look
from stokesfibers.studio.view_series import stored_curves, values_of
from stokesfibers.studio.view_slice import Cut, cuts, log_cuts, speed_scale

if TYPE_CHECKING:
    import xarray as xr

    from stokesfibers.problem.problem import Problem

Floats = NDArray[np.float64]

__all__ = ["APPLICATION", "Look", "Show", "rerun_library", "time_factor", "write_rrd"]

APPLICATION = "stokesfibers"
_SIDES = 8
_MOST_VERTICES = 200_000  # of tubes in one record; beyond, fibers are drawn as thick lines
_LEAST = 0.003  # least visible radius over the size of the scene
_GREY = (130, 130, 130)


def rerun_library() -> Any:
    """Return the package rerun.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        import rerun
        import rerun.blueprint
    except ImportError as error:
        raise MissingExtraError("rerun-sdk", "view", "The viewer") from error
    return rerun


def write_rrd(
    data: xr.DataTree, path: Path, *, name: str, look: Look | None = None
) -> Iterator[int]:
    """Write the run as a recording to the file `path`; yield the number of each record."""
    show = Show.of(data, name, look or Look())
    stream = show.rr.RecordingStream(APPLICATION)
    stream.save(path, default_blueprint=show.blueprint)
    try:
        yield from show.log(stream)
    finally:
        stream.flush()
        stream.disconnect()


@dataclass(frozen=True)
class Show:
    """All that is needed to log a run.

    Attributes
    ----------
    rr
        The package rerun.
    data, name
        The run and what it is called.
    look
        How it is shown.
    facts
        Of the run.
    colours
        How fibers are coloured.
    box : (3, 2)
        Limits of the scene, those of the cell where it is periodic.
    factor
        By what the times of the case are multiplied on the time line.
    problem
        That of the run, if the fluid is shown.
    """

    rr: Any
    data: xr.DataTree
    name: str
    look: Look
    facts: RunFacts
    colours: Colouring
    box: Floats
    factor: float
    problem: Problem | None = None

    @classmethod
    def of(cls, data: xr.DataTree, name: str, look: Look) -> Show:
        """Return how to log the run.

        Raises
        ------
        InputError
            If the run holds no shapes yet, or the look is not possible.
        MissingExtraError
            If rerun is not installed.
        """
        rr = rerun_library()
        needs_shapes(data)
        facts = facts_of(data)
        colours = colouring(data, facts, look.colour, limit=look.limit)
        first = next(records(data, facts))
        box = cell_box(facts.lengths, cls._placed(facts, look, first))
        factor = time_factor(float(facts.times[-1]))
        problem = None if look.fluid is None else look.fluid.problem(data)
        return cls(rr, data, name, look, facts, colours, box, factor, problem)

    @property
    def count(self) -> int:
        """How many parts `log` yields: records, and slices of the fluid."""
        return len(self._shown) + len(self._cut_at)

    @property
    def timeline(self) -> str:
        """Name of the time line: the case's time, times a power of ten if it is tiny or huge."""
        return "time" if self.factor == 1.0 else f"time x {self.factor:.0e}"

    @property
    def blueprint(self) -> Any:
        """How the panels are laid out."""
        return layout(
            self.rr,
            self.data,
            self.box,
            timeline=self.timeline,
            last=float(self.facts.times[-1]) * self.factor,
            fluid=self.look.fluid is not None,
        )

    def log(self, stream: Any) -> Iterator[int]:
        """Log everything to the recording stream; yield the record's number for each part."""
        stream.send_recording_name(self.name)
        self._log_fixed(stream)
        self._log_series(stream)
        for record in records(self.data, self.facts, every=self.look.every):
            self._set_time(stream, record.number)
            self._log_fibers(stream, record)
            if record.number == 0 or self._slides:
                self._log_cell(stream, record, static=not self._slides)
            yield record.number
        yield from self._log_fluid(stream)

    def _set_time(self, stream: Any, record: int) -> None:
        time = float(self.facts.times[record])
        stream.set_time(self.timeline, duration=time * self.factor)
        stream.set_time("record", sequence=record)

    @property
    def _cut_at(self) -> list[int]:
        """Numbers of the records whose fluid is shown."""
        return self.look.fluid.picked(self._shown) if self.look.fluid else []

    @property
    def _shown(self) -> range:
        return range(0, len(self.facts.times), self.look.every)

    def _log_fluid(self, stream: Any) -> Iterator[int]:
        """Compute all velocities, then log them: one scale holds for all."""
        fluid = self.look.fluid
        if fluid is None or self.problem is None:
            return
        made: list[Cut] = []
        for cut in cuts(self.data, fluid, self.problem, self._cut_at):
            made.append(cut)
            yield cut.record
        scale = speed_scale(made, disturbance=fluid.disturbance)
        log_cuts(self.rr, stream, made, scale=scale, at=lambda c: self._set_time(stream, c.record))

    @property
    def _slides(self) -> bool:
        return "strain" in self.data["observables"]

    @property
    def _as_mesh(self) -> bool:
        return self.facts.arclength.size * _SIDES <= _MOST_VERTICES

    def _log_fixed(self, stream: Any) -> None:
        rr = self.rr
        stream.log("space", rr.ViewCoordinates.RIGHT_HAND_Y_UP, static=True)
        shown = [f"**Colour**: {self.colours.said}"]
        if self.look.fluid is not None:
            shown.append(f"**Fluid**: {self.look.fluid.said(self._shown)}")
        stream.log("about", about(rr, self.data, self.name, *shown), static=True)
        picture = self.colours.legend()
        if picture:
            drawn = rr.EncodedImage(contents=picture, media_type="image/png")
            stream.log("legend", drawn, static=True)
        if self._as_mesh:
            fibers, nodes = self.facts.arclength.shape
            triangles = tube_triangles(fibers, nodes, _SIDES)
            fixed = rr.Mesh3D.from_fields(triangle_indices=triangles)
            stream.log("space/fibers", fixed, static=True)

    def _log_series(self, stream: Any) -> None:
        rr = self.rr
        drawn: dict[str, int] = {}
        for curve in stored_curves(self.data):
            number = drawn[curve.panel] = drawn.get(curve.panel, -1) + 1
            red, green, blue = (int(PALETTE[number][k : k + 2], 16) for k in (1, 3, 5))
            line = rr.SeriesLines(names=curve.label, widths=1.5, colors=[red, green, blue])
            stream.log(curve.path, line, static=True)
            for times, values in values_of(self.data, curve):
                when = rr.TimeColumn(self.timeline, duration=times * self.factor)
                stream.send_columns(curve.path, [when], rr.Scalars.columns(scalars=values))

    def _log_fibers(self, stream: Any, record: Record) -> None:
        rr = self.rr
        shape = self._placed(self.facts, self.look, record)
        colours, radius = self.colours.rgba(record), self._radius()
        if self._as_mesh:
            made = tubes(shape, tangents(shape, self.facts.arclength), radius, sides=_SIDES)
            mesh = rr.Mesh3D.from_fields(
                vertex_positions=made.vertices.astype(np.float32),
                vertex_normals=made.normals.astype(np.float32),
                vertex_colors=np.repeat(colours.reshape(-1, 4), _SIDES, axis=0),
            )
            stream.log("space/fibers", mesh)
            return
        strips = np.stack([shape[:, :-1], shape[:, 1:]], axis=2).reshape(-1, 2, 3)
        middle = 0.5 * (radius[:, :-1] + radius[:, 1:])
        lines = rr.LineStrips3D(
            strips.astype(np.float32), radii=middle.ravel(), colors=colours[:, :-1].reshape(-1, 4)
        )
        stream.log("space/fibers", lines)

    def _log_cell(self, stream: Any, record: Record, *, static: bool) -> None:
        lengths = self.facts.lengths
        if not lengths.any():
            return
        corners = cell_corners(self.box, lengths, record.offset)
        edges = self.rr.LineStrips3D(
            corners[EDGES].astype(np.float32),
            radii=0.3 * _LEAST * float(np.max(self.box[:, 1] - self.box[:, 0])),
            colors=[_GREY],
        )
        stream.log("space/cell", edges, static=static)

    def _radius(self) -> Floats:
        least = self.look.least_radius
        if least is None:
            least = _LEAST * float(np.max(self.box[:, 1] - self.box[:, 0]))
        real = self.facts.radius
        thin = np.zeros_like(self.facts.arclength) if real is None else real
        return np.maximum(thin, least)

    @staticmethod
    def _placed(facts: RunFacts, look: Look, record: Record) -> Floats:
        if not look.wrap:
            return record.position
        return wrapped(record.position, facts.lengths, record.offset)


def time_factor(last: float) -> float:
    """Return the power of 1000 that brings a time to between 1e-3 and 1e6, where it is outside.

    The viewer counts nanoseconds: smaller steps would vanish, much longer times overflow.
    """
    if last <= 0.0 or 1e-3 <= last <= 1e6:
        return 1.0
    return 1000.0 ** -np.floor(np.log10(last) / 3.0)
