"""Write the validation tables of the documentation from reports of ``stokesfibers validate``.

    stokesfibers validate --quick --out quick
    stokesfibers validate --full --out full
    python docs/generate/validation.py quick/validation.json full/validation.json

keeps both reports in docs/generated/validation.json and writes docs/generated/validation.md and the
marked region of docs/validation.md. Without arguments both are written again from what is kept.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from stokesfibers.study.validation import tables
from stokesfibers.study.validation.record import GROUPS
from stokesfibers.study.validation.registry import ENTRIES

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / "docs" / "generated" / "validation.json"
RESULTS = KEPT.with_suffix(".md")
PAGE = ROOT / "docs" / "validation.md"
BEGIN, END = "<!-- begin: validation, generated -->", "<!-- end: validation, generated -->"
_HEAD = """\
# Validation results

Every number that `stokesfibers validate` holds the solver against: theirs, ours, the error, what is
allowed, and the verdict. Errors and tolerances are relative, where "theirs" is a number other than
zero. What the entries mean is on the page [Validation](../validation.md).
`python docs/generate/validation.py` writes this page from reports of the command.
"""
_SECTIONS = {
    "full": "Full suite: `stokesfibers validate --full`",
    "quick": "Quick suite: `stokesfibers validate --quick`",
}


def merged(paths: list[Path], kept: dict[str, Any]) -> dict[str, Any]:
    """Return the kept reports with the entries of `paths` in place of older ones of their tier."""
    found, order = dict(kept), [entry.name for entry in ENTRIES]
    for path in paths:
        report = tables.read(path)
        earlier = found.get(report["tier"])
        found[report["tier"]] = tables.joined(report, earlier, order) if earlier else report
    return found


def results(kept: dict[str, Any]) -> str:
    """Return the page of all results: the full suite, then the quick one."""
    parts = [_HEAD]
    for tier, heading in _SECTIONS.items():
        if tier in kept:
            parts.append(f"## {heading}\n\n{tables.as_markdown(kept[tier], level=3, pages='../')}")
    return "\n".join(parts)


def region(kept: dict[str, Any]) -> str:
    """Return the marked region: counts, and for each entry its worst error over what is allowed."""
    lines = []
    for tier, heading in _SECTIONS.items():
        if tier not in kept:
            continue
        report = kept[tier]
        lines += [f"{heading}, {_share(report, tier)}. {tables.summary(report)}", ""]
        lines += ["| entry | what | source | numbers | verdict |", "|---|---|---|---|---|"]
        for group, title in GROUPS.items():
            entries = [entry for entry in report["entries"] if entry["group"] == group]
            lines += [f"| **{title}** | | | | |"] if entries else []
            for one in entries:
                cells = (one["name"], one["title"], one["source"], str(len(one["findings"])))
                shown = [cell.replace("|", "\\|") for cell in (*cells, one["outcome"])]
                lines.append(f"| {' | '.join(shown)} |")
        lines.append("")
    return "\n".join(lines)


def _share(report: dict[str, Any], tier: str) -> str:
    """Return how many of the suite's entries a report holds."""
    whole = [entry for entry in ENTRIES if tier == "full" or entry.tier == "quick"]
    return f"{len(report['entries'])} of its {len(whole)} entries"


def page(text: str, kept: dict[str, Any]) -> str:
    """Return the hand-written page `text` with its marked region written anew."""
    front, _, rest = text.partition(BEGIN)
    _, found, back = rest.partition(END)
    if not found:
        raise SystemExit(f"{PAGE} has no region between {BEGIN} and {END}")
    return f"{front}{BEGIN}\n\n{region(kept)}\n{END}{back}"


def main(arguments: list[str]) -> int:
    """Write the kept reports and both pages."""
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    kept = merged([Path(name) for name in arguments], kept)
    KEPT.parent.mkdir(exist_ok=True)
    KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    RESULTS.write_text(results(kept), encoding="utf-8")
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8"), kept), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
