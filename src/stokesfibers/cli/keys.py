"""``stokesfibers keys``: what may stand in a case file and a sweep file, and what is recorded."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import click

from stokesfibers.cli.failure import guarded
from stokesfibers.cli.words import heading

if TYPE_CHECKING:
    from stokesfibers.config.reference import KeyLine, TableForm

_WIDEST = 110
_LISTS = ("fiber", "stop")
_OBSERVABLES, _SWEEP = "observables", "sweep"
Row = tuple[str, str]


@click.command(short_help="Say what a case or a sweep file may hold, and what is recorded.")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@guarded
def keys(*, names: tuple[str, ...]) -> None:
    """Say what each key of the table NAME means, its kinds, units and defaults.

    NAME is a table of the case file, such as flow or initial; one kind of it, such as
    flow.oscillatory_shear; 'sweep' for the sweep file; or 'observables' for what runs record and
    sweeps collect. Without NAME all are listed.
    """
    if not names:
        _say_all()
    for table, kind in map(_checked, names):
        if table == _OBSERVABLES:
            _say_observables()
        elif table == _SWEEP:
            _say_sweep()
        else:
            _say_table(table, kind)


def _checked(name: str) -> tuple[str, str]:
    """Return the table, and what of it `name` asks for: a kind, a table in it, or all, empty."""
    from stokesfibers.config.keys import key_at
    from stokesfibers.config.reference import case_forms
    from stokesfibers.core.errors import InputError
    from stokesfibers.core.tables import did_you_mean
    from stokesfibers.study.sweep_plan import SWEEP_KEYS

    path = name if key_at(name) else name.strip("[]")
    table, _, rest = path.partition(".")
    table = table.partition("[")[0]
    if table in {key.strip("[]") for key in SWEEP_KEYS}:
        return _SWEEP, ""
    forms = case_forms().get(table, ())
    parts = {form.kind for form in forms} | {form.path for form in forms} - {"", table}
    known = ["engine", *case_forms(), _SWEEP, _OBSERVABLES]
    if table in known and rest and not key_at(path) and not {rest, path} & parts:
        kinds = [f"{table}.{form.kind}" for form in forms if form.kind and form.path == table]
        known = [*kinds, *sorted(part for part in parts if "." in part)]
    elif table in known:
        return table, next((part for part in (rest, path) if part in parts), "")
    hint = did_you_mean(name, known)
    raise InputError("NAME", f"one of {', '.join(known)}", repr(name), hint)


def _say_all() -> None:
    from stokesfibers.config.reference import case_forms
    from stokesfibers.study.sweep_plan import SWEEP_KEYS

    heading("Case file")
    rows: list[Row] = [("engine", "spectral, paper")]
    for name, forms in case_forms().items():
        rows.append((f"[{name}]", ", ".join(_within(name, forms))))
    _print(rows)
    heading("Sweep file")
    _print(SWEEP_KEYS.items())
    heading("Observables")
    _print([(where, ", ".join(names)) for where, names in _observables().items()])
    click.echo("\nMore of each: stokesfibers keys NAME, for instance flow, sweep or observables")


def _within(name: str, forms: Iterable[TableForm]) -> Iterator[str]:
    """Yield what tells most of a table: its kinds, or its keys and the tables in it."""
    forms = list(forms)
    own = [form for form in forms if form.path == name]
    if own[0].kind:
        yield from (form.kind for form in own)
        return
    yield from (key.name.partition(" ")[0] for form in own for key in form.keys)
    yield from dict.fromkeys(form.path.rpartition(".")[2] for form in forms if form not in own)


def _say_table(name: str, part: str) -> None:
    from stokesfibers.config.reference import case_forms, engine_line

    if name == "engine":
        heading("Before all tables")
        _print([_row(engine_line())])
        return
    for form in case_forms()[name]:
        if part not in ("", form.kind, form.path):
            continue
        said = f"[{form.path}]" + (f' kind = "{form.kind}"' if form.kind else "")
        if form.path in _LISTS:
            said += f", or [[{form.path}]] for several"
        heading(said + (", if the table is left out" if form.default else ""))
        if form.meaning:
            click.echo(click.wrap_text(form.meaning, _width(), "  ", "  "))
        _print(map(_row, form.keys))


def _row(key: KeyLine) -> Row:
    return key.name, key.meaning


def _say_sweep() -> None:
    from stokesfibers.config.reference import form_of
    from stokesfibers.config.schema import record_schema
    from stokesfibers.study.sweep_collect import Collect
    from stokesfibers.study.sweep_plan import SWEEP_KEYS

    heading("Sweep file")
    _print(SWEEP_KEYS.items())
    heading("[collect]")
    _print(map(_row, form_of("collect", record_schema(Collect)).keys))
    click.echo("\nWhat can be collected: stokesfibers keys observables")


def _observables() -> dict[str, list[str]]:
    from stokesfibers.observe.observables import WHERE

    return {where: [name for name in held if name != "time"] for where, held in WHERE.items()}


def _say_observables() -> None:
    from stokesfibers.core.variables import lookup

    for where, names in _observables().items():
        heading(where[:1].upper() + where[1:])
        rows = []
        for name in names:
            variable = lookup(_OBSERVABLES, name)
            of = ", of each fiber" if "fiber" in variable.dims else ""
            parts = ", components" if {"i", "space"} & {*variable.dims} else ""
            unit = "" if variable.unit == "1" else f" [{variable.unit}]"
            meaning = variable.meaning.replace("$", "")
            rows.append((name, f"{meaning.removesuffix(' of a fiber')}{of}{parts}{unit}"))
        _print(rows)
    click.echo("\nSweeps take largest, smallest and mean of numbers, series and final of all.")


def _print(rows: Iterable[Row]) -> None:
    """Print names and meanings in two columns that fit the terminal."""
    rows = list(rows)
    if not rows:
        return
    formatter = click.HelpFormatter(width=_width())
    formatter.indent()
    formatter.write_dl(rows, col_max=34)
    click.echo(formatter.getvalue(), nl=False)


def _width() -> int:
    return min(shutil.get_terminal_size().columns, _WIDEST)
