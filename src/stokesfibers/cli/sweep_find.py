"""``stokesfibers sweep find``: the run of one case of a sweep, by its values."""

from __future__ import annotations

from pathlib import Path

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import folder_argument
from stokesfibers.cli.sweep_held import held_dataset, stay_at
from stokesfibers.cli.typed import named_as_typed
from stokesfibers.cli.words import plain


@click.command("find", short_help="Print the run of one case: sweep find DIR NAME=VALUE ...")
@folder_argument
@click.argument("values", nargs=-1, metavar="NAME=VALUE...")
@guarded
def find(*, folder: Path, values: tuple[str, ...]) -> None:
    """Print the path of one run of the sweep in the folder DIR, that of the nearest values.

    \b
    For any command that takes a run, such as
    stokesfibers plot $(stokesfibers sweep find DIR mu_bar=2e5 slenderness=1e-3) shapes
    """
    from stokesfibers.core.errors import InputError
    from stokesfibers.plot.sweep_select import stay

    data = held_dataset(folder)
    swept = list(map(str, data["run"].dims))
    with named_as_typed({"at": "NAME=VALUE"}):
        one, _ = stay(data, swept, dict(map(stay_at, values)))
    one = one.squeeze([d for d in swept if d in one.dims and one.sizes[d] == 1])
    left = [d for d in swept if d in one.dims]
    if left:
        raise InputError("NAME=VALUE", "a value of each parameter", f"none of {', '.join(left)}")
    held = {str(name): value.item() for name, value in one.coords.items() if not value.ndim}
    known = {  # a NaN is left out, and so is what follows from the rest
        name: value
        for name, value in held.items()
        if value == value and "derived" not in one[name].attrs
    }
    said = ", ".join(f"{name} = {plain(value)}" for name, value in known.items())
    path = folder / one["run"].to_numpy().ravel()[0]
    if not path.exists():
        got = f"{said}, which waits"
        raise InputError("NAME=VALUE", "a case that has begun", got, "Run the sweep first.")
    click.echo(path)
    click.echo(f"It has {said}." if said else "It is the only case.", err=True)
