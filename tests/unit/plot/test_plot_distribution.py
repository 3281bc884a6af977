"""Distributions over the fibers: numbers of circles and straight lines, and what is drawn."""

from __future__ import annotations

import json

import numpy as np
import pytest

from stokesfibers import plot
from stokesfibers.core.errors import InputError


def arcs(data, turns, lengths):
    """Make every record of `data` circular arcs that turn by `turns` over `lengths`."""
    s = np.linspace(0.0, 1.0, 21)
    radius = np.asarray(lengths) / np.asarray(turns)
    angle = np.asarray(turns)[:, None] * s
    points = np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], -1)
    data["trajectory"]["position"][:] = points * radius[:, None, None]
    data["trajectory"]["arclength"][:] = s * np.asarray(lengths)[:, None]
    return data


def test_curvature_counts_arclength_not_points(pair):
    # kappa L is the turn; the fiber of length 3 has three quarters of the arclength
    arcs(pair, [1.0, 2.0], [1.0, 3.0])
    found = plot.distribution(pair, "curvature", bins=[0.0, 0.5, 1.5, 2.5], times=[0.0])
    shares = (found * found["width"]).to_numpy()[0]
    # each end's half interval has none: 1/20 of the length in all
    np.testing.assert_allclose(shares, [0.05, 0.25 * 0.95, 0.75 * 0.95], rtol=1e-12)
    assert found.dims == ("time", "bin")
    np.testing.assert_array_equal(found["bin"], [0.25, 1.0, 2.0])


def test_distance_from_end_to_end_is_over_the_length_and_counts_fibers(pair):
    arcs(pair, [1.0, 2.0], [1.0, 3.0])
    chord = np.sin([0.5, 1.0]) / [0.5, 1.0]
    edges = [0.0, chord[1] - 1e-9, chord[1] + 1e-9, chord[0] - 1e-9, chord[0] + 1e-9]
    found = plot.distribution(pair, "end_to_end", bins=edges)
    assert found.sizes == {"time": 41, "bin": 4}
    shares = (found * found["width"]).to_numpy()
    np.testing.assert_allclose(shares, np.tile([0.0, 0.5, 0.0, 0.5], (41, 1)), atol=1e-12)


def test_the_second_moment_of_the_curvature_is_the_elastic_energy(run):
    record = run["trajectory"].to_dataset().isel(time=24)
    found = plot.distribution(run, "curvature", bins=4000, times=[float(record["time"])])
    second = float((found * found["bin"] ** 2 * found["width"]).sum())
    # int kappa^2 ds = 2 energy / rigidity, here from the turns of the polygon
    edges = np.diff(record["position"].to_numpy()[0], axis=0)
    unit = edges / np.linalg.norm(edges, axis=1, keepdims=True)
    turns = np.arccos(np.sum(unit[1:] * unit[:-1], axis=1))
    assert second == pytest.approx(np.sum(turns**2) / 0.05, rel=0.01)


def test_lost_fibers_are_left_out_and_a_lost_record_is_refused(pair):
    arcs(pair, [1.0, 2.0], [1.0, 1.0])
    pair["trajectory"]["position"][0, 1] = np.nan
    found = plot.distribution(pair, "curvature", bins=[0.0, 0.5, 1.5, 2.5], times=[0.0])
    np.testing.assert_allclose((found * found["width"]).to_numpy()[0], [0.05, 0.95, 0.0])
    pair["trajectory"]["position"][0] = np.nan
    with pytest.raises(InputError, match="finite"):
        plot.distribution(pair, "end_to_end")
    with pytest.raises(InputError, match="finite"):
        plot.curvature(pair)


@pytest.mark.parametrize("bins", [0, True, [1.0], [0.0, 1.0, 1.0], [[0.0, 1.0]]])
def test_bins_that_do_not_grow_are_refused(bins, pair):
    with pytest.raises(InputError, match="bins"):
        plot.distribution(pair, "curvature", bins=bins)


def test_other_quantities_and_times_are_refused(pair):
    with pytest.raises(InputError, match="curvature, end_to_end"):
        plot.distribution(pair, "length")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="between 0 and 10"):
        plot.curvature(pair, times=[11.0])


def test_the_figure_draws_quantiles_and_shares_of_larger_values(crowd):
    turns = 0.2 * np.arange(1, 13)
    arcs(crowd, turns, np.ones(12))
    chord = np.sort(np.sin(0.5 * turns) / (0.5 * turns))
    history, shares = plot.end_to_end(crowd, times=[0.0])
    by_label = {line.get_label(): line for line in history.get_lines()}
    # the median of twelve is the sixth: half of the fibers lie below or at it
    np.testing.assert_allclose(by_label["median"].get_ydata(), chord[5], rtol=1e-14)
    np.testing.assert_allclose(by_label["extremes"].get_ydata(), chord[0], rtol=1e-14)
    (step,) = shares.get_lines()
    assert step.get_drawstyle() == "steps-post"
    np.testing.assert_allclose(step.get_xdata()[1:-1], chord, rtol=1e-14)
    np.testing.assert_allclose(step.get_ydata()[1:-1], 1.0 - np.arange(1, 13) / 12, atol=1e-14)
    assert shares.get_ylabel() == "share of the fibers\nwith a larger value"
    low, high = shares.get_xlim()
    assert low < chord[0]
    assert high > 1.0
    assert history.get_ylim() == (low, high)


def test_the_figure_marks_reversals_and_the_times_below(crowd):
    flow = {"kind": "oscillatory_shear", "amplitude": 1.0, "frequency": 0.2}
    crowd.attrs["case"] = json.dumps({"flow": flow})
    history, shares = plot.curvature(crowd)
    assert "flow reverses" in [t.get_text() for t in history.get_legend().get_texts()]
    times = [float(line.get_label()) for line in shares.get_lines()]
    assert len(times) == 4
    marks = [line for line in history.get_lines() if line.get_marker() == "v"]
    assert [float(line.get_xdata()[0]) for line in marks] == pytest.approx(times)
    assert [m.get_color() for m in marks] == [s.get_color() for s in shares.get_lines()]
    assert shares.get_xlim()[0] == 0.0
    assert history.get_ylim() == shares.get_xlim()


def test_one_straight_fiber_still_has_a_figure(run, tmp_path):
    arcs(run, [1e-9], [1.0])
    for draw in (plot.curvature, plot.end_to_end):
        axes = draw(run)
        span = axes[1].get_xlim()
        assert span[1] - span[0] >= 0.004
        assert plot.save(axes, tmp_path / "a.png", dpi=50).exists()


def test_the_curve_of_curvatures_has_no_steps_between_recorded_points(run):
    """A curvature that falls evenly along a fiber is shared out evenly."""
    s, fine = np.linspace(0.0, 1.0, 21), np.linspace(0.0, 1.0, 2001)
    middle = 0.5 * (fine[1:] + fine[:-1])
    angle = 2.0 * middle - middle**2  # kappa = 2 (1 - s)
    for axis, part in enumerate((np.cos(angle), np.sin(angle), 0.0 * angle)):
        way = np.concatenate([[0.0], np.cumsum(part * np.diff(fine))])
        run["trajectory"]["position"][..., axis] = np.interp(s, fine, way)
    _, shares = plot.curvature(run, times=[0.0])
    (line,) = shares.get_lines()
    assert line.get_drawstyle() == "default"
    value, share = (np.asarray(part) for part in line.get_data())
    # from zero at the free end to 1.9 at the first point, then evenly down to zero
    inside = (value > 0.15) & (value < 1.85)
    np.testing.assert_allclose(share[inside], 1.0 - value[inside] / 1.9, atol=2e-3)
    drop = -np.diff(share[inside])
    assert drop.max() < 1.6 * drop.mean()
