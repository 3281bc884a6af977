"""Figures of suspensions: snapshots in the cell, orientation, flow reversals, velocity slices."""

from __future__ import annotations

import json

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from mpl_toolkits.mplot3d.proj3d import proj_transform

from stokesfibers import plot
from stokesfibers.core.errors import InputError
from stokesfibers.plot.case import periods, reversals
from stokesfibers.plot.geometry import curvature, wrapped

PERIOD = 0.75


@pytest.fixture
def cell(crowd):
    """Twelve fibers in a cell periodic in x, in an oscillating shear of four half periods."""
    crowd.attrs["case"] = json.dumps(
        {
            "flow": {"kind": "oscillatory_shear", "amplitude": 1.0, "frequency": 0.2},
            "domain": {"kind": "periodic", "periods": [PERIOD, 0.0, 0.0]},
        }
    )
    return crowd


def helix(nodes):
    t = np.linspace(0.0, 4.0, nodes)
    return np.stack([2.0 * np.cos(t), 2.0 * np.sin(t), 0.5 * t], axis=-1)[None]


def test_curvature_is_that_of_a_helix_to_second_order():
    exact = 2.0 / (2.0**2 + 0.5**2)
    coarse, fine = (np.abs(curvature(helix(n))[0, 1:-1] - exact).max() for n in (41, 81))
    assert fine < 2e-4
    assert coarse / fine == pytest.approx(4.0, rel=0.05)
    assert curvature(helix(41))[0, [0, -1]].tolist() == [0.0, 0.0]


def test_whole_fibers_are_shifted_until_their_middles_lie_in_the_cell():
    line = np.linspace([-0.4, 0.0, 0.0], [0.4, 0.0, 0.0], 5)
    fibers = np.stack([line + np.array([3.1, 5.0, 0.0]), line + np.array([-0.2, -5.0, 2.3])])
    moved = wrapped(fibers, np.array([2.0, 0.0, 2.0]))
    np.testing.assert_allclose(moved[0], line + np.array([1.1, 5.0, 0.0]), rtol=0, atol=1e-14)
    np.testing.assert_allclose(moved[1], line + np.array([1.8, -5.0, 0.3]), rtol=0, atol=1e-14)


def drawn_fibers(ax):
    """Return the coloured segments and their colours, without the white rims and the box."""
    lines = ax.collections[-1]
    colours = lines.get_colors()
    ink = ~np.all(colours == 1.0, axis=1)
    return np.array(lines._segments3d)[ink], colours[ink], np.all(colours == 1.0, axis=1)


def test_perspective_draws_every_segment_wrapped_with_its_tension(cell):
    ax = plot.perspective(cell, time=6.0)
    record = cell["trajectory"].to_dataset().isel(time=24)
    points = wrapped(record["position"].to_numpy(), periods(cell))
    expected = np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 3)
    segments, colours, _ = drawn_fibers(ax)
    assert len(segments) == 12 * 20
    order = np.lexsort(expected.reshape(-1, 6).T)
    found = np.lexsort(segments.reshape(-1, 6).T)
    np.testing.assert_array_equal(segments[found], expected[order])
    # All tensions are positive at t = 6, so all colours are on the warm side of the map.
    assert np.all(colours[:, 0] >= colours[:, 2])
    tension = record["tension"].to_numpy()
    bar = ax.figure.axes[1]
    most = np.abs(tension).max()
    np.testing.assert_allclose(bar.get_ylim(), [-most, most], rtol=1e-12)
    assert bar.get_ylabel() == "line tension $T$ [force]"


def test_perspective_shows_near_segments_over_far_ones(cell):
    ax = plot.perspective(cell, time=6.0, colour=None)
    segments, colours, rims = drawn_fibers(ax)
    depth = proj_transform(*segments.mean(axis=1).T, ax.get_proj())[2]
    assert np.all(np.diff(depth) <= 0.0)
    assert rims.sum() == len(segments)
    np.testing.assert_allclose(colours, np.tile(to_rgba("#0072B2"), (240, 1)), rtol=1e-12)
    # The viewer looks at the plane of flow and gradient: depth falls towards +z.
    toward = proj_transform(*np.array([[0.3, 0.3], [0, 0], [-0.1, 0.1]]), ax.get_proj())
    assert toward[2][1] < toward[2][0]
    right = proj_transform(*np.array([[0.1, 0.5], [0, 0], [0, 0]]), ax.get_proj())
    assert right[0][1] > right[0][0]


def test_perspective_colours_by_curvature_with_its_unit(cell):
    ax = plot.perspective(cell, time=6.0, colour="curvature")
    bar = ax.figure.axes[1]
    position = cell["trajectory"]["position"].to_numpy()[24]
    np.testing.assert_allclose(bar.get_ylim(), [0.0, curvature(position).max()], rtol=1e-12)
    assert bar.get_ylabel() == r"curvature $\kappa$ [length$^{-1}$]"


def test_perspective_has_equal_scales_and_holds_the_cell_and_all_fibers(cell):
    ax = plot.perspective(cell)
    limits = np.array([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()])
    ax.set_proj_type("ortho")
    corners = limits.mean(axis=1)[:, None] + np.hstack([np.zeros((3, 1)), 0.1 * np.eye(3)])
    across, up, _ = proj_transform(*corners, ax.get_proj())
    turned = np.stack([across[1:] - across[0], up[1:] - up[0]])
    # Equal scales: two rows of a rotation, times one number.
    gram = turned @ turned.T
    np.testing.assert_allclose(gram / gram[0, 0], np.eye(2), rtol=0, atol=1e-12)
    points = drawn_fibers(ax)[0].reshape(-1, 3)
    assert np.all(points >= limits[:, 0] - 1e-12)
    assert np.all(points <= limits[:, 1] + 1e-12)
    box = np.array(ax.collections[0]._segments3d)
    assert box.shape == (12, 2, 3)
    assert [box[..., 0].min(), box[..., 0].max()] == [0.0, PERIOD]
    assert len(ax.collections) == 1 + 2 + 1  # edges, the two periodic faces, fibers
    words = " ".join(text.get_text() for text in ax.texts)
    assert "$x$ [length]\n0 to 0.75 (period)" in words
    assert "$t = 10$" in words
    assert words.count("(period)") == 1
    assert "$y$ [length]\n" in words


def test_perspective_refuses_flat_axes_other_colours_and_missing_positions(cell):
    with pytest.raises(InputError, match="projection"):
        plot.perspective(cell, ax=plot.new_axes())
    with pytest.raises(InputError, match="curvature"):
        plot.perspective(cell, colour="speed")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="between 0 and 10"):
        plot.perspective(cell, time=11.0)
    cell["trajectory"]["position"][-1, 3] = np.nan
    with pytest.raises(InputError, match="finite"):
        plot.perspective(cell)


def test_orientation_is_the_density_of_angles_without_heads(cell):
    angles = np.repeat([0.1, 0.5, 1.0, 1.5], 3)
    along = np.where(np.arange(12) % 2 == 0, 1.0, -1.0)  # turned round: the same angle
    ends = np.stack([along * np.cos(angles), 0.6 * np.sin(angles), 0.8 * np.sin(angles)], -1)
    s = np.linspace(0.0, 1.0, 21)[:, None]
    cell["trajectory"]["position"][0] = ends[:, None] * s
    ax = plot.orientation(cell, times=[0.0])
    (steps,) = ax.patches
    density, edges, _ = steps.get_data()
    assert len(edges) == 6
    expected, _ = np.histogram(angles, np.linspace(0.0, np.pi / 2, 6), density=True)
    np.testing.assert_allclose(density, expected, rtol=1e-12)
    (sine,) = ax.get_lines()
    np.testing.assert_allclose(sine.get_ydata(), np.sin(sine.get_xdata()), rtol=0, atol=1e-14)
    assert ax.get_legend_handles_labels()[1] == ["$t = 0$", r"$\sin\theta$"]
    assert ax.get_legend().get_title().get_text() == "12 fibers"


def test_orientation_draws_first_and_last_by_default_and_needs_ends(cell):
    assert len(plot.orientation(cell).patches) == 2
    cell["trajectory"]["position"][-1] = 0.0
    with pytest.raises(InputError, match="ends lie apart"):
        plot.orientation(cell)


def test_order_draws_the_tensor_and_the_reversals(cell):
    time = cell["observables"]["time"].to_numpy()
    tensor = np.zeros((len(time), 3, 3))
    tensor[:, 0, 0], tensor[:, 1, 1] = np.cos(time) ** 2, np.sin(time) ** 2
    tensor[:, 0, 1] = tensor[:, 1, 0] = np.cos(time) * np.sin(time)
    cell["observables"]["orientation_tensor"][:] = tensor
    ax = plot.order(cell)
    drawn = {line.get_label(): line for line in ax.get_lines()}
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1)):
        name = rf"$\langle p_{'xyz'[i]} p_{'xyz'[j]} \rangle$"
        np.testing.assert_array_equal(drawn[name].get_ydata(), tensor[:, i, j])
    assert r"$\langle p_x p_z \rangle$" not in drawn
    assert "flow reverses" in drawn


def test_reversals_are_the_half_periods_inside(cell):
    np.testing.assert_allclose(reversals(cell, 0.0, 10.0), [2.5, 5.0, 7.5], rtol=1e-14)
    np.testing.assert_allclose(reversals(cell, 2.4, 5.1), [2.5, 5.0], rtol=1e-14)
    np.testing.assert_allclose(reversals(cell, 2.5 + 1e-12, 7.5 - 1e-12), [5.0], rtol=1e-14)


@pytest.mark.parametrize("kind", ["energy", "stress", "shear_stress"])
def test_series_mark_the_reversals_of_an_oscillating_flow_only(kind, cell):
    def draw():
        return plot.KINDS[kind](cell) if kind in plot.KINDS else plot.series(cell, kind)

    ax = draw()
    marks = [line.get_xdata()[0] for line in ax.get_lines() if line.get_linestyle() == "--"]
    marks = [x for x in marks if x in (2.5, 5.0, 7.5)]
    assert marks == [2.5, 5.0, 7.5]
    shown = [text.get_text() for text in ax.get_legend().get_texts()]
    assert shown.count("flow reverses") == 1
    np.testing.assert_allclose(ax.get_xlim(), [0.0, 10.0], rtol=0, atol=1e-12)
    cell.attrs["case"] = json.dumps({"flow": {"kind": "shear", "rate": 1.0}})
    assert "flow reverses" not in draw().get_legend_handles_labels()[1]


def test_too_many_reversals_are_not_drawn(cell):
    flow = {"kind": "oscillatory_shear", "amplitude": 1.0, "frequency": 50.0}
    cell.attrs["case"] = json.dumps({"flow": flow})
    assert "flow reverses" not in plot.stress(cell).get_legend_handles_labels()[1]


def test_a_damaged_case_is_refused(cell):
    cell.attrs["case"] = "not tables"
    with pytest.raises(InputError, match="JSON"):
        plot.stress(cell)


def plane():
    x, y = np.linspace(0.0, 2.0, 21), np.linspace(-0.5, 0.5, 11)
    u = np.zeros((11, 21, 3))
    u[..., 0], u[..., 1], u[..., 2] = y[:, None], 0.1 * x, 0.3
    return x, y, u


def test_a_slice_shows_the_speed_and_masks_the_inside_of_fibers(tmp_path):
    x, y, u = plane()
    u[4, 7, 1] = np.nan
    line = np.stack([np.linspace(0.2, 1.2, 9), np.zeros(9)], axis=-1)
    ax = plot.velocity_slice(x, y, u, fibers=[line])
    speed = ax.collections[0].get_array()
    expected = np.sqrt(y[:, None] ** 2 + 0.01 * x**2 + 0.09)
    expected[4, 7] = np.nan
    np.testing.assert_allclose(np.ma.filled(speed, np.nan), expected, rtol=1e-14)
    np.testing.assert_array_equal(ax.get_lines()[0].get_xydata(), line)
    streams = ax.collections[1].get_segments()
    assert len(streams) > 20
    hole = np.abs(np.concatenate(streams) - [x[7], y[4]])
    assert not np.any(np.all(hole < 0.04, axis=1))
    assert ax.get_xlabel() == "$x$ [length]"
    assert plot.save(ax, tmp_path / "slice.png", dpi=60).exists()


def test_a_slice_refuses_what_it_cannot_draw():
    x, y, u = plane()
    with pytest.raises(InputError, match="equal steps"):
        plot.velocity_slice(x**2, y, u)
    with pytest.raises(InputError, match=r"\(11, 21, 2\)"):
        plot.velocity_slice(x, y, u.swapaxes(0, 1))
    with pytest.raises(InputError, match="finite"):
        plot.velocity_slice(x, y, np.full_like(u, np.nan))
    with pytest.raises(InputError, match="node"):
        plot.velocity_slice(x, y, u, fibers=[np.zeros((4, 5))])
