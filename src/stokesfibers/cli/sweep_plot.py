"""``stokesfibers sweep plot``: a figure of what a sweep gave."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import RUN, dark_option, dpi_option, folder_argument
from stokesfibers.cli.replacing import replacing
from stokesfibers.cli.sweep_caption import caption, spread_doubt
from stokesfibers.cli.sweep_held import held_dataset, stay_at
from stokesfibers.cli.typed import named_as_typed
from stokesfibers.cli.words import warn

_TYPED = {
    "name": "NAME",
    "path": "--out",
    **{option: f"--{option}" for option in ("x", "at", "per", "by", "log", "dpi")},
}


@click.command("plot", short_help="Draw what it gave: sweep plot DIR [NAME] [--x DIM] [--at ...].")
@folder_argument
@click.argument("name", required=False)
@click.option("--x", help="Parameter along the axis, or eta; by default the one with most values.")
@click.option(
    "--at",
    multiple=True,
    metavar="NAME=VALUE",
    help="Stay at this value of a parameter, or the nearest; at fiber=0, space=y. May be repeated.",
)
@click.option("--per", metavar="NAME", help="Divide by this parameter, such as mu_bar.")
@click.option(
    "--by",
    metavar="NAME",
    help="Coordinate that names lines or panels, such as flow_strain of an oscillating shear.",
)
@click.option("--log", help="Logarithmic axes: x, y, xy or none; by default as values spread.")
@click.option("--label", help="Text along the vertical axis; formulas in $...$ as in TeX.")
@click.option("--xlabel", help="Text along the horizontal axis.")
@click.option("--legend", help="Text above the legend.")
@click.option(
    "--out",
    type=RUN,
    multiple=True,
    help="File to write, .png, .pdf or .svg, or several; by default DIR-NAME.png beside DIR.",
)
@dark_option
@dpi_option
@guarded
def plot_sweep(
    *,
    folder: Path,
    name: str | None,
    x: str | None,
    at: tuple[str, ...],
    per: str | None,
    by: str | None,
    log: str | None,
    label: str | None,
    xlabel: str | None,
    legend: str | None,
    out: tuple[Path, ...],
    dark: bool,
    dpi: int,
) -> None:
    """Draw the variable NAME of the sweep in the folder DIR against a swept parameter.

    A second parameter gives lines, a third panels; seeds become their mean with one standard error,
    fibers their mean. Series are drawn against time. Results that cannot be trusted are hollow or
    dashed. While the sweep runs, what is there is drawn. A figure that is there already is
    replaced. What all cases have alike is printed, for its caption.

    NAME is a variable of the dataset, such as elastic_energy_largest; without it the first
    number of [collect] is drawn, and the others are named.
    """
    from stokesfibers.plot import DARK, LIGHT, on, save, sweep
    from stokesfibers.plot.style import checked_path
    from stokesfibers.plot.sweep_data import cut
    from stokesfibers.plot.sweep_notes import spread
    from stokesfibers.plot.sweep_select import chosen, drawable, left_of
    from stokesfibers.study.sweep_folder import SweepFolder

    data = held_dataset(folder)
    _, *others = drawable(data) or [""]
    with named_as_typed(_TYPED):
        stays = dict(map(stay_at, at))
        variable, *_ = chosen(data, name, stays)
        beside = folder.resolve().with_name(f"{folder.resolve().name}-{variable}.png")
        targets = tuple(dict.fromkeys(out)) or (beside,)
        with replacing(*targets), on(DARK if dark else LIGHT):
            for target in targets:
                checked_path(target)
            given: dict[str, Any] = {"x": x, "at": stays, "per": per, "by": by}
            texts: dict[str, Any] = {"label": label, "xlabel": xlabel, "legend": legend}
            drawn = sweep(data, variable, log="" if log == "none" else log, **given, **texts)
            if legend and not any(ax.get_legend() for ax in drawn):
                warn("the figure has no legend, and --legend no effect.")
            for target in targets:
                click.echo(save(drawn, target, dpi))
        shown = cut(data, variable, **given)
    plan, cases = SweepFolder(folder).plan(), left_of(data, stays)
    for note in (*shown.notes, *spread_doubt(plan, cases, spread(shown.values))):
        warn(f"{note}.")
    if name is None and others:
        click.echo(f"It shows {variable}; there are also: {', '.join(others)}.", err=True)
    for told in shown.derived(data):
        click.echo(f"{told}.", err=True)
    if shared := caption(plan):
        click.echo(f"In all cases: {shared}.", err=True)
