"""``stokesfibers export``: a run in the formats of other tools."""

from __future__ import annotations

from pathlib import Path

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import RUN, quiet_option, run_argument


@click.command(short_help="Write a run for ParaView, netCDF readers, spreadsheets or Rerun.")
@run_argument
@click.option("--vtk", type=RUN, help="Folder for VTK files: open fibers.pvd in ParaView.")
@click.option("--netcdf", type=RUN, help="File for the whole run as netCDF-4.")
@click.option("--csv", type=RUN, help="Folder for tables.")
@click.option("--rrd", type=RUN, help="File for a recording of the Rerun viewer.")
@click.option(
    "--wrap", is_flag=True, help="--vtk: move whole fibers into the periodic cell of their time."
)
@click.option(
    "--every",
    type=int,
    default=1,
    show_default=True,
    help="Write every N-th recorded shape (netCDF holds all).",
)
@click.option(
    "--overwrite", is_flag=True, help="Replace a file, or a folder that holds only an export."
)
@quiet_option
@guarded
def export(
    *,
    run: Path,
    vtk: Path | None,
    netcdf: Path | None,
    csv: Path | None,
    rrd: Path | None,
    wrap: bool,
    every: int,
    overwrite: bool,
    quiet: bool,
) -> None:
    """Write the run in the folder RUN in one or more other formats.

    All appear when all are whole: after an error nothing is half there. The run may still be in
    progress: what is complete is written.
    """
    from stokesfibers.cli.bars import bar
    from stokesfibers.core.errors import InputError
    from stokesfibers.studio.export import export_run

    if wrap and vtk is None:
        raise InputError("--wrap", "--vtk", "no --vtk", "Other formats hold what is stored.")
    with bar("parts", quiet=quiet) as moved:
        made = export_run(
            run,
            vtk=vtk,
            netcdf=netcdf,
            csv=csv,
            rrd=rrd,
            wrap=wrap,
            every=every,
            overwrite=overwrite,
            progress=None if moved is None else lambda _, done, count: moved(done, count),
        )
    if not quiet:
        for place in made:
            click.echo(place)
        if vtk is not None:
            click.echo(f"Next: paraview {vtk / 'fibers.pvd'}")
