"""``stokesfibers sweep``: run many cases that differ in a few parameters; see how they stand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from stokesfibers.cli.failure import DONE, INTERRUPTED, RUN_FAILED, complain, guarded
from stokesfibers.cli.options import (
    RUN,
    folder_argument,
    python_option,
    quiet_option,
    set_option,
    sweep_argument,
)
from stokesfibers.cli.replacing import replacing
from stokesfibers.cli.sweep_cost import say_cost
from stokesfibers.cli.sweep_find import find
from stokesfibers.cli.sweep_groups import say_groups
from stokesfibers.cli.sweep_plot import plot_sweep
from stokesfibers.cli.sweep_words import (
    bar,
    facts,
    say_case_doubts,
    say_changes,
    say_doubts,
    say_end,
    say_failures,
    say_plan,
    say_ranges,
    say_tally,
    say_unsettled,
)
from stokesfibers.cli.words import plural

if TYPE_CHECKING:
    import xarray as xr


class _Sweep(click.Group):
    """``sweep SWEEP.toml`` is ``sweep run SWEEP.toml``, and its help shows the options of both."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(self.commands)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        options = [
            option.get_help_record(ctx)
            for option in self.commands["run"].get_params(ctx)
            if isinstance(option, click.Option)
        ]
        with formatter.section("Options"):
            formatter.write_dl([record for record in options if record])
        self.format_commands(ctx, formatter)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, *ctx.help_option_names):
            args = ["run", *args]
        return super().parse_args(ctx, args)


@click.group(
    "sweep",
    cls=_Sweep,
    short_help="Run many cases and gather one dataset; see how they stand.",
    options_metavar="",
    subcommand_metavar="SWEEP.toml [OPTIONS] | COMMAND DIR [OPTIONS]",
)
def sweep() -> None:
    """Run the cases of the sweep file SWEEP.toml and gather what they give in one dataset.

    All cases are checked before the first one runs. The same command goes on after Ctrl-C or a
    kill, and after SWEEP.toml was edited: what is finished is kept.

    'stokesfibers new sweeps/buckling' writes a sweep file to start from.
    """


netcdf_option = click.option(
    "--netcdf",
    type=RUN,
    help="Write the dataset to this NetCDF file too; one that is there is replaced.",
)


@sweep.command("run", short_help="The same as without 'run': sweep run SWEEP.toml [OPTIONS].")
@sweep_argument
@click.option(
    "--out", type=RUN, help="Folder of the sweep; by default the file's name without .toml."
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes, by default one per core; 1 needs no Dask. Results do not depend on them.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Run on the Dask cluster with this scheduler, e.g. tcp://10.0.0.1:8786.",
)
@set_option
@click.option("--retry", is_flag=True, help="Try cases that failed for good again.")
@click.option(
    "--dry-run", is_flag=True, help="Check all cases, say their groups and cost; run none."
)
@netcdf_option
@python_option
@quiet_option
@guarded
def run_sweep(
    *,
    file: Path,
    out: Path | None,
    workers: int | None,
    scheduler: str | None,
    settings: tuple[str, ...],
    retry: bool,
    dry_run: bool,
    netcdf: Path | None,
    allow_python: bool,
    quiet: bool,
) -> int:
    """Run the cases of the sweep file SWEEP.toml and gather what they give.

    All cases are checked before the first one runs. Ctrl-C stores what there is; the same command
    goes on from there.
    """
    from stokesfibers.study.sweep import changes, sweep
    from stokesfibers.study.sweep_netcdf import check_netcdf
    from stokesfibers.study.sweep_plan import read_plan
    from stokesfibers.study.sweep_workers import has_dask

    plan = read_plan(file, settings, allow_python=allow_python)
    folder = Path(file.stem) if out is None else out
    check_netcdf(netcdf)
    if not quiet:
        say_changes(changes(folder, plan), len(plan.cases), folder)
        say_case_doubts(plan, allow_python=allow_python)
    if dry_run:
        say_plan(plan)
        say_groups(plan, allow_python=allow_python)
        say_cost(plan, workers, here=scheduler is None, allow_python=allow_python)
        return DONE
    if workers is None and scheduler is None and not has_dask() and not quiet:
        click.echo("One process; for one per core: pip install 'stokesfibers[sweep]'.")
    with bar(len(plan.cases), quiet=quiet) as watch:
        data = sweep(
            plan,
            folder,
            workers=workers,
            scheduler=scheduler,
            allow_python=allow_python,
            retry=retry,
            watch=watch,
        )
    code = _say_how_it_ended(data, folder, quiet=quiet)
    _write_netcdf(data, netcdf, quiet=quiet)
    return code


@sweep.command("status", short_help="Say how its cases stand: sweep status DIR [--json].")
@folder_argument
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@guarded
def status(*, folder: Path, as_json: bool) -> None:
    """Say how the cases of the sweep in the folder DIR stand, also while it runs."""
    from stokesfibers.study.sweep_folder import SweepFolder
    from stokesfibers.study.sweep_tally import tally

    plan = SweepFolder(folder).plan()  # errors name the folder as it was typed
    held = SweepFolder(folder.resolve())
    found = tally(held, plan)
    if as_json:
        click.echo(json.dumps(facts(found, held), indent=2, allow_nan=False))
    else:
        say_tally(found, folder, plan.source)


@sweep.command("collect", short_help="Make its dataset anew: sweep collect DIR [--netcdf PATH].")
@folder_argument
@netcdf_option
@guarded
def collect(*, folder: Path, netcdf: Path | None) -> int:
    """Make DIR/sweep.zarr anew from the runs in DIR, for instance after a kill.

    Runs that are damaged by now are named; 'sweep SWEEP.toml --retry' runs them anew.
    """
    from stokesfibers.study.sweep import collect as gather
    from stokesfibers.study.sweep_netcdf import check_netcdf

    check_netcdf(netcdf)
    data = gather(folder)
    done = f"{data.attrs['done']} of {plural(data.attrs['cases'], 'case')}"
    click.echo(f"{folder / 'sweep.zarr'} holds {done}.")
    _write_netcdf(data, netcdf)
    if not data.attrs["failed"]:
        return DONE
    say_failures(folder)
    return RUN_FAILED


def _write_netcdf(data: xr.Dataset, file: Path | None, *, quiet: bool = False) -> None:
    from stokesfibers.study.sweep_netcdf import write_netcdf

    if file is not None:
        with replacing(file, quiet=quiet):
            write_netcdf(data, file)


def _say_how_it_ended(data: xr.Dataset, folder: Path, *, quiet: bool) -> int:
    """Print the last lines of a sweep and return the exit code."""
    attributes = data.attrs
    done, failed, cases = (int(attributes[key]) for key in ("done", "failed", "cases"))
    if attributes["status"] == "interrupted" and done + failed < cases:
        left = f"{done} of {plural(cases, 'case')} done"
        click.echo(f"Interrupted: {left}, kept in {folder}.", err=True)
        click.echo("The same command goes on from here.", err=True)
        return INTERRUPTED
    if failed:
        others = f"; the others are in {folder}" if done else ""
        complain(f"{failed} of {plural(cases, 'case')} failed{others}.")
        say_failures(folder)
    if attributes["doubtful"]:
        say_doubts(int(attributes["doubtful"]), folder)
    settled = say_unsettled(data)
    if not quiet:
        trusted = settled and not (failed or attributes["doubtful"])
        say_end(done, cases, folder, say_ranges(data), trusted=trusted)
    return RUN_FAILED if failed else DONE


sweep.add_command(plot_sweep)
sweep.add_command(find)
