"""Every script in examples/ runs, prints what it says, and draws something."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import matplotlib
import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
PRINTED = {
    "buckling_in_shear": r"integral of N1 from t = 37.888 on: 290\.\d\d",
    "stop_and_resume": r"same bits: True",
    "stiff_orbit": r"largest difference: \d\.\de-0[5-9]",
    "sheared_cell": r"specific viscosity 0\.0\d+ \+- 0\.\d+",
    "falling_pair": r"done at t = 0.16",
    "fiber_in_vortices": r"done at t = ",
    "read_with_xarray": r"'code': 'done'",
}
SHORTEST, LONGEST = 15, 60
INK = 0.005  # fraction of pixels that differ from the page; empty axes have less


def test_there_are_ten_or_more():
    assert len(SCRIPTS) >= 10
    assert {s.stem for s in SCRIPTS} >= set(PRINTED)


def _ink(figure) -> float:
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int)
    return float(np.mean(np.abs(pixels - pixels[0, 0]).max(axis=-1) > 40))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_script_runs_and_draws(script, monkeypatch, capsys, tmp_path):
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    monkeypatch.chdir(tmp_path)
    shown = []
    monkeypatch.setattr(plt, "show", lambda: shown.append(len(plt.get_fignums())))
    try:
        runpy.run_path(str(script), run_name="__main__")
        assert shown
        assert shown[-1] > 0, "no figure is open where the script shows its figures"
        for number in plt.get_fignums():
            assert _ink(plt.figure(number)) > INK
    finally:
        plt.close("all")
    assert not list(tmp_path.iterdir()), "an example leaves files behind"
    assert re.search(PRINTED.get(script.stem, ""), capsys.readouterr().out)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_script_is_short_and_says_what_it_shows(script):
    text = script.read_text()
    assert SHORTEST <= len(text.splitlines()) <= LONGEST
    assert re.match(r'"""\n.+\n=+\n\n\S', text), "a title, underlined, and a text"


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_figures_are_drawn_in_the_block_that_makes_them(script):
    """The gallery shows a figure after the block that made it, and closes it."""
    blocks = [b for b in script.read_text().split("# %%") if re.search(r"plt\.(subplots|fig)", b)]
    assert blocks
    for block in blocks:
        assert re.search(r"\.(plot|loglog|semilogy|pcolormesh)\(|sf\.plot\.", block)
