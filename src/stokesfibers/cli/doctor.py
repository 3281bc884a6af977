"""``stokesfibers doctor``: whether everything works on this machine."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

import click

from stokesfibers.cli.bars import patience
from stokesfibers.cli.failure import DONE, OUR_FAULT, guarded
from stokesfibers.cli.words import duration, heading, lines


@click.command(short_help="Test the installation.")
@guarded
def doctor() -> int:
    """Print versions and machine, and test the solver against an exact answer."""
    from stokesfibers.io.provenance import provenance
    from stokesfibers.run.selftest import TOLERANCE, tension_error

    click.secho("Versions", bold=True)
    lines(provenance()["versions"].items())
    heading("Machine")
    lines(_machine())
    heading("Tests")
    cache, writable = _compiler_cache()
    _say(
        writable,
        f"compiled code is kept in {cache}"
        if writable
        else f"compiled code cannot be kept in {cache}: each start takes some seconds more. "
        "Set NUMBA_CACHE_DIR to a folder you can write to",
    )
    start = perf_counter()
    with patience("  compiling the solver, once after an installation"):
        error = tension_error()
    _say(
        error < TOLERANCE,
        f"the tension of a straight fiber in shear agrees with its exact value, (44), to "
        f"{error:.1e} (must be below {TOLERANCE:g}); took {duration(perf_counter() - start)}",
    )
    return DONE if error < TOLERANCE else OUR_FAULT


def _say(good: bool, text: str) -> None:
    word, colour = ("good", "green") if good else ("bad", "red")
    click.secho(f"  {word}  ", fg=colour, bold=True, nl=False)
    click.echo(text)


def _machine() -> Iterator[tuple[str, ...]]:
    from threadpoolctl import threadpool_info

    yield "system", platform.platform()
    yield "processor", f"{_processor()}, {os.cpu_count()} logical cores"
    for pool in threadpool_info():
        if pool["user_api"] == "blas":
            name = f"{pool['internal_api']} {pool['version']}"
            yield "BLAS", f"{name}, {pool.get('architecture', 'unknown')} kernels"


def _processor() -> str:
    """Return the processor's name; Linux does not tell it through `platform`."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    names = [x.partition(":")[2].strip() for x in text.splitlines() if x.startswith("model name")]
    return names[0] if names else platform.machine()


def _compiler_cache() -> tuple[Path, bool]:
    """Return the folder where numba keeps compiled code, and whether it can be written."""
    from stokesfibers.kernels.slender import evolution_matrix

    folder = Path(evolution_matrix.stats.cache_path or "(no cache)")
    there = next(p for p in (folder, *folder.parents) if p.exists())
    return folder, os.access(there, os.W_OK)
