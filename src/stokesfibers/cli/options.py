"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path

import click

from stokesfibers.cli.kinds import expecting

RUN = click.Path(path_type=Path)

case_argument = click.argument("case", type=RUN, callback=expecting("case"))
run_argument = click.argument("run", type=RUN, callback=expecting("run"))
sweep_argument = click.argument("file", metavar="SWEEP.toml", type=RUN, callback=expecting("sweep"))
folder_argument = click.argument("folder", metavar="DIR", type=RUN, callback=expecting("folder"))
set_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="TABLE.KEY=VALUE",
    help="Change a key of the case, e.g. fluid.mu_bar=3e5; may be given several times.",
)
python_option = click.option(
    "--allow-python", is_flag=True, help="Let the case run Python files: of its flow, of its load."
)
quiet_option = click.option(
    "-q", "--quiet", is_flag=True, help="Print nothing but what went wrong."
)
threads_option = click.option(
    "--threads",
    type=click.IntRange(min=1),
    metavar="N",
    help="Threads to use; results do not depend on them.",
)
dark_option = click.option(
    "--dark", is_flag=True, help="Draw on a dark ground, for screens and slides."
)
dpi_option = click.option(
    "--dpi", type=int, default=300, show_default=True, help="Dots per inch of a png."
)
mpi_option = click.option(
    "--mpi/--no-mpi",
    default=None,
    help="Share the work with the other ranks of an MPI launcher; by default if one is found.",
)
processes_option = click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    default=1,
    show_default=True,
    help="Processes that compute independent runs.",
)
