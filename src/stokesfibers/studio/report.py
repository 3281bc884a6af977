"""The report of a run: one HTML page with its numbers, figures and origin, complete in itself."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stokesfibers.core.errors import InputError
from stokesfibers.core.status import Status
from stokesfibers.core.version import __version__
from stokesfibers.io.atomic import write_atomic
from stokesfibers.plot import select
from stokesfibers.problem.problem import Problem
from stokesfibers.studio import report_cite, report_facts
from stokesfibers.studio.report_averages import has_averages, run_averages
from stokesfibers.studio.report_facts import Table, duration, number
from stokesfibers.studio.report_figures import figures
from stokesfibers.studio.report_html import cards, page, table, text, unit, verdict
from stokesfibers.studio.report_toml import toml_text

if TYPE_CHECKING:
    import xarray as xr

_ENDED = {
    "done": "This run is done.",
    "running": "This run is in progress, or was killed.",
    "interrupted": "This run was interrupted and can be resumed.",
    "failed": "This run failed; what it had is kept.",
}


def report(
    data: xr.DataTree, path: str | Path, *, name: str = "run", allow_python: bool = False
) -> Path:
    """Write the report of a run and return its path.

    The page holds its figures and asks for nothing outside; it follows the reader's choice of a
    light or a dark ground, and prints.

    Parameters
    ----------
    data
        The run, from `open_run` or a result.
    path
        File to write, .html; replaced if it exists, once the new one is whole.
    name
        What the run is called.
    allow_python
        Whether a flow from a user's file may run: groups and citations need the flow.

    Raises
    ------
    InputError
        If the file's name does not end in .html or its folder does not exist.
    """
    target = Path(path)
    if target.suffix.lower() not in (".html", ".htm"):
        raise InputError("path", "a file name ending in .html", str(path))
    if not target.parent.is_dir():
        hint = f"Make {target.parent} first."
        raise InputError("path", "a file in a folder that exists", str(path), hint)
    write_atomic(target, report_text(data, name, allow_python=allow_python).encode())
    return target


def report_text(data: xr.DataTree, name: str = "run", *, allow_python: bool = False) -> str:
    """Return the report as HTML; parameters as `report`."""
    case = report_facts.held(data, "case")
    case = case if isinstance(case, dict) else {}
    status = report_facts.status_of(data)
    problem = report_facts.problem_of(case, allow_python=allow_python)
    extremes = list(report_facts.extreme_rows(data))
    steps = list(report_facts.step_rows(data))
    health = (
        (table((), steps, "Steps") if steps else "")
        + (table((), extremes, "Extremes over all records") if extremes else "")
        + _averages(data)
    )
    sections = [
        ("figures", "Figures", f'<div class="figures">{"".join(figures(data))}</div>'),
        ("health", "Health and numbers", health),
        ("case", "Case", _groups(problem, case) + report_facts.case_tables(case)),
        ("origin", "Origin", table((), report_facts.origin_rows(data))),
        ("reproduce", "How to reproduce", _reproduce(data, case, name)),
        ("cite", "How to cite", _cite(problem)),
    ]
    made = datetime.now(UTC).isoformat(timespec="seconds")
    foot = f"<p>Written by stokesfibers {text(__version__)} at {text(made)}.</p>"
    return page(name, _head(data, case, status), sections, foot)


def _head(data: xr.DataTree, case: Table, status: Status | None) -> str:
    watched = report_facts.watched(data)
    return _lead(case) + _verdicts(status, watched=watched) + cards(_cards(data, case, status))


def _lead(case: Table) -> str:
    kinds = [f for f in case.get("fiber", []) if isinstance(f, dict)]
    count = sum(int(fiber.get("count", 1)) for fiber in kinds)
    parts = [f"{count} flexible fiber{'' if count == 1 else 's'}"] if count else []
    for key, words in (("flow", "in {}"), ("domain", "{} domain"), ("load", "load {}")):
        kind = str(case.get(key, {}).get("kind", "none")).replace("_", " ")
        if kind != "none":
            parts.append(words.format(kind))
    engine = case.get("engine")
    parts += [f"{engine} engine"] if engine else []
    return f'<p class="lead">{text(", ".join(parts))}</p>'


def _verdicts(status: Status | None, *, watched: bool) -> str:
    """Say how the run ended and whether its result can be trusted; `watched`: itself."""
    if status is None:
        return verdict("", "How this run ended is not recorded.", ())
    ended = _ENDED.get(status.code, status.code)
    kind = {"done": "good", "failed": "bad", "interrupted": "bad"}.get(status.code, "")
    if status.trust == "doubtful":
        said = "The result is doubtful."
        lines = [str(reason) for reason in status.reasons]
    elif status.trust == "trusted" and status.code in ("done", "interrupted"):
        said = "The result can be trusted, as far as the run has watched itself."
        lines = ["Lengths and balances stayed within their limits (see Health and numbers)."]
    elif watched and status.code == "failed":
        said = "Nothing was beyond its limit until then."
        lines = ["A run that failed is not called trusted all the same: see why it failed."]
    elif watched:
        said = "Nothing has been beyond its limit so far."
        lines = ["Whether the result can be trusted is said when the run ends."]
    else:
        said, lines = "This run did not watch its own balances.", ["Look at the length error."]
    trust = {"trusted": "good", "doubtful": "bad"}.get(status.trust, "")
    return verdict(kind, ended, (status.explanation, status.hint)) + verdict(trust, said, lines)


def _cards(data: xr.DataTree, case: Table, status: Status | None) -> Iterator[tuple[str, str]]:
    if status is not None:
        until = case.get("stepping", {}).get("until")
        short = until and status.time < until
        yield "time", number(status.time) + (f" of {number(until)}" if short else "")
    if select.has(data, "trajectory", "position"):
        sizes = select.read(data, "trajectory", "position").sizes
        yield "fibers", str(sizes["fiber"])
        yield "records", str(sizes["time"])
    if select.has(data, "numerics", "step_size"):
        yield "steps", str(len(select.numbers(data, "numerics", "step_size")))
    for stage, seconds in report_facts.stages(data)[-1:]:
        assert stage
        yield "wall time of the steps", duration(seconds)
    if select.has(data, "observables", "length_error"):
        error = select.numbers(data, "observables", "length_error")
        yield "largest length error", f"{abs(error).max():.2g}".replace("-", "−")


def _averages(data: xr.DataTree) -> str:
    if not has_averages(data):
        return ""
    try:
        found = run_averages(data)
    except InputError:  # its figure says why
        return ""
    rows = [
        (text(one.variable.meaning), text(one.text()), unit(one.variable.unit)) for one in found
    ]
    after = number(found[0].after) if found else ""
    says = f"Averages from t = {after} on, with one standard error from block averages"
    if not all(one.settled for one in found):
        says += "; 'or more': blocks are not independent yet, a longer run would tell"
    return table(("quantity", "mean", "unit"), rows, says) if rows else ""


def _groups(problem: Problem | str, case: Table) -> str:
    if isinstance(problem, str):
        return f"<p>The dimensionless groups are not known here: {text(problem)}</p>"
    until = float(case.get("stepping", {}).get("until", 1.0))
    return table((), report_facts.group_rows(problem, until), "Dimensionless groups")


def _reproduce(data: xr.DataTree, case: Table, name: str) -> str:
    if not case:
        return ""
    python = '"python"' in str(data.attrs.get("case", ""))
    parts = ["<p>Save this as <code>case.toml</code>. It is the case with every default spelled "]
    parts.append("out; results do not depend on the number of threads.</p>")
    if "initial" not in case:
        parts.append(
            "<p>The initial shapes were given in Python and are not part of it: take them from "
            "the first record, as an <code>initial</code> of kind <code>file</code>.</p>"
        )
    leave = " --allow-python" if python else ""
    stem = name.removesuffix(".zarr")
    parts.append(f"<pre>{text(toml_text(case))}</pre>")
    again = f"stokesfibers run case.toml --out {stem}-again.zarr{leave}"
    parts.append(f"<p>Then run:</p><pre>{text(again)}</pre>")
    return "".join(parts)


def _cite(problem: Problem | str) -> str:
    methods: Any = ""
    if isinstance(problem, Problem):
        rows = [tuple(map(text, row)) for row in report_cite.methods(problem)]
        methods = table(("choice", "here", "source"), rows)
    entries = text(f"{report_cite.PAPER}\n\n{report_cite.SOFTWARE}")
    return f"{methods}<p>Please cite the paper and this software:</p><pre>{entries}</pre>"
