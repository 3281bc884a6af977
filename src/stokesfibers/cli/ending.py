"""What the commands that run say at the end: how it went, where it is, what to do next."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from stokesfibers.cli.failure import DONE, INTERRUPTED, RUN_FAILED, complain
from stokesfibers.cli.words import duration, first_figure, plural, warn
from stokesfibers.io.reader import read_array

if TYPE_CHECKING:
    from stokesfibers.run.simulate import Result


@dataclass(frozen=True)
class Spent:
    """What a command took.

    Attributes
    ----------
    seconds
        From its start on.
    before
        Steps that the run had taken by then.
    """

    seconds: float
    before: int = 0


def say_how_it_ended(result: Result, out: Path, spent: Spent, *, quiet: bool) -> int:
    """Print the last lines of a run stored in `out` and return the exit code."""
    status = result.status
    if status.code == "failed":
        complain(f"{status}.\nWhat there is, is in {out}: stokesfibers show {out}")
        return RUN_FAILED
    if status.code == "interrupted":
        click.echo(f"Interrupted at t = {status.time:.6g}; stored in {out}.", err=True)
        click.echo(f"Go on with: stokesfibers resume {out}", err=True)
        _say_doubts(result)
        return INTERRUPTED
    if not quiet:
        click.secho("done: ", fg="green", bold=True, nl=False)
        click.echo(f"t = {status.time:.6g}, stored in {out}.")
        _say_time(out, spent)
        if status.explanation:
            click.echo(f"{status.explanation}.")
        if status.trust == "trusted":
            click.echo("The run watched its own error and can be trusted.")
    _say_doubts(result)
    if not quiet:
        problem = result.problem
        cell = bool(problem.domain.lengths.any())
        figure = first_figure(out, len(problem.fibers), cell=cell)
        click.echo(f"Next: stokesfibers show {out}, {figure}")
    return DONE


def _say_time(out: Path, spent: Spent) -> None:
    """Print what the steps of this command took, and all of it."""
    steps = read_array(out, "numerics/wall_time")[spent.before :]
    if len(steps):
        each = f"{plural(len(steps), 'step')} in {duration(float(steps.sum()))}"
        rest = "with start, recording and checks of the result"
        click.echo(f"{each}; {duration(spent.seconds)} {rest}.")


def _say_doubts(result: Result) -> None:
    """Say why the run cannot be trusted, also to who asked for quiet: it is what went wrong."""
    reasons = result.status.reasons
    if reasons:
        warn("the run is doubtful.")
    for reason in reasons:
        click.echo(f"  {reason}.", err=True)
