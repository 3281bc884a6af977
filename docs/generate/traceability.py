"""Write docs/traceability.md: equation, what it is, functions that hold it, tests that reach them.

python docs/generate/traceability.py           # writes the page
python docs/generate/traceability.py --check   # exit code 1 if the page is old or dangles
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sources
from sources import Definition, Graph

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "traceability.md"
_DATA = ROOT / "docs" / "generate" / "equations.toml"
_MOST_TESTS = 3
_FOLDERS = ("parity", "analytic", "unit", "convergence", "properties", "experiments", "meta")
"""Folders of tests, those that hold formulas against something else first."""
_VAGUE = 4  # names: a test of some part of a file that cites may be of another part
_NAMED = (0, 5, 100)  # names that it counts if the test's file, or the test itself, names it
_HEAD = """\
# Traceability

Every numbered equation of Tornberg & Shelley, J. Comput. Phys. 196 (2004) 8-40, with the functions
whose docstrings cite it and tests that reach them. `python docs/generate/traceability.py` writes
this page from the docstrings; what an equation means is in `docs/generate/equations.toml`. A test
turns red if an equation that the scheme needs has no function or no test, if a number is cited that
the paper does not have, or if this page is old.

Tests that name the equation stand first, then those nearest by name; at most three. "Errata" marks
what is printed wrong or left open; see [the errata](errata.md).
"""


@dataclass(frozen=True)
class Traced:
    """Everything known about citations.

    Attributes
    ----------
    equations
        Of the paper: number to place, meaning, and why nothing is needed.
    references
        Name and year to title and place.
    holders
        Definitions of the package that cite, by equation.
    citing
        Files that cite, by reference.
    tests
        Tests that reach a definition, with the number of names between, by its key.
    named
        Tests that name an equation: 2 in their docstring or name, 1 in that of their file.
    errata
        Numbers that docs/errata.md speaks of.
    """

    equations: dict[str, dict[str, Any]]
    references: dict[str, str]
    holders: dict[str, list[Definition]]
    citing: dict[str, list[str]]
    tests: dict[str, dict[str, int]]
    named: dict[str, dict[str, int]]
    errata: frozenset[str]


def trace() -> Traced:
    """Read the package, its tests and the data."""
    data = tomllib.loads(_DATA.read_text(encoding="utf-8"))
    package, tests = sources.read(ROOT, "src/stokesfibers"), sources.read(ROOT, "tests")
    graph = Graph.of([*package, *tests])
    holders: dict[str, list[Definition]] = defaultdict(list)
    citing: dict[str, list[str]] = defaultdict(list)
    reached: dict[str, dict[str, int]] = {}
    for source in package:
        for reference in sources.references(source.strings):
            citing[reference].append(source.path)
        for one in source.definitions:
            for number in one.equations:
                holders[number].append(one)
            if one.equations:
                reached[one.key] = _reaching(one, source, graph)
    return Traced(
        equations=data["equations"],
        references=data["references"],
        holders=dict(holders),
        citing=dict(citing),
        tests=reached,
        named=_named(tests),
        errata=frozenset(_errata()),
    )


def _reaching(one: Definition, source: sources.Source, graph: Graph) -> dict[str, int]:
    """Return tests that reach a definition, or any part of it, for a module or a class."""
    parts = [one]
    if one.name.startswith("Abstract") and "." in one.name:
        methods = (d for d in graph.by_key.values() if d.file.startswith("src/"))
        parts = [d for d in methods if "." in d.name and d.simple == one.simple]
    elif not one.name:
        parts = list(source.definitions)
    elif one.simple.lstrip("_")[0].isupper():
        parts = [d for d in source.definitions if f"{d.name}.".startswith(f"{one.name}.")]
    best: dict[str, int] = {}
    for part in parts:
        for key, distance in graph.reaching(part.key):
            best[key] = min(distance, best.get(key, distance))
    return best


def _named(tests: list[sources.Source]) -> dict[str, dict[str, int]]:
    found: dict[str, dict[str, int]] = defaultdict(dict)
    for source in tests:
        whole = source.definitions[0].equations
        for one in source.definitions:
            if one.simple.startswith("test_") and one.name:
                in_name = re.findall(r"_(\d{2})(?=_|$)", one.simple)
                for number in whole:
                    found[number][one.key] = 1
                for number in (*one.equations, *in_name):
                    found[number][one.key] = 2
    return dict(found)


def _errata() -> Iterator[str]:
    """Yield the numbers in the first column of the table of errata, and in the readings below."""
    text = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8")
    for line in text.splitlines():
        cells = line.split("|")
        if len(cells) > 4:
            yield from sources.cited(cells[1])
        elif re.match(r"\d+\. ", line):
            yield from sources.cited(line)
            yield from re.findall(r"Equation \((\d+)\)", line)


def dangling(traced: Traced) -> list[str]:
    """Return what does not hold together, one sentence each; nothing if all is well."""
    wrong = []
    for number, holders in traced.holders.items():
        if number not in traced.equations:
            places = ", ".join(one.key for one in holders)
            wrong.append(f"({number}) is no equation of the paper, but is cited in {places}")
    for number, equation in traced.equations.items():
        holders = traced.holders.get(number, [])
        if "without" not in equation and not holders:
            wrong.append(f"({number}), {equation['meaning']}: no docstring cites it")
    for key, tests in traced.tests.items():
        if not tests:
            wrong.append(f"{key} cites an equation, but no test reaches it")
    for number, equation in traced.equations.items():
        reaching = [traced.tests[one.key] for one in traced.holders.get(number, [])]
        for test in equation.get("tests", ()):
            if not any(test in tests for tests in reaching):
                wrong.append(f"({number}): {test} is no test that reaches it")
    for reference in traced.citing:
        if reference not in traced.references:
            wrong.append(f"{reference} is cited, but is not in docs/generate/equations.toml")
    for reference in traced.references:
        if reference not in traced.citing:
            wrong.append(f"{reference} is in docs/generate/equations.toml, but nothing cites it")
    return wrong


def page(traced: Traced) -> str:
    """Return the page."""
    lines = [_HEAD, "| equation | section | meaning | in | tests |", "|---|---|---|---|---|"]
    for number, equation in traced.equations.items():
        mark = " [errata](errata.md)" if number in traced.errata else ""
        cells = [
            f"({number}){mark}",
            equation["place"],
            equation["meaning"],
            _functions(traced.holders.get(number, []), equation),
            _tests(number, traced),
        ]
        lines.append(f"| {' | '.join(cells)} |")
    lines += [
        "",
        "## References",
        "",
        "| reference | title and place | cited in |",
        "|---|---|---|",
    ]
    for reference, title in traced.references.items():
        files = ", ".join(map(_file, traced.citing.get(reference, [])))
        lines.append(f"| {reference} | {title} | {files} |")
    return "\n".join(lines) + "\n"


def _functions(holders: list[Definition], equation: dict[str, Any]) -> str:
    """Return links to files, with the functions in them that cite."""
    if not holders:
        return f"none: {equation.get('without', 'missing')}"
    by_file: dict[str, list[str]] = defaultdict(list)
    later = ("/experiments/", "/study/")  # what compares comes after what computes
    for one in sorted(holders, key=lambda one: any(part in one.file for part in later)):
        by_file[one.file] += [f"`{one.name}`"] if one.name else []
    parts = [f"{_file(file)} {', '.join(names)}".strip() for file, names in by_file.items()]
    return "<br>".join(parts)


def _tests(number: str, traced: Traced) -> str:
    """Return the best tests of an equation: that name it, that are near, that are of one unit."""
    distance: dict[str, int] = {}
    for one in traced.holders.get(number, []):
        vague = _VAGUE if not one.name or "/experiments/" in one.file else 0
        for key, names in traced.tests[one.key].items():
            distance[key] = min(names + vague, distance.get(key, names + vague))
    named = traced.named.get(number, {})
    if not distance:
        distance = {key: 1 for key, how in named.items() if how == 2}

    chosen = traced.equations[number].get("tests", ())

    def worth(key: str) -> tuple[int, int, int, str]:
        rank = _rank(key)
        near = distance[key] + rank - _NAMED[named.get(key, 0)]
        return 0 if key in chosen else 1, near, rank, key

    best = sorted(distance, key=worth)[:_MOST_TESTS]
    return "<br>".join(_file(*key.split("::")) for key in best)


def _rank(key: str) -> int:
    folder = key.split("/")[1]
    return _FOLDERS.index(folder) if folder in _FOLDERS else len(_FOLDERS)


def _file(path: str, name: str = "") -> str:
    """Return a link to a file of the repository, with the name of a test in it."""
    shown = path.removeprefix("src/stokesfibers/").removeprefix("tests/")
    return f"[{shown}](../{path})" + (f" `{name}`" if name else "")


def main(arguments: list[str]) -> int:
    """Write the page, or check it; return the exit code."""
    traced = trace()
    wrong, text = dangling(traced), page(traced)
    if arguments == ["--check"]:
        if PAGE.read_text(encoding="utf-8") != text:
            wrong.append(f"{PAGE.name} is old: run python docs/generate/traceability.py")
    else:
        PAGE.write_text(text, encoding="utf-8")
    print("\n".join(wrong) or "nothing dangles")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
