"""``stokesfibers plot``: a figure of a stored run."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import RUN, dark_option, dpi_option, run_argument
from stokesfibers.cli.replacing import replacing
from stokesfibers.cli.typed import named_as_typed

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_NEAR = 0.05  # distance from the plane, in fiber lengths, up to which a fiber is drawn boldly
_PARAMETERS = {
    "time": ("times", "time"),
    "fiber": ("fibers", "fiber"),
    "color": ("colour",),
}
"""What figures call the options that are not called alike; the first takes several values."""
_TYPED = {
    **{name: f"--{name}" for name in ("dpi", "plane", "at", "points", "after", "block")},
    **{name: f"--{option}" for option, names in _PARAMETERS.items() for name in names},
    "path": "--out",
}


@click.command(short_help="Draw a figure of a run.")
@run_argument
@click.argument("kind")
@click.option(
    "--out",
    type=RUN,
    help="File to write, .png, .pdf or .svg; by default RUN-KIND.png beside the run.",
)
@dark_option
@dpi_option
@click.option(
    "--time",
    type=float,
    multiple=True,
    help="Time shown, or the nearest recorded; shapes and the like take several.",
)
@click.option(
    "--fiber", type=int, multiple=True, help="Number of the fiber, from 0; shapes takes several."
)
@click.option("--plane", help="shapes, panels, slice: xy, xz, yz or turned round; by default xy.")
@click.option("--color", help="3d: tension (the default), curvature, orientation or fiber.")
@click.option("--after", type=float, help="averages: from when on; by default the second half.")
@click.option("--block", type=float, help="averages: length of a block in time.")
@click.option("--at", type=float, help="slice: where the plane cuts the third axis.")
@click.option("--points", type=int, help="slice: points along the longer side; by default 200.")
@click.option("--disturbance", is_flag=True, help="slice: leave out the background flow.")
@click.option(
    "--allow-python", is_flag=True, help="slice: let the run's flow come from a Python file."
)
@guarded
def plot(*, run: Path, kind: str, out: Path | None, dark: bool, dpi: int, **options: Any) -> None:
    """Draw a figure of the run in the folder RUN; one that is there already is replaced.

    KIND is shapes (over one another), panels (one for each time), tension, stress, energy,
    3d (a snapshot in the cell), orientation, order (the orientation tensor against time),
    curvature and end_to_end (their distributions), averages (stresses, with error bars),
    slice (the fluid's velocity in a plane), health (length error, curvature, steps and wall
    time), or the name of an observable, such as shear_stress.
    """
    from stokesfibers.io.reader import open_run
    from stokesfibers.plot import DARK, LIGHT, on, save
    from stokesfibers.plot.style import checked_path

    data = open_run(run)
    draw = _drawing(data, kind)
    given = _fitting(kind, draw, options)
    target = out or run.with_name(f"{run.stem}-{kind}.png")
    with named_as_typed(_TYPED), replacing(target), on(DARK if dark else LIGHT):
        checked_path(target)
        click.echo(save(draw(data, **given), target, dpi))


def _kinds() -> dict[str, Callable[..., Any]]:
    from stokesfibers.plot import KINDS

    return {**KINDS, "averages": _averages, "slice": _slice}


def _drawing(data: xr.DataTree, kind: str) -> Callable[..., Any]:
    """Return the function that draws the kind, or the observable of that name."""
    from stokesfibers.core.errors import InputError
    from stokesfibers.core.tables import did_you_mean
    from stokesfibers.plot import select, series

    kinds = _kinds()
    if kind in kinds:
        return kinds[kind]
    if select.has(data, "observables", kind):
        return partial(series, name=kind)
    names = f"one of {', '.join(kinds)}, or the name of an observable of the run"
    known = (*kinds, *data["observables"].to_dataset().data_vars)
    raise InputError("KIND", names, repr(kind), did_you_mean(kind, map(str, known)))


def _fitting(kind: str, draw: Callable[..., Any], options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that were given, by the names the figure has for them.

    Raises
    ------
    InputError
        If the figure does not take one of them, or takes one value only.
    """
    from stokesfibers.core.errors import InputError

    found: dict[str, Any] = {}
    for name, value in options.items():
        # a flag that is not set is False, an option that may come often is (); 0 was given
        if value is None or value is False or value == ():
            continue
        names = _PARAMETERS.get(name, (name,))
        takes = inspect.signature(draw).parameters
        taken = next((n for n in names if n in takes), None)
        where = "--" + name.replace("_", "-")
        if taken is None:
            kinds = [
                k for k, f in _kinds().items() if {*names} & {*inspect.signature(f).parameters}
            ]
            raise InputError(where, f"KIND {' or '.join(kinds)}", f"KIND {kind}")
        found[taken] = value
        if isinstance(value, tuple) and taken != names[0]:
            if len(value) != 1:
                raise InputError(where, f"one value for KIND {kind}", f"{len(value)} of them")
            (found[taken],) = value
    return found


def _averages(data: xr.DataTree, *, after: float | None = None, block: float | None = None) -> Any:
    """Return the axes with averages of the stresses."""
    from stokesfibers.plot import averages
    from stokesfibers.studio.report_averages import run_averages

    return averages(data, run_averages(data, after=after, block=block))


def _slice(
    data: xr.DataTree,
    *,
    time: float | None = None,
    plane: str = "xy",
    at: float | None = None,
    points: int = 200,
    disturbance: bool = False,
    allow_python: bool = False,
) -> Axes:
    """Return the axes with the velocity in a plane; errors as the functions called."""
    import json

    from stokesfibers.plot import plane_of, select, velocity_slice
    from stokesfibers.problem.tables import problem_from_tables
    from stokesfibers.studio.view_slice import plane_velocity

    problem = problem_from_tables(json.loads(data.attrs["case"]), allow_python=allow_python)
    grid = plane_of(data, axes=plane, at=at, time=time, points=points)
    velocity = plane_velocity(data, problem, grid, disturbance=disturbance)
    within = _NEAR * max(fiber.length for fiber in problem.fibers)
    ax = velocity_slice(
        grid.x,
        grid.y,
        grid.components(velocity),
        fibers=grid.fibers,
        within=within,
        axes=plane,
        disturbance=disturbance,
    )
    normal = "xyz"[grid.directions[2]]
    unit = select.unit_text(select.describe(data, "trajectory", "position"))
    ax.set_title(
        f"{select.at_time(data, grid.time)}, ${normal} = {grid.at:.3g}${unit}\n"
        f"thick: fibers within {within:.2g}{unit} of the plane",
        fontsize=7.5,
    )
    return ax
