"""Findings, the suite that collects them, and tables: nothing here runs the solver."""

from __future__ import annotations

import csv
import io
import json

import pytest

from stokesfibers.core.errors import InputError, MissingExtraError
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.study.validation import tables
from stokesfibers.study.validation.record import Entry, Finding, Tier, close, corrected, of_row
from stokesfibers.study.validation.suite import chosen, validate


def entry(name: str, *findings: Finding, tier: Tier = "quick") -> Entry:
    return Entry(name, "exact", f"title of {name}", "a source", lambda _: findings, tier)


def failing(error):
    def work(_):
        raise error

    return Entry("broken", "exact", "it fails", "a source", work)


GOOD = close("good", 2.0 + 1e-7, 2.0, rtol=1e-6)
BAD = close("bad", 2.1, 2.0, rtol=1e-6)
WRONG_IN_PRINT = corrected("printed", 290.4, 579.3, right=289.65, rtol=0.005, erratum="errata: x")


def test_a_finding_agrees_within_its_range_and_differs_outside():
    assert GOOD.verdict == "agrees"
    assert GOOD.error == pytest.approx(5e-8, rel=1e-6)
    assert GOOD.tolerance == "1e-06"
    assert BAD.verdict == "differs"
    assert close("low", 1.9, 2.0, atol=0.05).verdict == "differs"
    assert close("zero", 1e-9, 0.0, atol=1e-8).error == 1e-9
    for value in (float("nan"), float("inf")):
        assert Finding("broken", value, 1.0, None, 5.0).verdict == "differs"
        assert Finding("broken", value, 1.0, 0.0, 5.0, "errata: x").verdict == "differs"


def test_what_could_not_differ_is_refused():
    with pytest.raises(ValueError, match="nothing it could differ from"):
        Finding("free", 1.0, 1.0, None, None)
    with pytest.raises(ValueError, match="above zero"):
        close("free", 1.0, 1.0)
    with pytest.raises(ValueError, match="above zero"):
        close("free", 1.0, 0.0, rtol=1e-3)
    with pytest.raises(ValueError, match="as good as"):
        corrected("free", 1.0, 1.0005, right=1.0, rtol=1e-3, erratum="errata: x")


def test_a_wrong_printed_value_is_explained_only_by_the_right_one():
    assert WRONG_IN_PRINT.verdict == "explained"
    assert WRONG_IN_PRINT.tolerance == "0.005 of 289.65"
    for ours in (579.3, 300.0):
        other = corrected("printed", ours, 579.3, right=289.65, rtol=0.005, erratum="errata: x")
        assert other.verdict == "differs"


def test_rows_of_experiments_keep_their_verdicts():
    why = {"known": "because", "known_low": 2.9, "known_high": 3.1}
    known = Row("q", 3.0, 1.0, 0.9, 1.1, **why)
    assert of_row(known, "errata: x") == Finding("q", 3.0, 1.0, 2.9, 3.1, "errata: x")
    assert of_row(known, "errata: x").verdict == "explained"
    assert of_row(Row("q", 1.0, 1.0, 0.9, 1.1, **why), "errata: x").verdict == "agrees"
    assert of_row(Row("q", 1e9, 1.0, 0.9, 1.1, **why), "errata: x").verdict == "differs"
    with pytest.raises(ValueError, match="without its range"):
        Row("q", 3.0, 1.0, 0.9, 1.1, known="because")
    assert of_row(Row("q", 3.0, 1.0, 0.9, 1.1), "errata: x").verdict == "differs"
    assert of_row(Row("q", 3.0, "more than two", low=2.0), "").tolerance == "at least 2"
    assert of_row(Row("q", 3.0, None, high=4.0), "").tolerance == "at most 4"
    assert of_row(Row("q", 3.0, "some", 2.0, 4.0), "").tolerance == "2 to 4"


def test_an_entry_that_fails_stops_no_other(tmp_path):
    told, shares = [], []
    settings = Settings(tmp_path, progress=lambda what, share: shares.append((what, share)))
    entries = [entry("one", GOOD), failing(ZeroDivisionError("oh")), entry("two", GOOD, BAD)]
    report = validate(entries, settings, told.append)
    assert [r.outcome for r in report.results] == ["agrees", "failed", "differs"]
    assert told == list(report.results)
    assert report.bad == ["broken", "two"]
    assert report.results[1].problem == "ZeroDivisionError: oh"
    assert "Traceback" in report.results[1].details
    assert report.counts() == {"agrees": 2, "explained": 0, "differs": 1, "failed": 1, "not run": 0}
    assert shares == [("one", 0.0), ("broken", 1 / 3), ("two", 2 / 3)]


def test_progress_within_an_entry_is_a_share_of_the_whole(tmp_path):
    def work(settings):
        settings.progress("half", 0.5)
        return [GOOD]

    shares = []
    settings = Settings(tmp_path, progress=lambda what, share: shares.append((what, share)))
    validate([entry("one", GOOD), Entry("slow", "exact", "t", "s", work)], settings)
    assert shares[-1] == ("slow: half", 0.75)


def test_a_missing_extra_is_said_and_is_no_difference(tmp_path):
    missing = MissingExtraError("ducc0", "fast", "This sum")
    report = validate([failing(missing), entry("one", GOOD)], Settings(tmp_path))
    assert report.bad == []
    assert report.results[0].outcome == "not run"
    assert "pip install" in report.results[0].problem


def test_an_entry_without_numbers_fails_and_an_interrupt_goes_through(tmp_path):
    report = validate([entry("empty")], Settings(tmp_path))
    assert report.results[0].outcome == "failed"
    with pytest.raises(KeyboardInterrupt):
        validate([failing(KeyboardInterrupt())], Settings(tmp_path))


def test_names_and_tiers_choose_entries():
    entries = [entry("one", GOOD), entry("long", GOOD, tier="full")]
    assert [e.name for e in chosen(entries, (), quick=True)] == ["one"]
    assert [e.name for e in chosen(entries, (), quick=False)] == ["one", "long"]
    assert [e.name for e in chosen(entries, ("long", "long"), quick=True)] == ["long"]
    with pytest.raises(InputError, match=r"--only: expected one of one, long, got 'three'"):
        chosen(entries, ("three",), quick=True)
    with pytest.raises(InputError, match="Did you mean 'long'"):
        chosen(entries, ("lonk",), quick=True)


def test_tables_hold_every_number_and_can_be_read_again(tmp_path):
    bar = Finding("error of |p| <= 1", float("nan"), "words", None, 3.0)
    entries = [entry("one", GOOD, WRONG_IN_PRINT), entry("two", bar), failing(OSError("no\nroom"))]
    report = validate(entries, Settings(tmp_path))
    markdown, lines, data = tables.write(report, tmp_path / "out")
    text = markdown.read_text()
    assert "3 numbers of 3 entries, full suite" in text
    assert "1 agrees, 1 explained, 1 differs; 1 entries failed" in text
    assert "| good | 2 | 2 | 5e-08 | 1e-06 | agrees |" in text
    assert "| printed | 579.3 | 290.4 | 0.5 | 0.005 of 289.65 | explained (errata: x) |" in text
    assert r"| error of \|p\| <= 1 | words |" in text
    read = list(csv.DictReader(io.StringIO(lines.read_text())))
    assert [row["verdict"].split(":")[0] for row in read] == [
        "agrees",
        "explained (errata",
        "differs",
        "failed",
    ]
    assert read[0]["source"] == "a source"
    held = tables.read(data)
    assert held["entries"][1]["findings"][0]["ours"] is None
    assert tables.as_csv(held) == lines.read_text()
    linked = tables.as_markdown(held, pages="../")
    assert "explained ([errata](../errata.md): x)" in linked


def test_entries_that_were_not_run_again_stay_in_the_folder(tmp_path):
    out, order = tmp_path / "out", ["one", "two", "three"]
    both = validate([entry("two", GOOD), entry("one", GOOD, GOOD)], Settings(tmp_path))
    tables.write(both, out, order)
    again = validate([entry("three", WRONG_IN_PRINT), entry("one", GOOD)], Settings(tmp_path))
    held = tables.read(tables.write(again, out, order)[-1])
    assert [one["name"] for one in held["entries"]] == order
    assert [len(one["findings"]) for one in held["entries"]] == [1, 1, 1]
    assert held["counts"] == both.counts() | {"agrees": 2, "explained": 1}
    quick = validate([entry("one", GOOD)], Settings(tmp_path, quick=True))
    assert len(tables.read(tables.write(quick, out, order)[-1])["entries"]) == 1, "another suite"
    alone = tables.read(tables.write(again, out)[-1])
    assert [one["name"] for one in alone["entries"]] == ["three", "one"], "all of it replaced"


def test_foreign_files_are_refused(tmp_path):
    for name, text in (("a.json", "{"), ("b.json", json.dumps({"format": 0}))):
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError, match="a validation report"):
            tables.read(tmp_path / name)
