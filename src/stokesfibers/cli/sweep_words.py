"""How ``stokesfibers sweep`` says things: progress, tables, failures, what to do next."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stokesfibers.cli.words import duration, heading, lines, number, plural, span, warn

if TYPE_CHECKING:
    import xarray as xr

    from stokesfibers.study.sweep import Change, Watch
    from stokesfibers.study.sweep_axes import Axis
    from stokesfibers.study.sweep_folder import SweepFolder
    from stokesfibers.study.sweep_plan import Plan, SweepCase
    from stokesfibers.study.sweep_tally import Tally

COLOURS = {
    "done": "green",
    "running": "cyan",
    "interrupted": "yellow",
    "waiting": None,
    "failed": "red",
}
_FORM = "{desc} |{bar}| {percentage:3.0f} %{postfix}"
_MOST_LISTED = 12
_MOST_PLANNED = 2
_MOST_LINES = 10
_DOUBT_SECONDS = 5.0
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(\.\d+)?(e[-+]?\d+)?(?!\w)")


@contextmanager
def bar(total: int, *, quiet: bool) -> Iterator[Watch | None]:
    """Show how far a sweep is: a bar on a terminal, else some lines, one per case that failed."""
    if quiet:
        yield None
        return
    if not sys.stderr.isatty():
        yield _line
        return
    from tqdm import tqdm

    with tqdm(total=1.0, leave=False, bar_format=_FORM, dynamic_ncols=True) as shown:

        def show(found: Tally, case: SweepCase | None) -> None:  # noqa: ARG001
            shown.set_description_str(f"{found.count('done')} of {total} done", refresh=False)
            parts = [f", {found.count(c)} {c}" for c in ("running", "failed") if found.count(c)]
            left = found.seconds_left
            parts.append("" if left is None else f", {duration(left)} left")
            shown.postfix = "".join(parts)
            shown.n = found.share
            shown.refresh()

        yield show


def _line(found: Tally, case: SweepCase | None) -> None:
    if case is None:
        return
    state = next(state for held, state in found.states if held.key == case.key)
    ended = found.count("done") + found.count("failed")
    every = -(-found.total // _MOST_LINES)
    if state.code == "done" and ended % every and ended < found.total:
        return
    click.echo(f"[{ended}/{found.total}] {state.code}: {case.name}", err=True)


def say_changes(change: Change, cases: int, folder: Path) -> None:
    """Say what of a sweep is there already, and what is not asked for any more."""
    parts = [f"{change.new} new"]
    if change.kept:
        parts.append(f"{change.kept} kept")
    if change.begun:
        parts.append(f"{change.begun} begun")
    click.echo(f"{plural(cases, 'case')} in {folder}: {', '.join(parts)}.")
    if change.removed:
        count = plural(len(change.removed), "case")
        click.echo(f"{count} of the last sweep not asked for any more: left out, kept on disk.")


def say_plan(plan: Plan) -> None:
    """List the cases of a sweep."""
    heading("Dimensions")
    lines(map(_axis_row, plan.axes))
    heading("Cases")
    rows = [(case.name, f"until {number(case.until)}") for case in plan.cases]
    lines(rows[:_MOST_PLANNED])
    _say_rest(len(rows) - _MOST_PLANNED)


def _axis_row(axis: Axis) -> tuple[str, ...]:
    """Return name, number of values, first and last one, and the paths of a dimension."""
    from stokesfibers.study.sweep_values import word

    (path, *others), ends = axis.paths, (axis.points[0], axis.points[-1])
    values = [point.get(path) for point in ends]
    told = [word(v.get("kind", v) if isinstance(v, dict) else v) for v in values]
    if axis.labels:
        told = [axis.labels[0], axis.labels[-1]]
    span = "" if others and not axis.labels else " to ".join(dict.fromkeys(told))
    return axis.name, str(len(axis.points)), span, ", ".join(axis.paths)


def _say_rest(count: int) -> None:
    if count > 0:
        click.echo(f"  and {count} more")


def say_case_doubts(plan: Plan, *, allow_python: bool) -> None:
    """Print what is doubtful about the cases of a sweep, each doubt once with its cases.

    After some seconds, as suspensions with little room take, the rest are not looked at.
    """
    from stokesfibers.core.errors import InputError
    from stokesfibers.problem.checks import doubts
    from stokesfibers.study.sweep_plan import load_case

    rows: list[tuple[str, str]] = []
    end = time.monotonic() + _DOUBT_SECONDS
    for case in plan.cases:
        if time.monotonic() > end:
            break
        loaded = load_case(case, Path(plan.folder), allow_python=allow_python)
        with suppress(InputError):  # the run will say what is wrong
            rows += [(case.name, str(doubt)) for doubt in doubts(loaded.problem, loaded.plan())]
    _list("Doubtful choices", "yellow", rows, err=True)


def say_tally(found: Tally, folder: Path, source: str) -> None:
    """Print how the cases of a sweep stand."""
    click.secho("running" if found.active else "not running", bold=True, nl=False)
    click.echo(f": {folder}, {plural(found.total, 'case')}, {100.0 * found.share:.0f} % done")
    if found.seconds_left is not None:
        click.echo(f"  about {duration(found.seconds_left)} left")
    heading("Cases")
    for code, colour in COLOURS.items():
        count = found.count(code)
        if count:
            click.echo("  ", nl=False)
            click.secho(f"{count:>5} {code}", fg=colour, nl=code != "done")
            if code == "done":
                doubtful = len(list(found.doubtful()))
                said = f"{doubtful} of them doubtful" if doubtful else "all can be trusted"
                click.echo(f", {said}")
    rows = [
        (case.name, f"t = {number(state.time)} of {number(case.until)}")
        for case, state in found.states
        if state.code in ("running", "interrupted")
    ]
    if rows:
        heading("Under way" if found.active else "Begun")
        lines(rows[:_MOST_LISTED])
    _list_failures(found)
    _list("Doubtful", "yellow", ((case.name, state.doubt) for case, state in found.doubtful()))
    if not found.active and found.count("done") + found.count("failed") < found.total:
        click.echo(f"\nGo on: stokesfibers sweep {source} --out {folder}")


def say_failures(folder: Path) -> None:
    """Print why cases of the sweep in a folder failed."""
    from stokesfibers.study.sweep_folder import SweepFolder
    from stokesfibers.study.sweep_tally import tally

    held = SweepFolder(folder.resolve())
    _list_failures(tally(held, held.plan(), active=False), err=True)


def _list_failures(found: Tally, *, err: bool = False) -> None:
    """Print why cases failed, and what to do."""
    failures = list(found.failures())
    rows = ((f"{case.name} at t = {number(state.time)}", state.reason) for case, state in failures)
    _list("Failed", "red", rows, err=err)
    if any(not state.final for _, state in failures):
        click.echo("  When the cause is mended, run the sweep again.", err=err)


def _list(title: str, colour: str, rows: Iterable[tuple[str, str]], *, err: bool = False) -> None:
    """Print each reason once, with the cases it holds for; rows are of name and reason.

    The same fault comes at another time and place in each case, so numbers tell no reasons apart.
    """
    said: dict[str, list[str]] = {}
    names: dict[str, list[str]] = {}
    for name, reason in rows:
        kind = _NUMBER.sub("#", reason)
        said.setdefault(kind, []).append(reason.rstrip("."))
        names.setdefault(kind, []).append(name)
    if not names:
        return
    click.echo("", err=err)
    click.secho(title, bold=True, err=err)
    for kind, those in names.items():
        click.secho(f"  {said[kind][0]}.", fg=colour, err=err)
        if len(set(said[kind])) > 1:
            click.echo("  The numbers are those of the first.", err=err)
        for name in those[:_MOST_LISTED]:
            click.echo(f"    {name}", err=err)
        if len(those) > _MOST_LISTED:
            click.echo(f"    and {len(those) - _MOST_LISTED} more", err=err)


def say_doubts(doubtful: int, folder: Path) -> None:
    """Print that some results cannot be trusted, and where it stands why."""
    where = f"'stokesfibers sweep status {folder}' says why"
    warn(f"{plural(doubtful, 'result')} cannot be trusted; {where}.")


def say_unsettled(data: xr.Dataset) -> bool:
    """Print how many means over time have not settled; return whether all have."""
    held = [values for name, values in data.items() if str(name).endswith("_mean_settled")]
    means = sum(int(values.notnull().sum()) for values in held)
    unsettled = sum(int((values == 0.0).sum()) for values in held)
    if unsettled:
        warn(f"{unsettled} of {plural(means, 'mean')} over time have not settled: run longer.")
    return unsettled == 0


def say_ranges(data: xr.Dataset) -> str:
    """Print least and largest value of each number that was collected; return the first name."""
    import numpy as np

    from stokesfibers.plot.sweep_select import collected

    rows = []
    for name in collected(data):
        known = data[name].to_numpy()[np.isfinite(data[name].to_numpy())]
        if known.size:
            rows.append((name, span(known.tolist())))
    lines(rows)
    return rows[0][0] if rows else ""


def say_end(done: int, cases: int, folder: Path, name: str, *, trusted: bool) -> None:
    """Say where the dataset is, whether all of it is `trusted`, and how `name` of it is drawn."""
    if not done:
        return
    if done == cases:
        click.secho("done: ", fg="green", bold=True, nl=False)
    count = f"{done} of {plural(cases, 'case')}"
    click.echo(f"{count}, stored in {folder / 'sweep.zarr'}.")
    if trusted:
        click.echo("Each run watched its own error and can be trusted.")
    click.echo(f"Next: stokesfibers sweep plot {folder} {name}".rstrip())
    click.echo(f'In Python: xarray.open_zarr("{folder / "sweep.zarr"}")')


def facts(found: Tally, folder: SweepFolder) -> dict[str, Any]:
    """Return how a sweep stands as JSON-ready values."""
    return {
        "path": str(folder.path),
        "active": found.active,
        "cases": found.total,
        "counts": {code: found.count(code) for code in COLOURS},
        "doubtful": len(list(found.doubtful())),
        "share": found.share,
        "seconds_left": found.seconds_left,
        "states": [
            {
                "name": case.name,
                "values": case.values,
                "status": state.code,
                "time": state.time,
                "until": case.until,
                "reason": state.reason,
                "doubt": state.doubt,
                "run": str(folder.store(case)),
            }
            for case, state in found.states
        ],
    }
