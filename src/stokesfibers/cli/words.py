"""How commands say things: numbers, durations, sizes, aligned lines, warnings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import ceil, isfinite, log10

import click

_DIGITS, _MOST_DIGITS = 4, 7  # of values that differ; more are noise
_DRAWN_FLAT = 4  # fibers that a plane view still tells apart


def heading(text: str) -> None:
    """Print the heading of a block."""
    click.echo()
    click.secho(text, bold=True)


def lines(rows: Iterable[tuple[str, ...]]) -> None:
    """Print rows of cells as aligned columns, indented."""
    rows = list(rows)
    columns = max(map(len, rows), default=0)
    widths = [max((len(r[k]) for r in rows if len(r) > k), default=0) for k in range(columns)]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=False))
        click.echo(f"  {'  '.join(cells)}".rstrip())


def first_figure(run: object, fibers: int, *, cell: bool) -> str:
    """Return the command that draws what tells most of a run at the first look."""
    return f"stokesfibers plot {run} {'3d' if cell or fibers > _DRAWN_FLAT else 'panels'}"


def warn(text: str) -> None:
    """Print one warning to standard error."""
    click.secho("warning: ", fg="yellow", bold=True, nl=False, err=True)
    click.echo(text, err=True)


def duration(seconds: float) -> str:
    """Return a duration for people, e.g. ``"3 min 20 s"``."""
    if seconds < 0.0995:
        return f"{1e3 * seconds:.2g} ms"
    if seconds < 1.0:
        return f"{seconds:.2g} s"
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def size(count: float) -> str:
    """Return a number of bytes for people, e.g. ``"12 MB"``."""
    for unit in ("B", "kB", "MB", "GB"):
        if count < 999.5:
            return f"{count:.3g} {unit}"
        count /= 1e3
    return f"{count:.3g} TB"


def number(value: float) -> str:
    """Return a number with six digits and without needless ones."""
    return f"{value:.6g}"


def plain(value: object) -> str:
    """Return a value of a case file as people write it: no quotes, no needless digits."""
    if isinstance(value, float):
        return number(value)
    if isinstance(value, dict):
        return f"({pairs(value)})"
    if isinstance(value, list):
        return f"({', '.join(map(plain, value))})"
    return str(value).lower() if isinstance(value, bool) else str(value)


def pairs(table: Mapping[str, object]) -> str:
    """Return a table as ``kind, key value, key value``."""
    rest = (f"{key} {plain(value)}" for key, value in table.items() if key not in ("kind", "count"))
    kind = [str(table["kind"])] if "kind" in table else []
    return ", ".join([*kind, *rest]) or "none"


def span(values: Sequence[float]) -> str:
    """Return the least and the largest value, in digits that tell by how much they differ."""
    low, high = min(values), max(values)
    if low == high:
        return number(low)
    apart = (high - low) / max(abs(low), abs(high))
    wanted = ceil(-log10(apart)) + 2 if isfinite(apart) else _DIGITS
    digits = min(max(_DIGITS, wanted), _MOST_DIGITS)
    written = [f"{float(f'{v:.{digits}g}'):.{_MOST_DIGITS}g}" for v in (low, high)]
    return " to ".join(dict.fromkeys(written))


def plural(count: int, what: str) -> str:
    """Return e.g. ``"1 step"`` or ``"3 steps"``."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
