"""Movies have the frames asked for, show the records, and leave nothing half done."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest
import xarray as xr
from PIL import Image

from stokesfibers.core.errors import InputError, MissingExtraError, StokesFibersError
from stokesfibers.plot.solid import Cell, seen_at
from stokesfibers.studio import movie_workers
from stokesfibers.studio.frames import Stage, has_room
from stokesfibers.studio.movie import Film, _records, _scene, _shots, movie

SMALL = (320, 240)
PERIODS = (0.8, 0.6, 0.7)


def made_up(fibers: int = 1, *, flat: bool = True) -> xr.DataTree:
    """Return eleven records of straight fibers that turn."""
    time = np.linspace(0.0, 1.0, 11)
    s = np.linspace(-0.5, 0.5, 9)
    angle = 2.0 * time[:, None] + np.arange(fibers)
    rise = 0.0 if flat else 0.3
    along = np.stack([np.cos(angle), np.sin(angle), rise + 0.0 * angle], axis=-1)
    position = along[:, :, None, :] * s[:, None]
    return xr.DataTree.from_dict(
        {
            "/trajectory": xr.Dataset(
                {
                    "position": (("time", "fiber", "node", "space"), position),
                    "tension": (("time", "fiber", "node"), np.cos(angle)[..., None] + 0.0 * s),
                    "arclength": (("fiber", "node"), np.tile(s + 0.5, (fibers, 1))),
                },
                coords={"time": time},
            ),
            "/observables": xr.Dataset(
                {
                    "first_normal_stress_difference": ("time", np.sin(time)),
                    "shear_stress": ("time", np.cos(time)),
                },
                coords={"time": time},
            ),
        }
    )


def sheared(fibers: int = 3) -> xr.DataTree:
    """Return fibers in a cell that is sheared at the rate 1."""
    tree = made_up(fibers, flat=False)
    observed = tree["observables"].to_dataset()
    tree["observables"] = xr.DataTree(observed.assign(strain=("time", observed["time"].to_numpy())))
    tree.attrs["case"] = json.dumps({"domain": {"kind": "sheared", "periods": PERIODS}})
    return tree


def film(**choices) -> Film:
    return Film(**{"size": SMALL, "dpi": 60, "workers": 1, **choices})


def frame(data: xr.DataTree, record: int, choice: Film) -> np.ndarray:
    """Return one frame as (height, width, 3)."""
    stage = Stage(_scene(data, choice, _records(data, choice)))
    (shot,) = _shots(data, choice, [record])
    width, height = choice.size
    return np.frombuffer(stage.draw(shot), np.uint8).reshape(height, width, 3)


def test_a_gif_has_a_frame_for_each_record(tmp_path):
    seen = []
    path = movie(
        made_up(), tmp_path / "a.gif", film(fps=20), watch=lambda n, of: seen.append((n, of))
    )
    with Image.open(path) as picture:
        assert picture.size == SMALL
        assert picture.n_frames == 11
        assert picture.info["duration"] == 50
    assert seen == [(n, 11) for n in range(1, 12)]
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_mp4_plays_as_long_as_asked(tmp_path):
    """The reader leaves its pipes to the garbage collector, which is what is ignored."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    path = movie(made_up(), tmp_path / "a.mp4", film(fps=10, duration=0.6))
    reader = ffmpeg.read_frames(str(path))
    facts = next(reader)
    whole = [np.frombuffer(f, np.uint8).reshape(*SMALL[::-1], 3) for f in reader]
    assert facts["size"] == SMALL
    assert facts["fps"] == 10
    assert len(whole) == 6
    # what was drawn comes back: the first frame is the first record
    drawn = frame(made_up(), 0, film(fps=10, duration=0.6))
    assert np.mean(np.abs(whole[0].astype(float) - drawn)) < 3.0
    assert np.mean(np.abs(whole[0].astype(float) - whole[-1])) > 0.3


def test_frames_show_the_nearest_records_between_the_times_asked_for():
    data = made_up()
    assert _records(data, film(first=0.2, last=0.6)) == [2, 3, 4, 5, 6]
    assert _records(data, film(fps=5, duration=0.8)) == [0, 3, 7, 10]
    assert len(_records(data, film(fps=30, duration=1.0))) == 30
    with pytest.raises(InputError, match="stored range"):
        _records(data, film(last=2.0))
    with pytest.raises(InputError, match="from"):
        _records(data, film(first=0.6, last=0.2))


def test_flat_shapes_have_a_plane_and_others_perspective():
    def plane(data, **choices):
        return _scene(data, film(**choices), [0, 5, 10]).plane

    assert plane(made_up(2)) == "xy"
    assert plane(made_up(2, flat=False)) is None
    assert plane(made_up(20)) is None
    assert plane(made_up(2), orbit=90.0) is None
    assert plane(made_up(2), view="3d") is None
    assert plane(made_up(2, flat=False), view="plane") == "xy"


def test_limits_and_colours_hold_for_the_whole_movie():
    data = sheared()
    choice = film()
    scene = _scene(data, choice, _records(data, choice))
    for shot in _shots(data, choice, _records(data, choice)):
        assert np.all(shot.points >= scene.low - 1e-12)
        assert np.all(shot.points <= scene.high + 1e-12)
        middle = shot.points[:, 4].copy()
        middle[:, 0] -= shot.slant * middle[:, 1]
        assert np.all((middle > -1e-12) & (middle < np.array(PERIODS) + 1e-12))
    assert scene.paint is not None
    most = np.abs(data["trajectory"]["tension"].to_numpy()).max()
    assert (scene.paint.low, scene.paint.high) == (-most, most)
    slants = [s.slant for s in _shots(data, choice, [0, 3])]
    assert slants == pytest.approx([0.0, 0.3])


@pytest.mark.parametrize("orbit", [0.0, 200.0])
def test_what_is_seen_fills_the_picture_and_nothing_is_cut_off(orbit):
    data = sheared()
    choice = film(size=(640, 480), series="none", orbit=orbit)
    records = _records(data, choice)
    stage = Stage(_scene(data, choice, records))
    axes, tall = stage._axes, 0.0
    for shot in _shots(data, choice, records):
        stage.draw(shot)
        cell = Cell(np.stack([np.zeros(3), PERIODS], axis=1), np.array(PERIODS), shot.slant)
        points = np.concatenate([shot.points.reshape(-1, 3), cell.corners()])
        at = axes.bbox.p0 + seen_at(axes, points) * axes.bbox.size
        assert np.all(at > -1.0)
        assert np.all(at < np.array([641.0, 481.0]))
        tall = max(tall, float(np.ptp(at[:, 1])))
    assert tall > 0.53 * 480


@pytest.mark.parametrize(
    ("size", "dpi"),
    [
        ((1280, 720), 150),
        ((640, 360), 75),
        ((720, 1280), 150),
        ((320, 180), 72),
        ((3840, 2160), 450),
        ((160, 4096), 100),
    ],
)
def test_text_follows_the_size_but_stays_legible(size, dpi):
    assert Film(size=size).resolution == dpi
    assert Film(size=size, dpi=90).resolution == 90


@pytest.mark.parametrize("size", [(320, 180), (320, 240), (160, 160), (640, 360), (360, 640)])
@pytest.mark.parametrize("dpi", [None, 95])
def test_in_a_small_frame_the_picture_keeps_its_room(size, dpi):
    data, choice = made_up(), Film(size=size, dpi=dpi, workers=1, series="auto")
    stage = Stage(_scene(data, choice, _records(data, choice)))
    (shot,) = _shots(data, choice, [3])
    stage.draw(shot)
    width, height = size
    inside = stage._axes.get_window_extent()
    assert min(inside.width, inside.height) > 0.3 * min(size)
    strip, bar = has_room(size, choice.resolution)
    assert len(stage._figure.axes) == 1 + strip + bar
    renderer = stage._canvas.get_renderer()
    for axes in stage._figure.axes:
        for label in (axes.xaxis.label, axes.yaxis.label):
            box = label.get_window_extent(renderer)
            assert box.x0 >= 0.0
            assert box.y0 >= 0.0
            assert box.x1 <= width
            assert box.y1 <= height


def test_a_small_frame_leaves_out_what_has_no_room():
    assert has_room((1280, 720), 150) == (True, True)
    assert has_room((320, 180), 72) == (False, True)
    assert has_room((160, 160), 72) == (False, False)
    data = made_up()
    small = film(size=(320, 180), dpi=95, series="shear_stress")
    with pytest.raises(InputError, match="room for the series") as caught:
        _scene(data, small, [0, 5])
    assert caught.value.where == "size"
    assert _scene(data, film(size=(320, 180), dpi=50, series="shear_stress"), [0, 5]).strip


def test_a_small_cell_has_no_words_at_its_edges():
    data = sheared()

    def shown(dpi):
        choice = film(size=(320, 240), dpi=dpi, series="none", colour=None)
        stage = Stage(_scene(data, choice, [0, 5, 10]))
        stage.draw(next(_shots(data, choice, [5])))
        return [text for text in stage._axes.texts if text.get_text()]

    assert shown(60)
    assert not shown(100)


@pytest.mark.parametrize("colour", ["tension", "curvature", "orientation", "fiber", None])
def test_each_colour_draws_in_both_views(colour):
    for data in (made_up(2), sheared()):
        picture = frame(data, 3, film(colour=colour))
        assert 0.01 < np.mean(np.any(picture < 200, axis=-1)) < 0.6


def test_the_marker_moves_and_the_camera_turns():
    data = sheared()
    still = film(colour=None)
    one, other = (frame(data, k, still) for k in (2, 8))
    assert np.any(one[-70:] != other[-70:])
    without = frame(data, 2, film(colour=None, series="none"))
    assert np.any(without != one)
    stage = Stage(_scene(data, film(orbit=90.0), [0]))
    shots = list(_shots(data, film(orbit=90.0), [4, 4]))
    assert shots[1].azimuth - shots[0].azimuth == 90.0
    assert stage.draw(shots[0]) != stage.draw(shots[1])


def test_a_dark_movie_is_dark():
    picture = frame(made_up(), 4, film(ground="dark"))
    assert np.mean(picture < 60) > 0.9


def test_several_processes_draw_the_same_frames():
    data = sheared()
    choice = film(series="none")
    scene = _scene(data, choice, [0, 5, 10])
    shots = list(_shots(data, choice, [0, 5, 10]))
    alone = list(movie_workers.frames(scene, shots, 1))
    assert list(movie_workers.frames(scene, shots, 2)) == alone


def test_a_process_that_ends_is_reported(monkeypatch):
    choice = film()
    scene = _scene(made_up(), choice, [0, 1])
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(StokesFibersError, match="process that draws"):
        list(movie_workers.frames(scene, _shots(made_up(), choice, [0, 1]), 2))


@pytest.mark.parametrize("name", ["a.gif", "a.mp4"])
def test_a_stop_half_way_leaves_no_file(name, tmp_path):
    if name.endswith("mp4"):
        pytest.importorskip("imageio_ffmpeg")

    def stop(number, _):
        if number == 4:
            raise KeyboardInterrupt

    old = tmp_path / name
    old.write_bytes(b"old")
    with pytest.raises(KeyboardInterrupt):
        movie(made_up(), old, film(), watch=stop)
    assert old.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [old]


def test_what_cannot_be_is_refused_before_a_frame_is_drawn(tmp_path, monkeypatch):
    for name in ("a.avi", "no/a.gif"):
        with pytest.raises(InputError, match="OUT"):
            movie(made_up(), tmp_path / name)
    wrong = [{"size": (321, 240)}, {"size": (100, 240)}, {"fps": 0}, {"view": "flat"}]
    wrong += [{"duration": -1}, {"colour": "speed"}, {"ground": "grey"}, {"workers": 0}]
    wrong += [{"dpi": 145, "size": (320, 180)}, {"dpi": 150, "size": (160, 160)}]
    for choice in wrong:
        with pytest.raises(InputError, match=next(iter(choice))):
            film(**choice)
    data = made_up()
    held = data["observables"].to_dataset().assign(extra_stress=("i", np.zeros(3)))
    data["observables"] = xr.DataTree(held)
    with pytest.raises(InputError, match="series"):
        movie(data, tmp_path / "a.gif", film(series="extra_stress"))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtraError, match="movie"):
        movie(made_up(), tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []
