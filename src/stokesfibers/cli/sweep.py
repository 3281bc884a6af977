"""``stokesfibers sweep``: run many cases that differ in a few parameters; see how they stand."""

from __future__ import annotations

import json
from pathlib import Path

import click

from stokesfibers.cli.failure import DONE, INTERRUPTED, RUN_FAILED, complain, guarded
from stokesfibers.cli.options import python_option, quiet_option, set_option
from stokesfibers.cli.sweep_words import (
    bar,
    facts,
    say_changes,
    say_doubts,
    say_end,
    say_failures,
    say_plan,
    say_tally,
)
from stokesfibers.cli.words import plural

FOLDER = click.Path(path_type=Path)


class _Sweep(click.Group):
    """``sweep SWEEP.toml`` is ``sweep run SWEEP.toml``."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, *ctx.help_option_names):
            args = ["run", *args]
        return super().parse_args(ctx, args)


@click.group(
    "sweep",
    cls=_Sweep,
    short_help="Run many cases and gather one dataset; see how they stand.",
    options_metavar="",
    subcommand_metavar="SWEEP.toml [OPTIONS] | COMMAND ...",
)
def sweep() -> None:
    """Run many cases that differ in a few parameters, and gather one dataset.

    'stokesfibers sweep SWEEP.toml' runs the sweep file; its options: 'stokesfibers sweep run -h'.
    The same command goes on after Ctrl-C or a kill, and after SWEEP.toml was edited.
    """


@sweep.command("run", short_help="Run a sweep file; the word 'run' may be left out.")
@click.argument("file", metavar="SWEEP.toml", type=FOLDER)
@click.option(
    "--out", type=FOLDER, help="Folder of the sweep; by default the file's name without .toml."
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    help="Processes, by default one per core; 1 needs no Dask. Results do not depend on them.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Run on the Dask cluster with this scheduler, e.g. tcp://10.0.0.1:8786.",
)
@set_option
@click.option("--retry", is_flag=True, help="Try cases that failed for good again.")
@click.option("--dry-run", is_flag=True, help="Check all cases and list them; run nothing.")
@click.option("--netcdf", type=FOLDER, help="Write the dataset to this NetCDF file too.")
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
    from stokesfibers.study.sweep_plan import read_plan
    from stokesfibers.study.sweep_workers import has_dask

    plan = read_plan(file, settings, allow_python=allow_python)
    folder = Path(file.stem) if out is None else out
    if not quiet:
        say_changes(changes(folder, plan), len(plan.cases), folder)
    if dry_run:
        say_plan(plan)
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
    if netcdf is not None:
        data.to_netcdf(netcdf, engine="scipy")
    return _say_how_it_ended(data.attrs, folder, quiet=quiet)


@sweep.command("status", short_help="Say how the cases of a sweep stand.")
@click.argument("folder", metavar="DIR", type=FOLDER)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@guarded
def status(*, folder: Path, as_json: bool) -> None:
    """Say how the cases of the sweep in the folder DIR stand, also while it runs."""
    from stokesfibers.study.sweep_folder import SweepFolder
    from stokesfibers.study.sweep_tally import tally

    held = SweepFolder(folder.resolve())
    plan = held.plan()
    found = tally(held, plan)
    if as_json:
        click.echo(json.dumps(facts(found, held), indent=2, allow_nan=False))
    else:
        say_tally(found, folder, plan.source)


@sweep.command("collect", short_help="Make the dataset of a sweep anew from its runs.")
@click.argument("folder", metavar="DIR", type=FOLDER)
@click.option("--netcdf", type=FOLDER, help="Write the dataset to this NetCDF file too.")
@guarded
def collect(*, folder: Path, netcdf: Path | None) -> None:
    """Make DIR/sweep.zarr anew from the runs in DIR, for instance after a kill."""
    from stokesfibers.study.sweep import collect as gather

    data = gather(folder)
    if netcdf is not None:
        data.to_netcdf(netcdf, engine="scipy")
    done = f"{data.attrs['done']} of {plural(data.attrs['cases'], 'case')}"
    click.echo(f"{folder / 'sweep.zarr'} holds {done}.")


def _say_how_it_ended(attributes: dict[str, int | str], folder: Path, *, quiet: bool) -> int:
    """Print the last lines of a sweep and return the exit code."""
    done, failed, cases = (int(attributes[key]) for key in ("done", "failed", "cases"))
    if attributes["status"] == "interrupted" and done + failed < cases:
        left = f"{done} of {plural(cases, 'case')} done"
        click.echo(f"Interrupted: {left}, kept in {folder}.", err=True)
        click.echo("The same command goes on from here.", err=True)
        return INTERRUPTED
    if failed:
        complain(f"{failed} of {plural(cases, 'case')} failed; the others are in {folder}.")
        say_failures(folder)
    if attributes["doubtful"]:
        say_doubts(int(attributes["doubtful"]), folder)
    if not quiet:
        say_end(done, cases, folder)
    return RUN_FAILED if failed else DONE
