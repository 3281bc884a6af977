"""Write what ``reproduce`` left into the documentation: studies, and figures of the paper.

    stokesfibers reproduce transition oscillatory concentration length_distribution --out figures
    python docs/generate/reproduced.py figures

copies numbers to docs/generated/NAME.json and pictures to docs/images/NAME.png, and writes the
pages docs/generated/studies.md and docs/generated/figures.md. Without an argument the pages are
written again from what is kept.
"""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
GENERATED, IMAGES = ROOT / "docs" / "generated", ROOT / "docs" / "images"


@dataclass(frozen=True)
class Page:
    """A page of results: its name, what stands before them, and which they are."""

    name: str
    head: str
    results: tuple[str, ...]

    def text(self) -> str:
        """Return the page of what is kept."""
        parts = [f"{self.head}`python docs/generate/reproduced.py` writes this page.\n"]
        for name in self.results:
            numbers = GENERATED / f"{name}.json"
            if numbers.exists():
                summary = json.loads(numbers.read_text(encoding="utf-8"))
                parts.append(
                    f"## {name}: {summary['title']}\n\n`stokesfibers reproduce {name}`\n\n"
                    f"![{summary['title']}](../images/{name}.png)\n\n{table(summary)}\n"
                )
        return "\n".join(parts)


STUDIES = Page(
    "studies",
    """\
# Results of the studies

Every number of the studies on the page [Studies](../studies.md), as `stokesfibers reproduce` gives
them. """,
    (
        "transition",
        "oscillatory",
        "concentration",
        "length_distribution",
        "cloud",
        "ewald",
        "contact",
    ),
)
FIGURES = Page(
    "figures",
    """\
# Figures of the paper

Each figure of Tornberg & Shelley (2004) as `stokesfibers reproduce` draws it, and each number it
states beside ours. What is wrong in print is on the page [Errata](../errata.md); a verdict other
than "agrees" is explained on the page [Validation](../validation.md). Figs. 10 to 13 are of seed 1:
the paper's initial positions are not published.
""",
    (*(f"fig{number:02d}" for number in range(1, 19)), "close_pair"),
)


def kept(folder: Path) -> None:
    """Copy numbers and pictures that are in `folder`."""
    for name in (*STUDIES.results, *FIGURES.results):
        numbers, figure = folder / f"{name}.json", folder / f"{name}.png"
        if not numbers.exists():
            continue
        if json.loads(numbers.read_text(encoding="utf-8"))["quick"]:
            raise SystemExit(f"{numbers} is of the quick tier")
        shutil.copyfile(numbers, GENERATED / f"{name}.json")
        shutil.copyfile(figure, IMAGES / f"{name}.png")


def table(summary: dict[str, Any]) -> str:
    """Return the rows of a study as a Markdown table."""
    lines = ["| quantity | expected | ours | verdict | note |", "|---|---|---|---|---|"]
    for row in summary["rows"]:
        cells = [row["quantity"], _number(row["paper"]), _number(row["ours"])]
        cells += [row["verdict"], row["note"]]
        lines.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join(lines)


def _number(value: float | str | None) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value:.4g}"


def main() -> None:
    """Copy, if there is a folder, and write the pages."""
    if len(sys.argv) > 1:
        kept(Path(sys.argv[1]))
    for page in (STUDIES, FIGURES):
        (GENERATED / f"{page.name}.md").write_text(page.text(), encoding="utf-8")


if __name__ == "__main__":
    main()
