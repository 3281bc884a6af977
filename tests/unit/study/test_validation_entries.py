"""The entries themselves: names, pointers, those that take a moment, and that they can differ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stokesfibers.experiments import slow_sums as slow
from stokesfibers.experiments.base import Settings
from stokesfibers.experiments.registry import EXPERIMENTS
from stokesfibers.run.selftest import tension_error
from stokesfibers.study.validation import bending, figures, orders, rods, sums
from stokesfibers.study.validation.record import GROUPS
from stokesfibers.study.validation.registry import ENTRIES
from stokesfibers.study.validation.suite import chosen, validate

DOCS = Path(__file__).parents[3] / "docs"
FAST = ("drag", "drag-printed", "rod-motion", "rod-tension", "jeffery", "beam", "fig14")


def outcomes(names, folder):
    report = validate(chosen(ENTRIES, names, quick=True), Settings(folder, quick=True))
    assert not [r.details for r in report.results if r.details]
    return {r.entry.name: r.outcome for r in report.results}


def test_every_entry_is_found_once_with_a_source():
    names = [entry.name for entry in ENTRIES]
    assert len(set(names)) == len(names) > 35
    assert set(EXPERIMENTS) < set(names)
    assert {entry.group for entry in ENTRIES} == set(GROUPS)
    assert all(entry.source and entry.title for entry in ENTRIES)
    assert set(figures.QUICK) <= set(EXPERIMENTS)


def test_explanations_are_where_the_pointers_say():
    pointers = [*figures.POINTERS.values(), rods._DRAG_ERRATUM]
    assert len(pointers) > 4
    for pointer in pointers:
        page, _, what = pointer.partition(": ")
        text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
        assert what in text, pointer


def test_fast_entries_agree(tmp_path):
    found = outcomes(FAST, tmp_path)
    assert found.pop("drag-printed") == "explained"
    assert set(found.values()) == {"agrees"}


def test_a_wrong_drag_is_seen(tmp_path, monkeypatch):
    right = rods.drag
    monkeypatch.setattr(rods, "drag", lambda eps: tuple(1.001 * f for f in right(eps)))
    assert outcomes(("drag", "drag-printed"), tmp_path) == {
        "drag": "differs",
        "drag-printed": "differs",
    }


def test_a_wrong_tension_is_seen(tmp_path, monkeypatch):
    assert tension_error() < 1e-12
    monkeypatch.setattr("stokesfibers.run.selftest.tension_error", lambda: 1e-6)
    assert outcomes(("rod-tension",), tmp_path) == {"rod-tension": "differs"}


def test_a_rod_that_turns_and_drifts_wrongly_is_seen(tmp_path, monkeypatch):
    """What (45) and (46) say: a rate of shear that is off by 1e-5 is noticed."""
    right = rods._ends
    assert {f.verdict for f in rods._motion(Settings(tmp_path))} == {"agrees"}
    assert {f.verdict for f in rods._jeffery(Settings(tmp_path))} == {"agrees"}
    monkeypatch.setattr(
        rods, "_ends", lambda flow, until, start: right(flow, 1.00001 * until, start)
    )
    assert "differs" in {f.verdict for f in rods._motion(Settings(tmp_path))}


def test_the_correction_of_the_rate_is_that_of_a_quadrature():
    """The mean of 2 + S_0 over the first mode by plain quadrature of (B.3) between panels."""
    nodes, weights = np.polynomial.legendre.leggauss(80)
    s = 0.5 * (nodes + 1.0)
    mode = bending.beam_mode(1, s)
    inner = np.empty_like(s)
    for k, at in enumerate(s):
        total = 0.0
        for low, high in ((0.0, at), (at, 1.0)):
            there = low + (high - low) * s
            change = (bending.beam_mode(1, there) - mode[k]) / np.abs(there - at)
            total += 0.5 * (high - low) * float(weights @ change)
        inner[k] = total
    expected = 2.0 + float(weights @ (mode * inner)) / float(weights @ mode**2)
    assert bending.first_correction(1) == pytest.approx(expected, rel=1e-9)
    assert expected == pytest.approx(-1.0082, abs=1e-4)


def test_independent_sums_agree_among_themselves():
    """Lines and layers of images with a very long period are free space and lines."""
    targets = np.array([[0.3, 0.2, 1.4], [-0.4, 0.1, 1.7]])
    forces = np.array([[1.0, 0.3, 0.0], [-2.0, 0.1, 1.0], [1.0, -0.4, -1.0]])
    pairs = slow.Pairs(
        targets, np.array([[0.0, 0.0, 0.0], [0.2, 0.1, 0.1], [0.1, -0.3, 0.2]]), forces
    )
    free, line = slow.free(pairs), slow.one_direction(pairs, 400.0, 0)
    assert np.abs(line - free).max() < 1e-5 * np.abs(free).max()
    near, layer = slow.one_direction(pairs, 1.0, 0), sums.layer_by_modes(pairs, (1.0, 30.0))
    assert np.abs(near - layer).max() < 2e-2 * np.abs(near).max()
    assert np.abs(near - free).max() > 0.1 * np.abs(free).max()
    two = slow.two_directions(pairs, (1.0, 1.3))
    assert np.abs(sums.layer_by_modes(pairs, (1.0, 1.3)) - two).max() < 1e-9 * np.abs(two).max()


def test_the_bent_curve_has_free_ends_and_unit_tangents():
    s = np.linspace(0.0, 1.0, 2001)
    points = orders.bent(s)
    slope = np.gradient(points, s, axis=0, edge_order=2)
    bend = np.gradient(slope, s, axis=0, edge_order=2)
    assert np.abs(np.linalg.norm(slope, axis=1) - 1.0).max() < 1e-4
    assert np.linalg.norm(bend, axis=1).max() > 3.0
    assert np.linalg.norm(bend[[1, -2]], axis=1).max() < 1e-2
