"""Figs. 2-4: the filament buckles, more for larger mu_bar, and straightens again."""

from __future__ import annotations

import pytest

NAMES = ("fig02", "fig03", "fig04")


def _assert_more_pronounced(found) -> None:
    energies = [f.ours("peak elastic energy") for f in found]
    shortest = [f.ours("smallest end-to-end") for f in found]
    assert energies[0] < 0.5 * energies[1] < energies[1] < 0.8 * energies[2]
    assert shortest[0] > shortest[1] + 0.05 > shortest[2] + 0.1


def test_quick(quick):
    _assert_more_pronounced([quick(name) for name in NAMES])


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_full(full):
    found = [full(name) for name in NAMES]
    _assert_more_pronounced(found)
    times = found[0].data()["time"].to_numpy()
    assert times[0] == pytest.approx(46.08)
    assert times[-1] == pytest.approx(51.2)
    assert found[0].data().attrs["intervals"] == 200
