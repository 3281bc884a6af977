"""``stokesfibers view``: a run in three dimensions, with a time slider."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import RUN, quiet_option, run_argument
from stokesfibers.cli.typed import named_as_typed

_COLOURS = ("tension", "curvature", "orientation", "fiber")
_TYPED = {
    "color": "--color",
    "limit": "--limit",
    "every": "--every",
    "least_radius": "--least-radius",
    "plane": "--slice",
    "at": "--at",
    "points": "--points",
    "most": "--slices",
}
_OF_SLICE = ("at", "points", "slices", "disturbance", "allow_python")


@click.command(short_help="Look at a run in 3D, with a time slider.")
@run_argument
@click.option(
    "--color",
    "colour",
    type=click.Choice(_COLOURS),
    default="tension",
    show_default=True,
    help="What the colour of the fibers shows.",
)
@click.option("--limit", type=float, help="Where the colours of tension or curvature end.")
@click.option("--every", type=int, default=1, show_default=True, help="Show every N-th record.")
@click.option(
    "--least-radius",
    type=float,
    help="Draw fibers at least this thick; by default 0.3 % of the scene's size.",
)
@click.option(
    "--unwrapped", is_flag=True, help="Show fibers where they went, not in the periodic cell."
)
@click.option(
    "--slice",
    "plane",
    metavar="PLANE",
    help="Show the fluid's velocity in a plane: xy, xz or yz. It is computed; see above.",
)
@click.option("--at", type=float, help="--slice: where the plane cuts the third axis.")
@click.option("--points", type=int, help="--slice: points along the longer side; by default 32.")
@click.option("--slices", type=int, help="--slice: at how many times; by default 20.")
@click.option("--disturbance", is_flag=True, help="--slice: leave out the background flow.")
@click.option(
    "--allow-python", is_flag=True, help="--slice: let the run's flow come from a Python file."
)
@click.option("--web", is_flag=True, help="Serve the viewer for a browser on this machine.")
@click.option("--port", type=click.IntRange(1, 65535), help="--web: port of the page, or 9090.")
@click.option(
    "--data-port", type=click.IntRange(1, 65535), help="Port the data comes from, or 9876."
)
@click.option("--open", "browse", is_flag=True, help="--web: open the page in the browser.")
@click.option("--save", type=RUN, help="Write a recording, .rrd, to be viewed later, and end.")
@click.option("--overwrite", is_flag=True, help="--save: replace a file that exists.")
@quiet_option
@guarded
def view(*, run: Path, save: Path | None, overwrite: bool, quiet: bool, **options: Any) -> None:
    """Show the run in the folder RUN in the Rerun viewer.

    Fibers are tubes of their real radius, with energy, stress, distances, errors and steps beside
    them. The run may still be in progress: what is complete is shown. Needs the extra 'view'.

    A run holds no velocity of the fluid. With --slice it is computed from the shapes and drawn as
    a coloured sheet with arrows, at --slices times spread over those shown. Each takes a fraction
    of a second for tens of fibers and seconds for a thousand, almost whatever --points is. The
    sheet of one time stays until the next; its label tells its time.
    """
    from stokesfibers.cli.bars import bar
    from stokesfibers.studio.view import save_view, view_run

    _refuse_what_does_not_fit(save=save, overwrite=overwrite, **options)
    with named_as_typed(_TYPED), bar("records", quiet=quiet) as moved:
        look = _look(options)
        if save is not None:
            made = save_view(run, save, look=look, overwrite=overwrite, progress=moved)
            if not quiet:
                click.echo(f"{made}\nNext: rerun {made}")
            return

        def ready(page: str) -> None:
            if page:
                click.echo(f"The run is at {page}\nCtrl-C ends it.")
            if page and options["browse"]:
                click.launch(page)

        view_run(
            run,
            look=look,
            web=options["web"],
            port=options["port"],
            data_port=options["data_port"],
            ready=ready,
            progress=moved,
        )


def _look(options: dict[str, Any]) -> Any:
    """Return how the run is shown."""
    from stokesfibers.studio.view_look import Look
    from stokesfibers.studio.view_slice import VelocitySlice

    fluid = None
    if options["plane"] is not None:
        asked = {"plane": "plane", "most": "slices", **{k: k for k in _OF_SLICE if k != "slices"}}
        given = {k: options[typed] for k, typed in asked.items()}
        fluid = VelocitySlice(**{k: v for k, v in given.items() if v is not None})
    return Look(
        colour=options["colour"],
        limit=options["limit"],
        every=options["every"],
        least_radius=options["least_radius"],
        wrap=not options["unwrapped"],
        fluid=fluid,
    )


def _refuse_what_does_not_fit(*, save: Path | None, overwrite: bool, **options: Any) -> None:
    """Refuse options that would have no effect.

    Raises
    ------
    InputError
        If there is one.
    """
    from stokesfibers.core.errors import InputError

    if save is not None and options["web"]:
        raise InputError("--save", "--save or --web", "both")
    if overwrite and save is None:
        raise InputError("--overwrite", "--save", "nothing to write")
    for name, given in (("--port", options["port"]), ("--open", options["browse"] or None)):
        if given is not None and not options["web"]:
            raise InputError(name, "--web", "no --web")
    for name in _OF_SLICE:
        given = options[name] is not None and options[name] is not False  # 0 is given
        if options["plane"] is None and given:
            raise InputError("--" + name.replace("_", "-"), "--slice", "no --slice")
    if save is not None and options["data_port"] is not None:
        raise InputError("--data-port", "a viewer", "--save, which opens none")
