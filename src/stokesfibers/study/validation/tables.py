"""A report as markdown, CSV and JSON: quantity, source, theirs, ours, error, tolerance, verdict."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from stokesfibers.core.errors import InputError
from stokesfibers.study.validation.record import GROUPS, Finding
from stokesfibers.study.validation.suite import Report, Result

COLUMNS = ("quantity", "source", "theirs", "ours", "error", "tolerance", "verdict")
FORMAT = 1
"""Version of the JSON; files of another one are refused."""
_FILES = ("validation.md", "validation.csv", "validation.json")
_PAGES = {"errata": "errata.md", "validation": "validation.md"}


def plain(value: object) -> str:
    """Return a value for people: six digits, words as they are, nothing for None."""
    if isinstance(value, bool) or value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float | int) else str(value)


def as_dict(report: Report) -> dict[str, Any]:
    """Return the report as JSON-ready values; a number that is not finite becomes None."""
    return {
        "format": FORMAT,
        "version": report.version,
        "tier": report.tier,
        "counts": report.counts(),
        "entries": [_entry(result) for result in report.results],
    }


def _entry(result: Result) -> dict[str, Any]:
    entry = result.entry
    return {
        "name": entry.name,
        "group": entry.group,
        "title": entry.title,
        "source": entry.source,
        "outcome": result.outcome,
        "problem": result.problem,
        "seconds": round(result.seconds, 1),
        "findings": [_finding(finding) for finding in result.findings],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "quantity": finding.quantity,
        "theirs": _finite(finding.theirs),
        "ours": _finite(finding.ours),
        "error": _finite(finding.error),
        "range": [_finite(finding.low), _finite(finding.high)],
        "tolerance": finding.tolerance,
        "verdict": finding.verdict,
        "explained_in": finding.erratum,
    }


def _finite(value: float | str | None) -> float | str | None:
    if isinstance(value, str) or value is None:
        return value
    return float(value) if isfinite(value) else None


def rows(held: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    """Return the cells of `COLUMNS` for every number of a report's dictionary."""
    for entry in held["entries"]:
        for one in entry["findings"]:
            error = "" if one["error"] is None else f"{one['error']:.2g}"
            yield (
                one["quantity"],
                entry["source"],
                plain(one["theirs"]),
                plain(one["ours"]),
                error,
                one["tolerance"],
                _verdict(one),
            )
        if entry["problem"]:
            what = f"{entry['outcome']}: {entry['problem']}"
            yield (f"all of {entry['name']}", entry["source"], "", "", "", "", what)


def _verdict(one: dict[str, Any]) -> str:
    where = one["explained_in"]
    return f"{one['verdict']} ({where})" if where else one["verdict"]


def as_csv(held: dict[str, Any]) -> str:
    """Return one line per number, with entry and group in front."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(("entry", "group", *COLUMNS))
    for entry in held["entries"]:
        for cells in rows({"entries": [entry]}):
            writer.writerow((entry["name"], entry["group"], *cells))
    return out.getvalue()


def as_markdown(held: dict[str, Any], *, level: int = 2, pages: str | None = None) -> str:
    """Return a table per entry under a heading per group, and the counts in front.

    Parameters
    ----------
    held
        A report's dictionary.
    level
        Of the groups' headings.
    pages
        Folder of the documentation's pages, as links to explanations need it; None for no links.
    """
    parts = [summary(held)]
    for group, heading in GROUPS.items():
        entries = [entry for entry in held["entries"] if entry["group"] == group]
        if entries:
            parts.append(f"{'#' * level} {heading}")
            parts += [table(entry, level=level + 1, pages=pages) for entry in entries]
    return "\n\n".join(parts) + "\n"


def summary(held: dict[str, Any]) -> str:
    """Return how many numbers have each verdict, as a sentence."""
    numbers = ("agrees", "explained", "differs")
    total = sum(held["counts"][name] for name in numbers)
    said = ", ".join(f"{held['counts'][name]} {name}" for name in numbers)
    ends = ", ".join(f"{held['counts'][k]} entries {k}" for k in ("failed", "not run"))
    return (
        f"{total} numbers of {len(held['entries'])} entries, {held['tier']} suite, "
        f"version {held['version']}: {said}; {ends}."
    )


def table(entry: dict[str, Any], *, level: int, pages: str | None = None) -> str:
    """Return the table of one entry under its own heading."""
    columns = [name for name in COLUMNS if name != "source"]
    lines = [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]
    for quantity, _, *cells in rows({"entries": [entry]}):
        shown = [quantity, *cells[:-1], _linked(cells[-1], pages)]
        lines.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in shown)} |")
    heading = f"{'#' * level} {entry['name']}: {entry['title']}"
    return "\n\n".join([heading, f"Source: {entry['source']}.", "\n".join(lines)])


def _linked(verdict: str, pages: str | None) -> str:
    if pages is None:
        return verdict
    for page, file in _PAGES.items():
        verdict = verdict.replace(f"({page}: ", f"([{page}]({pages}{file}): ")
    return verdict


def joined(held: dict[str, Any], earlier: dict[str, Any], order: Sequence[str]) -> dict[str, Any]:
    """Return a report with the entries that only an earlier one of its kind has, in `order`.

    Of another tier or version nothing is taken.
    """
    if any(held[key] != earlier[key] for key in ("tier", "version")):
        return held
    entries = {entry["name"]: entry for entry in (*earlier["entries"], *held["entries"])}
    kept = [entries[name] for name in order if name in entries]
    verdicts = Counter(one["verdict"] for entry in kept for one in entry["findings"])
    outcomes = Counter(entry["outcome"] for entry in kept)
    counts = {name: verdicts[name] for name in ("agrees", "explained", "differs")}
    counts |= {name: outcomes[name] for name in ("failed", "not run")}
    return {**held, "counts": counts, "entries": kept}


def write(report: Report, folder: Path, order: Sequence[str] = ()) -> list[Path]:
    """Write the three files to `folder`, made if missing; return their paths.

    Entries of the earlier report there, named in `order`, are kept if `report` has not got them.
    """
    held, there = as_dict(report), folder / _FILES[-1]
    if order and there.exists():
        held = joined(held, read(there), order)
    folder.mkdir(parents=True, exist_ok=True)
    texts = (
        f"# Validation of stokesfibers\n\n{as_markdown(held)}",
        as_csv(held),
        json.dumps(held, indent=1, allow_nan=False) + "\n",
    )
    paths = [folder / name for name in _FILES]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text, encoding="utf-8")
    return paths


def read(path: Path) -> dict[str, Any]:
    """Return the dictionary of a report that was written as JSON.

    Raises
    ------
    InputError
        If the file is not such a report.
    """
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(str(path), "a validation report", f"no JSON: {error}") from error
    if not isinstance(held, dict) or held.get("format") != FORMAT:
        raise InputError(str(path), f"a validation report of format {FORMAT}", "something else")
    return held
