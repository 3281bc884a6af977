"""The committed results are what the suite gives: entries, sources, tolerances, numbers, pages."""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.experiments.base import Settings
from stokesfibers.study.validation import tables
from stokesfibers.study.validation.registry import ENTRIES
from stokesfibers.study.validation.suite import chosen, validate

DOCS = Path(__file__).parents[3] / "docs"
FAST = ("drag", "drag-printed", "rod-motion", "rod-tension", "jeffery", "beam", "fig14")


@pytest.fixture(scope="module")
def tool():
    """Return the generator, which is no part of the package."""
    folder = str(DOCS / "generate")
    sys.path.insert(0, folder)
    try:
        return import_module("validation")
    finally:
        sys.path.remove(folder)


@pytest.fixture(scope="module")
def kept() -> dict[str, Any]:
    return json.loads((DOCS / "generated" / "validation.json").read_text(encoding="utf-8"))


def assert_same_numbers(found: dict[str, Any], kept: dict[str, Any]) -> None:
    """Assert that entries agree: words exactly, numbers within rounding."""
    assert {k: found[k] for k in ("name", "group", "title", "source", "outcome")} == {
        k: kept[k] for k in ("name", "group", "title", "source", "outcome")
    }
    assert len(found["findings"]) == len(kept["findings"]), found["name"]
    for one, other in zip(found["findings"], kept["findings"], strict=True):
        for name in ("quantity", "tolerance", "verdict", "explained_in"):
            assert one[name] == other[name], one["quantity"]
        if isinstance(other["theirs"], float):
            assert one["theirs"] == pytest.approx(other["theirs"], rel=1e-9)
        else:
            assert one["theirs"] == other["theirs"]
        low, high = other["range"]
        wide = high - low if None not in (low, high) else 0.0
        allowed = max(1e-4 * abs(other["ours"]), 1e-3 * wide)
        if other["theirs"] == 0.0 or low is None:
            allowed = max(allowed, 0.1 * abs(high))  # errors themselves: rounding of rounding
        assert one["ours"] == pytest.approx(other["ours"], abs=allowed), one["quantity"]


def test_pages_are_written_from_the_kept_reports(tool, kept):
    """If not: python docs/generate/validation.py."""
    assert tool.RESULTS.read_text(encoding="utf-8") == tool.results(kept)
    text = tool.PAGE.read_text(encoding="utf-8")
    assert text == tool.page(text, kept)


def test_kept_reports_are_of_the_entries_there_are(kept):
    """If not: run the suite again, and docs/generate/validation.py with its report."""
    known = {entry.name: entry for entry in ENTRIES}
    assert set(kept) == {"quick", "full"}
    quick = [entry.name for entry in ENTRIES if entry.tier == "quick"]
    assert [entry["name"] for entry in kept["quick"]["entries"]] == quick
    for report in kept.values():
        assert report["format"] == tables.FORMAT
        assert report["counts"]["differs"] == report["counts"]["failed"] == 0
        for entry in report["entries"]:
            own = known[entry["name"]]
            assert (entry["group"], entry["title"], entry["source"]) == (
                own.group,
                own.title,
                own.source,
            )


def test_fast_entries_give_the_kept_numbers(kept, tmp_path):
    report = validate(chosen(ENTRIES, FAST, quick=True), Settings(tmp_path, quick=True))
    by_name = {entry["name"]: entry for entry in kept["quick"]["entries"]}
    for found in tables.as_dict(report)["entries"]:
        assert_same_numbers(found, by_name[found["name"]])


def test_a_number_that_moved_is_seen(kept):
    entry = kept["quick"]["entries"][0]
    for change in ({"ours": 51.0}, {"tolerance": "0.1"}, {"verdict": "differs"}):
        moved = [entry["findings"][0] | change, *entry["findings"][1:]]
        with pytest.raises(AssertionError):
            assert_same_numbers(entry | {"findings": moved}, entry)
    with pytest.raises(AssertionError):
        assert_same_numbers(entry | {"source": "nobody"}, entry)


def test_a_new_report_takes_the_place_of_its_tier(tool, kept, tmp_path):
    path = tmp_path / "report.json"
    path.write_text(json.dumps(kept["quick"] | {"version": "new"}))
    found = tool.merged([path], kept)
    assert found["quick"]["version"] == "new"
    assert found["full"] == kept["full"]
    one = kept["full"]["entries"][3]
    path.write_text(json.dumps(kept["full"] | {"entries": [one | {"outcome": "differs"}]}))
    found = tool.merged([path], kept)["full"]["entries"]
    assert [e["name"] for e in found] == [e["name"] for e in kept["full"]["entries"]]
    assert [e["outcome"] for e in found if e["name"] == one["name"]] == ["differs"]
    path.write_text("{}")
    with pytest.raises(InputError):
        tool.merged([path], kept)
    with pytest.raises(SystemExit, match="no region"):
        tool.page("a page without it", kept)


@pytest.mark.slow
def test_the_quick_suite_gives_the_kept_numbers(kept, tmp_path):
    report = validate(chosen(ENTRIES, (), quick=True), Settings(tmp_path, quick=True))
    assert report.bad == []
    found = tables.as_dict(report)["entries"]
    for one, other in zip(found, kept["quick"]["entries"], strict=True):
        assert_same_numbers(one, other)
