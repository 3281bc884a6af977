"""``stokesfibers movie``: a movie of a run."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import RUN, quiet_option, run_argument
from stokesfibers.cli.replacing import replacing
from stokesfibers.cli.typed import named_as_typed

if TYPE_CHECKING:
    from stokesfibers.studio.movie import Watch

_TYPED = {
    "colour": "--color",
    "from": "--from",
    **{name: f"--{name}" for name in ("fps", "duration", "size", "dpi", "view", "orbit", "series")},
    "workers": "--workers",
}
"""What the film calls them, and the options."""


@click.command(short_help="Write a movie of a run, mp4 or gif.")
@run_argument
@click.argument("out", type=RUN)
@click.option("--fps", type=float, help="Frames per second; by default 25.")
@click.option("--duration", type=float, help="Seconds; by default a frame per record, up to 20 s.")
@click.option("--size", help="Pixels, WIDTHxHEIGHT; by default 1280x720, of a gif 800x450.")
@click.option(
    "--dpi", type=int, help="Pixels per inch: how large text is; by default 150 at 1280x720."
)
@click.option("--color", help="tension (default), curvature, orientation, fiber or none.")
@click.option("--from", "first", type=float, help="Time to begin with.")
@click.option("--to", "last", type=float, help="Time to end with.")
@click.option("--view", help="auto, plane or 3d; auto: plane for a few fibers that stay in one.")
@click.option("--orbit", type=float, help="Degrees that the camera turns, e.g. 90.")
@click.option("--series", help="Observable drawn below, or none; by default energy or N_1.")
@click.option("--dark", is_flag=True, help="Dark ground.")
@click.option("--workers", type=int, help="Processes that draw; by default one for each core.")
@quiet_option
@guarded
def movie(
    *, run: Path, out: Path, size: str | None, dark: bool, quiet: bool, **options: Any
) -> None:
    """Write a movie of the run in the folder RUN to the file OUT, .mp4 or .gif.

    One frame is one record; nothing is interpolated. Record positions more often for a smoother
    one. Below the fibers runs a series with a marker. A file that is there already is replaced.
    """
    from stokesfibers.io.reader import open_run
    from stokesfibers.studio.movie import Film
    from stokesfibers.studio.movie import movie as write

    data = open_run(run)
    given = {("colour" if k == "color" else k): v for k, v in options.items() if v is not None}
    if given.get("colour") == "none":
        given["colour"] = None
    if out.suffix.lower() == ".gif":
        given = {"size": (800, 450), **given}
    if size is not None:
        given["size"] = _size(size)
    with named_as_typed(_TYPED), replacing(out, quiet=quiet):
        film = Film(**given, ground="dark" if dark else "light")
        with _bar(quiet=quiet) as watch:
            write(data, out, film, watch=watch)
        click.echo(out)


def _size(given: str) -> tuple[int, int]:
    from stokesfibers.core.errors import InputError

    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", given)
    if match is None:
        raise InputError("--size", "WIDTHxHEIGHT, e.g. 1280x720", repr(given))
    return int(match[1]), int(match[2])


@contextmanager
def _bar(*, quiet: bool) -> Iterator[Watch | None]:
    """Show a bar of the frames on a terminal."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    with tqdm(unit="frame", dynamic_ncols=True, leave=False, file=sys.stderr) as bar:

        def watch(number: int, count: int) -> None:
            bar.total = count
            bar.update(number - bar.n)

        yield watch
