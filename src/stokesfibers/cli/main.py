"""The command line. Commands import what they need when they run, so that help is instant."""

from __future__ import annotations

from typing import Any

import click

from stokesfibers.cli.check import check
from stokesfibers.cli.cite import cite
from stokesfibers.cli.doctor import doctor
from stokesfibers.cli.export import export
from stokesfibers.cli.failure import INTERRUPTED, complain
from stokesfibers.cli.keys import keys
from stokesfibers.cli.movie import movie
from stokesfibers.cli.new import new
from stokesfibers.cli.plot import plot
from stokesfibers.cli.ranks import silence_assistants
from stokesfibers.cli.report import report
from stokesfibers.cli.reproduce import reproduce
from stokesfibers.cli.resume import resume
from stokesfibers.cli.run import run
from stokesfibers.cli.schema import schema
from stokesfibers.cli.show import show
from stokesfibers.cli.sweep import sweep
from stokesfibers.cli.validate import validate
from stokesfibers.cli.view import view
from stokesfibers.core.version import __version__

_ORDER = (
    new,
    keys,
    run,
    resume,
    check,
    show,
    plot,
    view,
    movie,
    report,
    export,
    reproduce,
    sweep,
    validate,
    cite,
    doctor,
    schema,
)


class _Commands(click.Group):
    """Lists commands as they are used; Ctrl-C before or behind one ends as it does within one."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(self.commands)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            complain("Interrupted.")
            raise click.exceptions.Exit(INTERRUPTED) from None


@click.group(
    "stokesfibers",
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Exit codes: 0 done, 1 a fault of stokesfibers, 2 the input, 3 the run failed and kept "
    "what it had, 130 interrupted and resumable.",
)
@click.version_option(__version__, prog_name="stokesfibers", message="%(prog)s %(version)s")
@click.pass_context
def main(context: click.Context) -> None:
    """Flexible fibers in Stokes flow: non-local slender body theory, from one TOML file.

    \b
    Try: stokesfibers new buckling
         stokesfibers run buckling.toml
         stokesfibers plot buckling.zarr panels
    """
    silence_assistants(context.invoked_subcommand)


for _command in _ORDER:
    main.add_command(_command)
