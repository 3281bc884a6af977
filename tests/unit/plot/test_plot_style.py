"""The house style leaves no trace, and files are written in the formats asked for."""

from __future__ import annotations

import subprocess
import sys

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgba

from stokesfibers import plot
from stokesfibers.core.errors import InputError
from stokesfibers.plot.style import PALETTE, STYLE, new_panels, time_colours


def test_import_leaves_matplotlib_and_xarray_alone():
    code = (
        "import sys, stokesfibers.plot; "
        "assert 'stokesfibers.plot.shapes' in sys.modules; "
        "print([m for m in ('matplotlib', 'xarray') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_no_global_setting_changes_and_pyplot_knows_no_figure(run, tmp_path):
    before = dict(matplotlib.rcParams)
    for draw in plot.KINDS.values():
        draw(run)
    plot.save(plot.series(run, "shear_stress"), tmp_path / "figure.svg")
    assert dict(matplotlib.rcParams) == before
    assert plt.get_fignums() == []


def test_style_holds_inside_and_ends_even_after_an_error():
    before = matplotlib.rcParams["font.size"]
    assert before != STYLE["font.size"]
    with plot.style():
        assert matplotlib.rcParams["font.size"] == STYLE["font.size"]
    with pytest.raises(ZeroDivisionError), plot.style():
        _ = 1 / 0
    assert matplotlib.rcParams["font.size"] == before


def test_kinds_are_those_of_the_command():
    single = {"shapes", "panels", "tension", "stress", "energy", "health"}
    assert set(plot.KINDS) == single | {"3d", "orientation", "order", "curvature", "end_to_end"}


@pytest.mark.parametrize("kind", sorted(plot.KINDS))
def test_every_kind_renders_as_png_with_ink(kind, run, tmp_path):
    path = plot.save(plot.KINDS[kind](run), tmp_path / f"{kind}.png", dpi=60)
    image = matplotlib.image.imread(path)
    assert image.shape[1] > 150
    ink = np.mean(np.any(image[..., :3] < 0.9, axis=-1))
    assert 0.005 < ink < 0.5


def test_save_takes_axes_figure_and_array(run, tmp_path):
    for number, pick in enumerate((lambda a: a, lambda a: a[0], lambda a: a[0].figure)):
        path = tmp_path / f"{number}.svg"
        assert plot.save(pick(plot.shape_panels(run, times=[4.0, 6.0])), path) == path
    files = [(tmp_path / f"{n}.svg").read_bytes() for n in range(3)]
    # The same data give the same bytes, whatever the figure is taken hold of by.
    assert files[0] == files[1] == files[2]


def test_text_stays_text(run, tmp_path):
    ax = plot.stress(run)
    svg = plot.save(ax, tmp_path / "stress.svg").read_text()
    assert "force length" in svg
    assert "<text" in svg
    pdf = plot.save(ax, tmp_path / "stress.PDF").read_bytes()
    assert pdf.startswith(b"%PDF")
    assert b"/Subtype /Type0" in pdf or b"/TrueType" in pdf
    assert b"CreationDate" not in pdf


def test_dpi_sets_the_pixels(run, tmp_path):
    ax = plot.energy(run)
    wide = [
        matplotlib.image.imread(plot.save(ax, tmp_path / f"{d}.png", dpi=d)).shape[1]
        for d in (50, 100)
    ]
    assert abs(wide[1] - 2 * wide[0]) <= 4


@pytest.mark.parametrize(
    ("name", "expected"), [("a.jpg", ".png, .pdf, .svg"), ("a", ".png"), ("no/a.png", "folder")]
)
def test_bad_paths_are_refused(name, expected, tmp_path):
    with pytest.raises(InputError) as caught:
        plot.save(plot.new_axes(), tmp_path / name)
    assert expected in caught.value.expected
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_the_old_file_and_no_other(run, tmp_path, monkeypatch):
    path = plot.save(plot.energy(run), tmp_path / "a.png", dpi=50)
    before = path.read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OSError, match="space"):
        plot.save(plot.stress(run), path, dpi=50)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_bad_dpi_and_bad_figure_are_refused(tmp_path):
    with pytest.raises(InputError, match="dpi"):
        plot.save(plot.new_axes(), tmp_path / "a.png", dpi=0)
    with pytest.raises(InputError, match="drawn"):
        plot.save(np.empty(0), tmp_path / "a.png")


def test_axes_of_a_subfigure_are_saved_with_the_whole_figure(tmp_path):
    figure = matplotlib.figure.Figure()
    left = figure.subfigures(1, 2)[0].subplots()
    right = figure.subfigures(1, 1).subplots()
    right.set_title("other half")
    assert "other half" in plot.save(left, tmp_path / "a.svg").read_text()


def test_panels_have_the_size_asked_for():
    axes = new_panels(2, 3, width=5.0, height=4.0)
    assert axes.shape == (2, 3)
    np.testing.assert_allclose(axes[0, 0].figure.get_size_inches(), [5.0, 4.0], rtol=1e-12)


def test_time_colours_get_steadily_lighter_and_never_fade_into_white():
    colours = np.array(time_colours(np.array([0.0, 1.0, 2.0, 4.0])))[:, :3]
    light = colours @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(light) > 0.1)
    assert light[-1] < 0.8
    assert time_colours(np.array([3.0])) == [to_rgba(PALETTE[0])]
