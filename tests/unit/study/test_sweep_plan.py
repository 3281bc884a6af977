"""Sweep files: what they may say, and that everything is checked before anything runs."""

from __future__ import annotations

import json
from copy import deepcopy

import numpy as np
import pytest

from stokesfibers.core.errors import InputError
from stokesfibers.study.sweep_dataset import dataset
from stokesfibers.study.sweep_folder import SweepFolder
from stokesfibers.study.sweep_plan import Plan, read_plan

CASE = {
    "fiber": {"slenderness": 1e-2},
    "fluid": {"mu_bar": 1e3},
    "flow": {"kind": "shear"},
    "initial": {"kind": "nearly_straight", "angle": 2.0, "amplitude": 0.1},
    "stepping": {"rtol": 1e-3, "until": 1.0},
    "record": {"positions_every": 0.5, "observables_every": 0.05},
}
SWEEP = {
    "case": CASE,
    "grid": {"fluid.mu_bar": [1e3, 1e4]},
    "collect": {"final": ["elastic_energy"]},
}
GEOMSPACE = "got 'geomspaces'. Did you mean 'geomspace'?"
TWO_RANGES = {"linspace": [1.0, 2.0, 2], "geomspace": [1.0, 2.0, 2]}
FREE_SUSPENSION = {"kind": "suspension", "seed": 1, "box": [3.0, 3.0, 3.0], "least_gap": 0.1}


def _plan(**changes):
    tables = deepcopy(SWEEP) | changes
    return read_plan({k: v for k, v in tables.items() if v is not None})


def test_axes_multiply_and_the_last_is_the_fastest():
    plan = _plan(
        grid={"fluid": {"mu_bar": np.array([1e3, 1e4])}},
        zip=[{"name": "pair", "fiber.slenderness": [1e-2, 1e-3], "initial.amplitude": [0.1, 0.1]}],
        cases=[{"name": "slow", "flow.rate": 0.5}, {"name": "fast"}],
    )
    assert [axis.name for axis in plan.axes] == ["mu_bar", "pair", "case"]
    assert [len(axis.points) for axis in plan.axes] == [2, 2, 2]
    assert len(plan.cases) == 8
    assert plan.cases[1].values == {
        "fluid.mu_bar": 1e3,
        "fiber.slenderness": 1e-2,
        "initial.amplitude": 0.1,
    }
    assert plan.cases[2].values["flow.rate"] == 0.5
    assert plan.cases[2].values["fiber.slenderness"] == 1e-3
    assert plan.cases[2].tables["flow"] == {"kind": "shear", "rate": 0.5}
    assert len({case.key for case in plan.cases}) == 8


def test_seeds_are_an_axis():
    case = deepcopy(CASE) | {"initial": FREE_SUSPENSION, "fiber": {"count": 2, "slenderness": 1e-2}}
    plan = _plan(case=case, grid=None, seeds=3)
    assert [case.values for case in plan.cases] == [{"initial.seed": k} for k in range(3)]
    assert plan.axes[0].name == "seed"


def test_a_case_keeps_its_key_however_it_is_asked_for():
    key = _plan().cases[1].key
    assert _plan(grid={"fluid.mu_bar": [1e4, 5e4]}).cases[0].key == key
    assert _plan(set={"fluid.mu_bar": 1e4}, grid={"fiber.slenderness": [1e-2]}).cases[0].key == key
    assert read_plan(SWEEP | {"grid": {"fiber.slenderness": [1e-2]}}, ["fluid.mu_bar=1e4"]).cases[
        0
    ].key == (key)
    assert _plan(set={"stepping.until": 1.5}).cases[1].key != key


def test_the_same_case_asked_for_twice_shares_one_run():
    one, other = _plan(grid={}, cases=[{"name": "a"}, {"name": "b", "flow.rate": 1.0}]).cases
    assert (one.key, one.name) == (other.key, other.name)
    assert other.values == {"flow.rate": 1.0}


def test_a_changed_file_of_shapes_changes_the_key(tmp_path):
    points = np.zeros((21, 3))
    points[:, 0] = np.linspace(0.0, 1.0, 21)
    np.save(tmp_path / "points.npy", points)
    case = deepcopy(CASE) | {"initial": {"kind": "file", "path": str(tmp_path / "points.npy")}}
    before = _plan(case=case).cases[0].key
    np.save(tmp_path / "points.npy", points[:, [1, 0, 2]])
    assert _plan(case=case).cases[0].key != before


def test_how_a_number_is_written_does_not_change_the_key():
    case = deepcopy(CASE) | {"fluid": {"mu_bar": 1000}}
    plan = _plan(case=case, grid={"fiber.slenderness": [1e-2]})
    assert plan.cases[0].key == _plan().cases[0].key
    keys = [_plan(grid={"fiber.count": [n]}, set=_placed()).cases[0].key for n in (1, 2)]
    assert keys[0] != keys[1]


def _placed(seed=2**60):
    return {"initial": FREE_SUSPENSION | {"seed": seed}}


def test_seeds_beyond_the_digits_of_a_float_are_different_cases():
    keys = {_plan(set=_placed(seed)).cases[0].key for seed in (2**60, 2**60 + 1)}
    assert len(keys) == 2


def test_where_files_lie_does_not_change_the_key(tmp_path):
    points = np.zeros((21, 3))
    points[:, 0] = np.linspace(0.0, 1.0, 21)
    keys: dict[str, list[str]] = {"plain": [], "looks": []}
    for place in ("one", "two"):
        (tmp_path / place).mkdir()
        np.save(tmp_path / place / "points.npy", points)
        text = "def velocity(x, t):\n    return 0.0 * x\n"
        for name, line in (("plain", ""), ("looks", "PLACE = __file__\n")):
            file = tmp_path / place / f"{name}.py"
            file.write_text(line + text)
            case = deepcopy(CASE) | {
                "initial": {"kind": "file", "path": str(tmp_path / place / "points.npy")},
                "flow": {"kind": "python", "file": str(file)},
            }
            plan = read_plan(SWEEP | {"case": case}, allow_python=True)
            keys[name].append(plan.cases[0].key)
    assert keys["plain"][0] == keys["plain"][1]
    assert keys["looks"][0] != keys["looks"][1]
    assert keys["plain"][0] != keys["looks"][0]


def test_a_plan_survives_json():
    plan = _plan(zip=[{"flow.rate": [1.0, 2.0], "fiber.slenderness": [1e-3, 1e-2]}])
    assert Plan.from_table(json.loads(json.dumps(plan.to_table()))) == plan


def test_paths_in_a_file_start_from_it(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "base.toml").write_text(
        'fluid.mu_bar = 1e3\nflow.kind = "shear"\nstepping.until = 1.0\nfiber.slenderness = 1e-2\n'
        'initial = {kind = "file", path = "points.npy"}\n'
    )
    points = np.zeros((21, 3))
    points[:, 0] = np.linspace(0.0, 1.0, 21)
    np.save(tmp_path / "points.npy", points)
    file = tmp_path / "sub" / "sweep.toml"
    file.write_text(
        'base = "../base.toml"\ngrid.fluid.mu_bar = [1e3, 2e3]\ncollect.final = ["shear_stress"]\n'
    )
    plan = read_plan(file)
    assert plan.folder == str(tmp_path)
    assert len(plan.cases) == 2


@pytest.mark.parametrize(
    ("changes", "where", "told"),
    [
        ({"gird": {}}, "gird", "Did you mean 'grid'?"),
        ({"base": "a.toml"}, "base", "got both"),
        ({"case": None}, "base", "got neither"),
        ({"case": None, "base": "no-such.toml"}, "base", "'no-such.toml' in a sweep from Python"),
        ({"grid": None}, "sweep", "something to sweep"),
        ({"grid": {"fluid.mu_bar": [1e3, -1.0]}}, "fluid.mu_bar", "-1.0, in the case mu_bar=-1"),
        ({"grid": {"fluid.mubar": [1e3]}}, "fluid.mubar", "Did you mean 'mu_bar'?"),
        ({"grid": {"fibre.length": [1.0]}}, "grid.fibre.length", "Did you mean 'fiber.length'"),
        ({"grid": {"a b.c": [1.0]}}, "grid.a b.c", "the path of a key, such as fluid.mu_bar"),
        ({"set": {"fibre.length": 1.0}}, "set.fibre.length", "Did you mean 'fiber.length'"),
        ({"cases": [{"fibre.length": 1.0}]}, "cases[0].fibre.length", "a key of the case"),
        ({"zip": [{"fibre.length": [1.0]}]}, "zip[0].fibre.length", "a key of the case"),
        ({"grid": {"fluid.mu_bar": {"geomspaces": [1, 2, 2]}}}, "grid.fluid.mu_bar", GEOMSPACE),
        ({"zip": [{"flow.rate.geomspaces": [1, 2, 2]}]}, "zip[0].flow.rate", GEOMSPACE),
        ({"grid": {"fluid.mu_bar": TWO_RANGES}}, "grid.fluid.mu_bar", "expected one range"),
        ({"grid": {"load.force.1": [-1.0]}}, "sweep.load.force.1", "Give the whole list first"),
        ({"set": {"fluid.mu_bar": 1.0}}, "set", "a key that is not swept"),
        ({"set": {"stepping.rtol": -1.0}}, "stepping.rtol", "-1.0"),
        ({"zip": [{"flow.rate": [1.0], "fiber.length": [1.0, 2.0]}]}, "zip[0]", "one length"),
        ({"zip": [{}]}, "zip[0]", "one length"),
        ({"zip": [{"name": 3, "flow.rate": [1.0]}]}, "zip[0].name", "a text"),
        ({"zip": [{"fluid.mu_bar": [1e3]}]}, "fluid.mu_bar", "on two axes"),
        ({"zip": [{"name": "mu_bar", "flow.rate": [1.0]}]}, "sweep", "'mu_bar'"),
        ({"zip": [{"name": "time", "flow.rate": [1.0]}]}, "sweep", "'time'"),
        *(
            ({"zip": [{"name": name, "flow.rate": [1.0]}]}, "sweep", f"'{name}'")
            for name in ("status", "reason", "run", "time_reached", "wall_time")
        ),
        ({"zip": [{"name": "elastic_energy_final", "flow.rate": [1.0]}]}, "sweep", "'elastic_ene"),
        ({"cases": []}, "cases", "[[cases]]"),
        ({"cases": [{"name": "a"}, {"name": "a"}]}, "cases", "'a' twice"),
        ({"seeds": 2}, "initial.seed", "'seed', in the case mu_bar=1000,seed=0"),
        ({"collect": None}, "collect", "got nothing"),
        ({"collect": {"finally": []}}, "collect.finally", "Did you mean 'final'?"),
        ({"collect": {"final": ["energy"]}}, "collect.final", "elastic_energy"),
        ({"collect": {"final": "shear_stress"}}, "collect.final", "a list of names"),
        ({"collect": {"mean": ["centre"]}}, "collect.mean", "numbers: elastic_energy"),
        ({"collect": {"final": ["strain"]}}, "collect", "that this case records"),
        ({"collect": {"mean": ["shear_stress"], "after": 0.9}}, "collect.mean", "2 records"),
        ({"collect": {"mean": ["shear_stress"], "block": 0.3}}, "collect.mean", "four blocks"),
        ({"collect": {"final": ["shear_stress"], "after": 2.0}}, "collect.after", "the end, 1"),
        ({"collect": {"final": ["shear_stress"], "after": -2.0}}, "collect.after", "zero or above"),
    ],
)
def test_mistakes_are_told_with_their_place(changes, where, told):
    with pytest.raises(InputError) as caught:
        _plan(**changes)
    assert caught.value.where == where
    assert told in str(caught.value)


def test_a_base_that_is_not_there_is_told_with_its_sweep_and_the_file_that_was_meant(tmp_path):
    (tmp_path / "buckling.toml").write_text("")
    file = tmp_path / "sweep.toml"
    file.write_text('base = "bukling.toml"\ngrid.fluid.mu_bar = [1e3]\n')
    with pytest.raises(InputError) as caught:
        read_plan(file)
    assert str(caught.value) == (
        f"base: expected a case file, seen from the sweep file, got 'bukling.toml' in {file}, "
        "which is not there. Did you mean 'buckling.toml'?"
    )
    with pytest.raises(InputError, match=r"expected a sweep file, got nothing: no such file"):
        read_plan(tmp_path / "none.toml")


def test_an_entry_of_a_vector_is_a_numeric_axis(tmp_path):
    case = deepcopy(CASE) | {"load": {"kind": "gravity", "force": [0.0, -1.0, 0.5]}}
    plan = _plan(case=case, grid={"load.force.1": [-10.0, -100.0]})
    assert plan.axes[0].name == "force_1"
    assert [case.tables["load"]["force"] for case in plan.cases] == [
        [0.0, -10.0, 0.5],
        [0.0, -100.0, 0.5],
    ]
    assert plan.cases[0].name.startswith("force_1=-10-")
    force = dataset(SweepFolder(tmp_path), plan)["force_1"]
    assert force.to_numpy().tolist() == [-10.0, -100.0]
    assert force.attrs == {
        "path": "load.force.1",
        "units": "force length^-1",
        "long_name": "load per length, along y",
    }
    nested = _plan(case=case, grid={"load": {"force": {"1": [-10.0, -100.0]}}})
    assert [case.key for case in nested.cases] == [case.key for case in plan.cases]


def test_a_swept_kind_drops_the_keys_of_the_old():
    plan = _plan(grid={"initial.kind": ["straight", "nearly_straight"]})
    assert [case.tables["initial"] for case in plan.cases] == [
        {"kind": "straight", "angle": 2.0},
        {"kind": "nearly_straight", "angle": 2.0, "amplitude": 0.1},
    ]


def test_settings_may_not_change_what_is_swept():
    with pytest.raises(InputError, match="a key that is not swept"):
        read_plan(SWEEP, ["fluid.mu_bar=1e4"])


def test_a_flow_from_python_needs_leave(tmp_path):
    (tmp_path / "flow.py").write_text("def velocity(x, t):\n    return 0.0 * x\n")
    flow = {"kind": "python", "file": str(tmp_path / "flow.py")}
    tables = SWEEP | {"case": deepcopy(CASE) | {"flow": flow}}
    with pytest.raises(InputError, match="--allow-python"):
        read_plan(tables)
    assert len(read_plan(tables, allow_python=True).cases) == 2
