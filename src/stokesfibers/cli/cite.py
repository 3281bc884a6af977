"""``stokesfibers cite``: what to cite for a case, a run or a sweep."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.kinds import expecting, kind_of
from stokesfibers.cli.options import RUN, python_option, set_option
from stokesfibers.cli.words import heading, lines
from stokesfibers.core.errors import InputError

if TYPE_CHECKING:
    from stokesfibers.problem.problem import Problem


@click.command(short_help="Say what to cite for a case, a run or a sweep.")
@click.argument(
    "source",
    metavar="CASE|RUN|SWEEP",
    type=RUN,
    callback=expecting("case", "run", "sweep"),
)
@set_option
@python_option
@guarded
def cite(*, source: Path, settings: tuple[str, ...], allow_python: bool) -> None:
    """Say where the methods that are used come from, and what to cite.

    CASE is a case file; it may also be a stored run, or a sweep file, whose cases are taken
    together.
    """
    from stokesfibers.studio.report_cite import PAPER, SOFTWARE, methods

    kind = kind_of(source) or "case"
    used = _problems(source, kind, settings, allow_python=allow_python)
    rows = dict.fromkeys(row for problem in used for row in methods(problem))
    names = [name for name, *_ in rows]
    click.secho(f"Methods of this {kind}", bold=True)
    lines(sorted(rows, key=lambda row: names.index(row[0])))
    heading("Please cite the paper and this software")
    click.echo(f"{PAPER}\n\n{SOFTWARE}")


def _problems(
    source: Path, kind: str, settings: tuple[str, ...], *, allow_python: bool
) -> Iterator[Problem]:
    if kind == "run":
        from stokesfibers.io.reader import open_run
        from stokesfibers.problem.tables import problem_from_tables

        if settings:
            raise InputError("--set", "a case file or a sweep file", f"the run {source}", "")
        tables = json.loads(open_run(source).attrs["case"])
        yield problem_from_tables(tables, allow_python=allow_python)
    elif kind == "sweep":
        from stokesfibers.study.sweep_plan import load_case, read_plan

        plan = read_plan(source, settings, allow_python=allow_python)
        for case in plan.cases:
            yield load_case(case, Path(plan.folder), allow_python=allow_python).problem
    else:
        from stokesfibers.config.case import load_case as load_case_file

        yield load_case_file(source, settings, allow_python=allow_python).problem
