"""``stokesfibers movie`` from the command line."""

from __future__ import annotations

import pytest
from PIL import Image

SMALL = ["--size", "320x240", "--dpi", 60, "--workers", 1]


def test_a_gif_is_written_with_the_choices_given(run, invoke):
    out = run.with_name("a.gif")
    words = [
        *SMALL,
        "--fps",
        10,
        "--duration",
        0.3,
        "--color",
        "none",
        "--dark",
        "--series",
        "none",
    ]
    result = invoke("movie", run, out, *words)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.strip() == str(out)
    with Image.open(out) as picture:
        assert (picture.size, picture.n_frames) == ((320, 240), 3)
        assert picture.convert("L").getpixel((0, 0)) < 40


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["a.avi"], "OUT: expected a file name ending in .mp4 or .gif"),
        (["a.gif", "--size", "big"], "--size: expected WIDTHxHEIGHT"),
        (["a.gif", "--color", "speed"], "or none for one colour, got 'speed'"),
        (["a.gif", "--size", "320x180", "--series", "shear_stress"], "--size: expected room"),
        (["a.gif", "--to", 9.0], "times between 0 and 0.256"),
        (["a.gif", "--series", "speed"], "observables.speed"),
    ],
)
def test_what_cannot_be_is_refused(words, said, run, invoke):
    name, *rest = words
    result = invoke("movie", run, run.with_name(name), *rest)
    assert result.exit_code == 2
    assert said in result.stderr
    assert not run.with_name(name).exists()
