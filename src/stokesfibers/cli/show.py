"""``stokesfibers show``: what a stored run holds and how it is doing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stokesfibers.cli.failure import BAD_INPUT, DONE, complain, guarded
from stokesfibers.cli.options import run_argument
from stokesfibers.cli.show_averages import average_row, stress_averages
from stokesfibers.cli.words import duration, first_figure, heading, lines, number, plural

if TYPE_CHECKING:
    import xarray as xr

_EXTREMES = {
    "length_error": "largest relative length error",
    "elastic_energy": "largest elastic energy",
    "largest_curvature": "largest curvature",
    "largest_tension": "largest tension",
    "smallest_gap": "smallest gap between surfaces",
    "first_normal_stress_difference": "largest N_1, with its sign",
    "energy_error": "largest error of the power balance",
    "motion_error": "largest distance off the equation of motion",
    "force_error": "largest net elastic force, relative",
}
_COLOURS = {"done": "green", "failed": "red", "interrupted": "yellow", "running": "cyan"}


@click.command(short_help="Say what a run holds and how it ended.")
@run_argument
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@guarded
def show(*, run: Path, as_json: bool) -> int:
    """Say what the run in the folder RUN holds, how it ended, and what to do next.

    It says whether the result can be trusted and why not, and looks at each stored value: what is
    damaged is named, with the times that are lost, and the exit code is 2 then.

    A run in progress can be shown too: what is complete is shown.
    """
    facts = _facts(run)
    code = BAD_INPUT if facts["damaged"] else DONE
    if as_json:
        click.echo(json.dumps(facts, indent=2, allow_nan=False))
        return code
    _say(facts, run)
    _say_damage(facts["damaged"], run)
    return code


def _say(facts: dict[str, Any], run: Path) -> None:
    """Print what the run holds."""
    status = facts["status"]
    click.secho(f"{status['code']} ", fg=_COLOURS.get(status["code"]), bold=True, nl=False)
    click.echo(f"at t = {number(status['time'])} of {number(facts['until'])}: {run}")
    for text in (status["explanation"], status["hint"]):
        if text:
            click.echo(f"  {text.rstrip('.')}.")
    if facts["damaged"]:
        click.secho("damaged", fg="red", bold=True, nl=False)
        click.echo(
            f": values changed or went after the run; {_count(facts['damaged'])}, named below"
        )
    watched = any(e["name"] == "energy_error" for e in facts["extremes"])
    _say_trust(status, watched=watched, damaged=bool(facts["damaged"]))
    heading("Records")
    lines(_record_rows(facts))
    if facts["extremes"]:
        heading("Extremes, over the recorded times")
        lines(
            (e["meaning"], number(e["value"]), f"at t = {e['time']:.6g}") for e in facts["extremes"]
        )
    if facts["averages"]:
        first = facts["averages"][0]
        heading(f"Averages from t = {number(first['after'])} on, with one standard error")
        lines(average_row(a) for a in facts["averages"])
    elif facts["no_averages"]:
        heading("Averages")
        click.echo(f"  none: {facts['no_averages']}")
    heading("Made by")
    lines(_origin_rows(facts["provenance"], facts["resumed"]))
    if not facts["damaged"]:
        click.echo(f"\n{_advice(facts, run)}")


def _say_trust(status: dict[str, Any], *, watched: bool, damaged: bool = False) -> None:
    """Print whether the result can be trusted; runs of older versions, not `watched`, do not know.

    Some of them called each run trusted that they had no doubts about, also one that failed.
    """
    from stokesfibers.core.status import Status

    held = Status.from_dict(status)
    if held.code not in ("done", "interrupted") and held.trust != "doubtful":
        if watched:
            until = "until then" if held.code == "failed" else "so far"
            click.echo(f"  What the run watches of its own error was within limits {until}.")
        return
    if held.trust == "trusted":
        click.secho("trusted", fg="green", bold=True, nl=False)
        when = " when it ended" if damaged else ""
        click.echo(f"{when}: the run watched its own error, and all of it is within limits")
    elif held.trust:
        click.secho("doubtful", fg="yellow", bold=True)
        for reason in held.reasons:
            click.echo(f"  {reason}.")


def _say_damage(damaged: list[dict[str, Any]], run: Path) -> None:
    """Print which values are lost, to standard error."""
    if not damaged:
        return
    complain(f"{run}: {_count(damaged)}. What is lost:")
    for one in damaged:
        first, last = one["records"]
        lost = f"records {first} to {last - 1} of {one['array']}"
        if one["times"] is not None:
            lost += f", t = {number(one['times'][0])} to {number(one['times'][1])}"
        click.echo(f"  {one['chunk']} {one['fault']}: {lost}", err=True)
    click.echo("  All else can be read. Put the files back from a copy if there is one.", err=True)


def _count(damaged: list[dict[str, Any]]) -> str:
    return plural(len(damaged), "damaged chunk")


def _facts(run: Path) -> dict[str, Any]:
    """Return everything the command says, as JSON-ready values."""
    from stokesfibers.flow.period import period_of
    from stokesfibers.io.integrity import damages
    from stokesfibers.io.store import RunStore
    from stokesfibers.run.simulate import stored_case

    store = RunStore.open(run)
    case = stored_case(store)
    attributes, damaged = store.attributes, damages(run)
    numerics, observables = _readable(run, {one.array for one in damaged})
    averages, no_averages = stress_averages(observables, period_of(case["flow"]))
    return {
        "path": str(run),
        "status": store.status,
        "until": case["stepping"]["until"],
        "records": store.lengths,
        "damaged": [asdict(one) for one in damaged],
        "wall_seconds": float(numerics["wall_time"].sum()) if "wall_time" in numerics else 0.0,
        "steps": _steps(numerics),
        "extremes": list(_extremes(observables)),
        "averages": averages,
        "no_averages": no_averages,
        "case": case,
        "provenance": json.loads(attributes["provenance"]),
        "resumed": json.loads(attributes.get("resumed", "[]")),
    }


def _readable(run: Path, lost: set[str]) -> tuple[xr.Dataset, xr.Dataset]:
    """Return numerics and observables, without the arrays that lost something."""
    import xarray as xr

    from stokesfibers.io.reader import open_run

    if any(name.endswith("/time") for name in lost):  # without it the others cannot be placed
        return xr.Dataset(), xr.Dataset()
    data = open_run(run)
    one, other = (
        data[group].to_dataset().drop_vars([n.split("/")[1] for n in lost], errors="ignore")
        for group in ("numerics", "observables")
    )
    return one, other


def _steps(numerics: xr.Dataset) -> dict[str, Any]:
    """Return what the steps were like: their lengths, orders, nodes, and how many were rejected."""
    found: dict[str, Any] = {}
    if not numerics.sizes.get("step", 0):
        return found
    if "rejected" in numerics:
        found["rejected"] = int(numerics["rejected"].sum())
    for name in ("step_size", "order", "nodes", "iterations"):
        if name not in numerics:
            continue  # a run of an older version
        values = numerics[name].to_numpy()
        found[name] = [values.min().item(), values.max().item()]
    return found


def _extremes(observables: xr.Dataset) -> Iterator[dict[str, Any]]:
    import numpy as np

    if not observables.sizes.get("time", 0):  # killed before its first record
        return
    times = observables["time"].to_numpy()
    for name, meaning in _EXTREMES.items():
        if name not in observables:
            continue
        held = observables[name]
        if name == "elastic_energy" and held.sizes["fiber"] > 1:
            held, meaning = held.sum("fiber", skipna=False), f"{meaning}, all fibers"
        values = held.to_numpy().reshape(len(times), -1)
        if not np.isfinite(values).any():
            continue
        place = np.nanargmin(values) if name == "smallest_gap" else np.nanargmax(values)
        yield {
            "name": name,
            "meaning": meaning,
            "value": float(values.flat[place]),
            "time": float(times[place // values.shape[1]]),
        }


def _record_rows(facts: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    records, every = facts["records"], facts["case"]["record"]
    positions = every["positions_every"]
    observables = every.get("observables_every", positions / 10.0)
    yield "positions", str(records["trajectory"]), f"every {number(positions)}"
    yield "observables", str(records["observables"]), f"every {number(observables)}"
    yield (
        "steps",
        str(records["numerics"]),
        f"in {duration(facts['wall_seconds'])}, without recording and checks",
    )
    steps = facts["steps"]
    if steps:
        rejected = f", {steps['rejected']} rejected" if steps["rejected"] else ""
        yield (
            "",
            "",
            f"of length {_span(steps['step_size'])}, order {_span(steps['order'])}{rejected}",
        )
        nodes = f"on {_span(steps['nodes'])} nodes; " if "nodes" in steps else ""
        yield "", "", f"{nodes}iterations {_span(steps['iterations'])}"


def _span(ends: list[float]) -> str:
    low, high = (number(end) for end in ends)
    return low if low == high else f"{low} to {high}"


def _origin_rows(
    provenance: dict[str, Any], resumed: list[dict[str, Any]]
) -> Iterator[tuple[str, ...]]:
    versions = provenance["versions"]
    yield "version", f"stokesfibers {versions['stokesfibers']}, Python {versions['python']}"
    yield "when", provenance["time"]
    yield "command", provenance["command"]
    for one in resumed:
        yield f"from t = {number(one['from_time'])}", one["command"]


def _advice(facts: dict[str, Any], run: Path) -> str:
    code, case = facts["status"]["code"], facts["case"]
    if code == "done":
        fibers = sum(int(group.get("count", 1)) for group in case["fiber"])
        return f"Next: {first_figure(run, fibers, cell=case['domain']['kind'] != 'free')}"
    if code == "running":
        return f"If no process is writing it, it was killed. Go on: stokesfibers resume {run}"
    if code == "interrupted":
        return f"Go on: stokesfibers resume {run}"
    return f"See where it went wrong: stokesfibers plot {run} health"
