"""What a run stores, for its fibers and schedule, and one moment of it as records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.core.variables import lookup, registered
from stokesfibers.io.layout import ArrayLayout
from stokesfibers.observe.observables import recorded
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.stepping.report import StepReport

Records = dict[str, Array]
_STAGES = 2


@dataclass(frozen=True)
class OutputPoints:
    """Where along the fibers positions are stored: the nodes, or equally spaced points.

    Attributes
    ----------
    count
        Points per fiber; None for the nodes.
    """

    count: int | None

    def arclength(self, snapshot: Snapshot) -> Array:
        """Return the arclength of the output points, (fiber, node)."""
        if self.count is None:
            return np.stack([f.grid.nodes for f in snapshot.fibers])
        return np.stack([np.linspace(0.0, f.grid.length, self.count) for f in snapshot.fibers])

    def sample(self, snapshot: Snapshot, values: Array) -> Array:
        """Return nodal values (fiber, node, ...) at the output points."""
        if self.count is None:
            return values
        targets = self.arclength(snapshot)
        return np.stack(
            [
                f.grid.interpolate(v, s)
                for f, v, s in zip(snapshot.fibers, values, targets, strict=True)
            ]
        )


def layout(snapshot: Snapshot, points: OutputPoints) -> dict[str, ArrayLayout]:
    """Return the arrays of a run's store, from a first snapshot."""
    arclength = points.arclength(snapshot)
    fibers, nodes = arclength.shape
    arrays = {
        "trajectory/time": ArrayLayout(lookup("trajectory", "time"), ()),
        "trajectory/position": ArrayLayout(lookup("trajectory", "position"), (fibers, nodes, 3)),
        "trajectory/tension": ArrayLayout(lookup("trajectory", "tension"), (fibers, nodes)),
        "trajectory/arclength": ArrayLayout(lookup("trajectory", "arclength"), fixed=arclength),
    }
    for name, values in observable_records(snapshot).items():
        variable = lookup("observables", name.removeprefix("observables/"))
        arrays[name] = ArrayLayout(variable, values.shape[1:])
    for variable in registered("numerics"):
        tail = (_STAGES,) if "stage" in variable.dims else ()
        arrays[f"numerics/{variable.name}"] = ArrayLayout(variable, tail)
    return arrays


def trajectory_records(snapshot: Snapshot, points: OutputPoints) -> Records:
    """Return time, position and tension, with a leading axis of length one."""
    return {
        "trajectory/time": np.array([snapshot.time]),
        "trajectory/position": points.sample(snapshot, snapshot.positions)[None],
        "trajectory/tension": points.sample(snapshot, snapshot.tension)[None],
    }


def observable_records(snapshot: Snapshot) -> Records:
    """Return all observables, with a leading axis of length one."""
    return {f"observables/{name}": f(snapshot)[None] for name, f in recorded(snapshot).items()}


def step_records(reports: list[StepReport]) -> Records:
    """Return the numerics of the steps in `reports`, with the axis ``step`` first."""
    return {
        f"numerics/{v.name}": np.array([getattr(r, v.name) for r in reports], dtype=v.dtype)
        for v in registered("numerics")
    }


def together(records: list[Records]) -> Records:
    """Return records of several moments as one, in their order."""
    return {name: np.concatenate([r[name] for r in records]) for name in records[0]}
