"""``stokesfibers plot``: a figure of a stored run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import RUN, run_argument

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_SLICE = "slice"
_NEAR = 0.05  # distance from the plane, in fiber lengths, up to which a fiber is drawn boldly


@click.command(short_help="Draw a figure of a run.")
@run_argument
@click.argument("kind")
@click.option(
    "--out",
    type=RUN,
    help="File to write, .png, .pdf or .svg; by default RUN-KIND.png beside the run.",
)
@click.option("--time", type=float, help="3d, slice: when; by default the last record.")
@click.option("--plane", help="slice: xy, xz, yz or turned round; by default xy.")
@click.option("--at", type=float, help="slice: where the plane cuts the third axis.")
@click.option("--points", type=int, help="slice: points along the longer side; by default 200.")
@click.option("--disturbance", is_flag=True, help="slice: leave out the background flow.")
@click.option(
    "--allow-python", is_flag=True, help="slice: let the run's flow come from a Python file."
)
@guarded
def plot(*, run: Path, kind: str, out: Path | None, **options: Any) -> None:
    """Draw a figure of the run in the folder RUN.

    KIND is shapes (over one another), panels (one for each time), tension, stress, energy,
    3d (a snapshot in the cell), orientation, order (the orientation tensor against time),
    curvature and end_to_end (their distributions), slice (the fluid's velocity in a plane) or
    health (length error, curvature, steps and wall time).
    """
    from stokesfibers.core.errors import InputError
    from stokesfibers.io.reader import open_run
    from stokesfibers.plot import KINDS, save

    if kind not in (*KINDS, _SLICE):
        raise InputError("KIND", f"one of {', '.join((*KINDS, _SLICE))}", repr(kind))
    # a flag that is not set is False; 0 is a number that was given
    given = {name: v for name, v in options.items() if v is not None and v is not False}
    for name in given:
        fitting = (_SLICE, "3d") if name == "time" else (_SLICE,)
        if kind not in fitting:
            where = "--" + name.replace("_", "-")
            raise InputError(where, f"KIND {' or '.join(fitting)}", f"KIND {kind}")
    target = out or run.with_name(f"{run.stem}-{kind}.png")
    data = open_run(run)
    drawn = _slice(data, **given) if kind == _SLICE else KINDS[kind](data, **given)
    click.echo(save(drawn, target))


def _slice(
    data: xr.DataTree,
    *,
    disturbance: bool = False,
    allow_python: bool = False,
    plane: str = "xy",
    **choice: Any,
) -> Axes:
    """Return the axes with the velocity in a plane; errors as the functions called."""
    import json

    from stokesfibers.plot import plane_of, velocity_slice
    from stokesfibers.problem.tables import problem_from_tables
    from stokesfibers.run.velocity import velocity_from_run

    problem = problem_from_tables(json.loads(data.attrs["case"]), allow_python=allow_python)
    grid = plane_of(data, axes=plane, **choice)
    velocity = velocity_from_run(data, grid.points, time=grid.time, problem=problem)
    if disturbance:
        velocity = velocity - problem.flow.velocity(grid.points, grid.time)
    within = _NEAR * max(fiber.length for fiber in problem.fibers)
    ax = velocity_slice(
        grid.x,
        grid.y,
        grid.components(velocity),
        fibers=grid.fibers,
        within=within,
        axes=plane,
    )
    normal = "xyz"[grid.directions[2]]
    what = "disturbance velocity" if disturbance else "fluid velocity"
    ax.set_title(
        f"{what}, $t = {grid.time:.6g}$, ${normal} = {grid.at:.3g}$\n"
        f"bold: fibers within {within:.2g} of the plane",
        fontsize=7.5,
    )
    return ax
