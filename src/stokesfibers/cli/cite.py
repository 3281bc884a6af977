"""``stokesfibers cite``: what to cite for a case."""

from __future__ import annotations

from pathlib import Path

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.options import case_argument, python_option, set_option
from stokesfibers.cli.words import heading, lines
from stokesfibers.core.version import __version__

_PAPER = """\
@article{TornbergShelley2004,
  author  = {Tornberg, Anna-Karin and Shelley, Michael J.},
  title   = {Simulating the dynamics and interactions of flexible fibers in {S}tokes flows},
  journal = {Journal of Computational Physics},
  volume  = {196},
  pages   = {8--40},
  year    = {2004},
}"""
_SOFTWARE = f"""\
@software{{stokesfibers,
  author  = {{{{The stokesfibers developers}}}},
  title   = {{stokesfibers: flexible fibers in {{S}}tokes flow}},
  version = {{{__version__}}},
}}"""


@click.command(short_help="Say what to cite for a case.")
@case_argument
@set_option
@python_option
@guarded
def cite(*, case: Path, settings: tuple[str, ...], allow_python: bool) -> None:
    """Say where the methods that the case file CASE chooses come from, and what to cite."""
    from stokesfibers.config.case import load_case
    from stokesfibers.slender.mobility import NonLocal

    problem = load_case(case, settings, allow_python=allow_python).problem
    mobility = problem.mobility
    rows = [
        ("engine", problem.engine.kind, problem.engine.citation),
        ("mobility", mobility.kind, mobility.citation),
    ]
    chosen = mobility.regularization if isinstance(mobility, NonLocal) else None
    if chosen is not None:
        rows.append(("regularization", chosen.kind, chosen.citation))
    if len(problem.fibers) > 1 or problem.domain.lengths.any():
        rows.append(("tensions", problem.tension_solver.kind, problem.tension_solver.citation))
        rows.append(("contact", problem.close_approach.kind, problem.close_approach.citation))
    if problem.domain.lengths.any():
        rows.append(("images", problem.image_sum.kind, problem.image_sum.citation))
    if problem.load.citation:
        rows.append(("load", problem.load.kind, problem.load.citation))
    click.secho("Methods of this case", bold=True)
    lines(rows)
    heading("Please cite the paper and this software")
    click.echo(f"{_PAPER}\n\n{_SOFTWARE}")
