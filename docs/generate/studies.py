"""Write the results of the studies into the documentation from what ``reproduce`` left.

    stokesfibers reproduce transition oscillatory concentration length_distribution --out figures
    python docs/generate/studies.py figures

copies each study's numbers to docs/generated/NAME.json and its figure to docs/images/NAME.png, and
writes docs/generated/studies.md. Without an argument the page is written again from what is kept.
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
GENERATED, IMAGES = ROOT / "docs" / "generated", ROOT / "docs" / "images"
PAGE = GENERATED / "studies.md"
NAMES = (
    "transition",
    "oscillatory",
    "concentration",
    "length_distribution",
    "cloud",
    "ewald",
    "contact",
)
_HEAD = """\
# Results of the studies

Every number of the studies on the page [Studies](../studies.md), as `stokesfibers reproduce` gives
them. `python docs/generate/studies.py` writes this page.
"""


def kept(folder: Path) -> None:
    """Copy numbers and figures of the studies that are in `folder`."""
    for name in NAMES:
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


def page() -> str:
    """Return the page of what is kept."""
    parts = [_HEAD]
    for name in NAMES:
        numbers = GENERATED / f"{name}.json"
        if numbers.exists():
            summary = json.loads(numbers.read_text(encoding="utf-8"))
            parts.append(
                f"## {summary['title']}\n\n`stokesfibers reproduce {name}`\n\n"
                f"![{summary['title']}](../images/{name}.png)\n\n{table(summary)}\n"
            )
    return "\n".join(parts)


def main() -> None:
    """Copy, if there is a folder, and write the page."""
    if len(sys.argv) > 1:
        kept(Path(sys.argv[1]))
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
