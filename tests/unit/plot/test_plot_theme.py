"""Colours are legible on the ground they are for, and a dark figure is dark all over."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from stokesfibers import plot
from stokesfibers.plot.style import time_colours
from stokesfibers.plot.theme import DARK, LIGHT, THEMES


def luminance(colour) -> float:
    parts = np.asarray(to_rgb(colour))
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(one, other) -> float:
    """Return the contrast of two colours as the accessibility guidelines define it."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("ground", THEMES.values(), ids=THEMES)
def test_text_and_lines_stand_out_from_the_ground(ground):
    assert contrast(ground.ink, ground.ground) > 12.0
    assert contrast(ground.faint, ground.ground) > 2.5
    assert contrast(ground.alarm, ground.ground) > 3.0
    ordinary = ground.palette[:4]
    assert min(contrast(c, ground.ground) for c in ordinary) > (2.7 if ground is LIGHT else 4.5)


def test_every_line_of_the_dark_palette_stands_out():
    assert min(contrast(c, DARK.ground) for c in DARK.palette) > 4.5


def simulated(colour):
    """Return a colour as seen without the green receptors (Vienot, Brettel & Mollon 1999)."""
    to_lms = np.array(
        [[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.02996, 0.18431, 1.46709]]
    )
    without = np.array([[1.0, 0.0, 0.0], [0.494207, 0.0, 1.24827], [0.0, 0.0, 1.0]])
    return np.linalg.solve(to_lms, without @ to_lms @ np.asarray(to_rgb(colour)))


@pytest.mark.parametrize("ground", THEMES.values(), ids=THEMES)
def test_the_first_lines_differ_without_green_receptors(ground):
    seen = [simulated(c) for c in ground.palette[:4]]
    apart = [np.linalg.norm(a - b) for k, a in enumerate(seen) for b in seen[:k]]
    assert min(apart) > 0.15


@pytest.mark.parametrize("ground", THEMES.values(), ids=THEMES)
def test_maps_of_values_are_even_in_lightness_and_keep_off_the_ground(ground):
    with plot.on(ground):
        times = time_colours(np.linspace(0.0, 1.0, 9))
    light = [luminance(c[:3]) for c in times]
    assert np.all(np.diff(light) > 0.0)
    assert min(contrast(c[:3], ground.ground) for c in times) > 1.35
    growing = [luminance(c[:3]) for c in ground.map_of(ground.growing)(np.linspace(0, 1, 9))]
    away = np.abs(np.array(growing) - luminance(ground.ground))
    assert np.all(np.diff(away) > 0.0)  # large values stand out most


@pytest.mark.parametrize("kind", sorted(plot.KINDS))
def test_every_kind_is_dark_on_a_dark_ground(kind, crowd, tmp_path):
    with plot.dark():
        path = plot.save(plot.KINDS[kind](crowd), tmp_path / "a.png", dpi=50)
    picture = matplotlib.image.imread(path)[..., :3]
    corner = np.array(to_rgb(DARK.ground))
    np.testing.assert_allclose(picture[0, 0], corner, atol=0.01)
    # neither white patches nor text in the ink of paper
    white = np.mean(np.all(picture > 0.97, axis=-1))
    assert white < 0.01
    darker = np.mean(np.all(picture < corner - 0.03, axis=-1))
    assert darker < 0.001
    bright = np.mean(np.any(picture > 0.5, axis=-1))
    assert bright > 0.002


def test_a_dark_figure_stays_dark_when_saved_outside_the_block(run, tmp_path):
    with plot.dark():
        axes = plot.energy(run)
    svg = plot.save(axes, tmp_path / "a.svg").read_text()
    assert DARK.ground.lower() in svg.lower()
    assert LIGHT.ink.lower() not in svg.lower()
    assert plot.theme() is LIGHT
