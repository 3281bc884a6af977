"""Every equation that the scheme needs has a function and a test; nothing cited dangles."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tools():
    """Return the generator and its reader, which are no part of the package."""
    folder = str(ROOT / "docs" / "generate")
    sys.path.insert(0, folder)
    try:
        sources, traceability = map(import_module, ("sources", "traceability"))
    finally:
        sys.path.remove(folder)
    return traceability, sources


@pytest.fixture(scope="module")
def traced(tools):
    return tools[0].trace()


def test_every_equation_of_the_paper_is_listed(traced):
    numbers = [str(n) for n in range(1, 50)]
    numbers += [f"A.{n}" for n in range(1, 5)] + [f"B.{n}" for n in range(1, 11)]
    assert list(traced.equations) == numbers
    for number, equation in traced.equations.items():
        assert equation["place"], number
        assert equation["meaning"], number
    skipped = [n for n, equation in traced.equations.items() if "without" in equation]
    assert skipped == ["23", "B.2", "B.7", "B.8", "B.9", "B.10"]


def test_nothing_dangles(tools, traced):
    assert tools[0].dangling(traced) == []


def test_the_page_is_up_to_date(tools, traced):
    """If not: python docs/generate/traceability.py."""
    assert tools[0].PAGE.read_text(encoding="utf-8") == tools[0].page(traced)


def test_printed_errors_are_marked(traced):
    assert {"13", "14", "22", "38", "46", "47", "A.1"} <= traced.errata
    assert "44" not in traced.errata


def test_the_best_known_functions_are_found(traced):
    def names(number):
        return {one.key.removeprefix("src/stokesfibers/") for one in traced.holders[number]}

    assert "slender/regularization.py::PaperRegularization" in names("16")
    assert "constraint/coupled.py::FixedPoint" in names("39")
    assert "numerics/finite_differences.py::difference_matrix" in names("A.3")
    assert "observe/observables.py::elastic_energy" in names("49")
    straight = "tests/analytic/test_straight_rod.py"
    test = f"{straight}::test_tension_44_is_exact_on_any_grid_without_regularisation"
    assert traced.named["44"][test] == 2


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: {"holders": t.holders | {"50": t.holders["49"]}}, "(50) is no equation"),
        (lambda t: {"holders": {k: v for k, v in t.holders.items() if k != "22"}}, "(22), "),
        (lambda t: {"tests": t.tests | {"src/f.py::f": {}}}, "src/f.py::f cites an equation, but"),
        (lambda t: {"citing": t.citing | {"Nobody 1999": ["f.py"]}}, "Nobody 1999 is cited"),
        (lambda t: {"references": t.references | {"Lost 1900": ""}}, "Lost 1900 is in docs"),
        (
            lambda t: {"equations": t.equations | {"1": t.equations["1"] | {"tests": ["x"]}}},
            "(1): x is no test",
        ),
    ],
)
def test_what_dangles_is_said(tools, traced, change, said):
    wrong = tools[0].dangling(replace(traced, **change(traced)))
    assert any(said in sentence for sentence in wrong), wrong


def test_citations_are_read_as_people_write_them(tools):
    _, sources = tools
    text = "See (17), (18) and (A.1)-(A.4); f(3), Phi'''(0), x[1](2), 46 (2004), (B.5)."
    assert list(sources.cited(text)) == ["17", "18", "A.1", "A.2", "A.3", "A.4", "B.5"]
    text = (
        "GMRES (Saad & Schultz 1986); Du Roure et\nal. 2019, Jeffery 1922, Lees & Edwards (1972)."
    )
    assert sources.references(text) == (
        "Saad & Schultz 1986",
        "du Roure et al. 2019",
        "Jeffery 1922",
        "Lees & Edwards 1972",
    )


def test_tests_reach_functions_through_others(tools, tmp_path):
    _, sources = tools
    package, tests = tmp_path / "src" / "stokesfibers", tmp_path / "tests"
    package.mkdir(parents=True)
    tests.mkdir()
    (package / "low.py").write_text(
        '"""Low."""\ndef _sum():\n    """(1)."""\ndef lost():\n    pass\n'
    )
    (package / "high.py").write_text(
        "from stokesfibers.low import _sum\nTABLE = [_sum]\nclass Box:\n"
        "    def total(self):\n        return TABLE[0]()\n"
    )
    (tests / "test_box.py").write_text(
        "from stokesfibers.high import Box\ndef helper():\n    return Box().total()\n"
        "def test_it():\n    helper()\ndef test_other():\n    pass\n"
    )
    read = [*sources.read(tmp_path, "src/stokesfibers"), *sources.read(tmp_path, "tests")]
    graph = sources.Graph.of(read)
    found = graph.reaching("src/stokesfibers/low.py::_sum")
    assert found == [("tests/test_box.py::test_it", 4)]
    assert graph.reaching("src/stokesfibers/low.py::lost") == []
