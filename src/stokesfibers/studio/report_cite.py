"""What to cite for a case: the sources of its methods, the paper and this software."""

from __future__ import annotations

from stokesfibers.core.version import __version__
from stokesfibers.problem.engine import PaperEngine
from stokesfibers.problem.problem import Problem
from stokesfibers.slender.mobility import NonLocal

PAPER = """\
@article{TornbergShelley2004,
  author  = {Tornberg, Anna-Karin and Shelley, Michael J.},
  title   = {Simulating the dynamics and interactions of flexible fibers in {S}tokes flows},
  journal = {Journal of Computational Physics},
  volume  = {196},
  pages   = {8--40},
  year    = {2004},
}"""
"""BibTeX of the paper."""
SOFTWARE = f"""\
@software{{stokesfibers,
  author  = {{{{The stokesfibers developers}}}},
  title   = {{stokesfibers: flexible fibers in {{S}}tokes flow}},
  version = {{{__version__}}},
}}"""
"""BibTeX of this software."""


def methods(problem: Problem) -> list[tuple[str, str, str]]:
    """Return what is chosen, which of it, and where it comes from, for each choice of method."""
    mobility = problem.mobility
    rows = [
        ("engine", problem.engine.kind, problem.engine.citation),
        ("mobility", mobility.kind, mobility.citation),
    ]
    chosen = mobility.regularization if isinstance(mobility, NonLocal) else None
    if chosen is not None:
        rows.append(("regularization", chosen.kind, chosen.citation))
    if len(problem.fibers) > 1 or problem.domain.lengths.any():
        if isinstance(problem.engine, PaperEngine):  # the other solves for tensions with positions
            solver = problem.tension_solver
            rows.append(("tensions", solver.kind, solver.citation))
        rows.append(("contact", problem.close_approach.kind, problem.close_approach.citation))
    if problem.domain.lengths.any():
        rows.append(("images", problem.image_sum.kind, problem.image_sum.citation))
    if problem.load.citation:
        rows.append(("load", problem.load.kind, problem.load.citation))
    return rows
