"""Changing a case by --set, and what a resolved case says."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from stokesfibers.config.case import apply_setting, case_from_tables, load_case, read_tables
from stokesfibers.core.errors import InputError
from stokesfibers.flow import Shear, SumOfFlows, Uniform
from stokesfibers.problem.engine import PaperEngine, SpectralEngine
from stokesfibers.problem.tables import problem_from_tables, problem_to_tables
from stokesfibers.slender.mobility import NonLocal
from stokesfibers.slender.regularization import SpheroidalRegularization

TEXT = """\
[fiber]
length = 2.0
slenderness = 1e-2
rigidity = 3.0
[fluid]
viscosity = 0.5
[flow]
kind = "sum"
flows = [{kind = "shear", rate = 2.0}, {kind = "uniform", velocity = [0.0, 0.5, 0.0]}]
[initial]
kind = "straight"
angle = 0.3
[model.regularization]
kind = "spheroidal"
[stepping]
until = 4.0
[record]
points = 11
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(TEXT)
    return path


@pytest.mark.parametrize(
    ("setting", "path", "value"),
    [
        ("fiber.length=3.5", ("fiber", "length"), 3.5),
        ("stepping.dt = 1e-3", ("stepping", "dt"), 1e-3),
        ("fluid.mu_bar=4e5", ("fluid", "mu_bar"), 4e5),
        ("engine=paper", ("engine",), "paper"),
        ('engine="paper"', ("engine",), "paper"),
        ("flow.flows[0].rate=-1", ("flow", "flows", 0, "rate"), -1),
        ("initial.centre=[1, 2, 3]", ("initial", "centre"), [1, 2, 3]),
        ("model.regularization.m=3.0", ("model", "regularization", "m"), 3.0),
        ("constraint.beta=10", ("constraint", "beta"), 10),
        ("initial.path=a=b.npy", ("initial", "path"), "a=b.npy"),
    ],
)
def test_setting_lands_where_it_says(setting, path, value):
    tables = tomllib.loads(TEXT)
    apply_setting(tables, setting)
    found = tables
    for step in path:
        found = found[step]
    assert found == value
    assert type(found) is type(value)


def test_new_way_to_say_the_same_replaces_the_old():
    tables = tomllib.loads(TEXT)
    apply_setting(tables, "fluid.mu_bar=1.0")
    apply_setting(tables, "fiber.radius=0.1")
    assert tables["fluid"] == {"mu_bar": 1.0}
    assert tables["fiber"] == {"length": 2.0, "rigidity": 3.0, "radius": 0.1}
    apply_setting(tables, "fiber.slenderness=0.1")
    assert "radius" not in tables["fiber"]


@pytest.mark.parametrize(
    ("before", "setting", "after"),
    [
        ({"rtol": 1e-4, "newton_passes": 2}, "stepping.dt=0.1", {"newton_passes": 2, "dt": 0.1}),
        ({"dt": 0.1, "order": 3}, "stepping.rtol=1e-3", {"rtol": 1e-3}),
        ({"nodes": 20, "adapt_nodes": True}, "discretization.intervals=50", {"intervals": 50}),
        ({"intervals": 50}, "discretization.nodes=20", {"nodes": 20}),
        ({"intervals": 50}, "discretization.adapt_nodes=true", {"adapt_nodes": True}),
    ],
)
def test_new_choice_of_steps_or_points_replaces_the_old(before, setting, after):
    place = setting.partition(".")[0]
    tables = {place: dict(before)}
    apply_setting(tables, setting)
    assert tables == {place: after}


@pytest.mark.parametrize(
    ("before", "setting", "after"),
    [
        (
            "initial = {kind = 'nearly_straight', angle = 1.0, amplitude = 0.1}",
            "initial.kind=straight",
            {"initial": {"kind": "straight", "angle": 1.0}},
        ),
        (
            "initial = {kind = 'nearly_straight', amplitude = 0.1, amplitud = 0.2}",
            "initial.kind=file",
            {"initial": {"kind": "file", "amplitud": 0.2}},
        ),
        (
            "domain = {kind = 'periodic', periods = [2, 2, 2], sum = 'truncated', reach = 3}",
            "domain.kind=sheared",
            {"domain": {"kind": "sheared", "periods": [2, 2, 2]}},
        ),
        (
            "flow = {kind = 'sum', flows = [{kind = 'shear', rate = 1}]}",
            "flow.flows[0].kind=uniform",
            {"flow": {"kind": "sum", "flows": [{"kind": "uniform"}]}},
        ),
        (
            "model.regularization = {kind = 'paper', m = 3, ramp = 0.2}",
            "model.regularization.kind=constant",
            {"model": {"regularization": {"kind": "constant", "m": 3}}},
        ),
        (
            "initial.orientation = {kind = 'aligned', axis = [1, 0, 0]}",
            "initial.orientation.kind=isotropic",
            {"initial": {"orientation": {"kind": "isotropic"}}},
        ),
        (
            "load = {kind = 'gravity', force = [0, -1, 0]}",
            "load.kind=gravitty",
            {"load": {"kind": "gravitty", "force": [0, -1, 0]}},
        ),
    ],
)
def test_a_new_kind_drops_what_only_the_old_one_has(before, setting, after):
    tables = tomllib.loads(before)
    apply_setting(tables, setting)
    assert tables == after


@pytest.mark.parametrize("path", ["load.force.1", "load.force[1]", "load. force.1 "])
def test_an_entry_of_a_vector_is_set_by_its_place(path):
    tables = {"load": {"kind": "gravity", "force": [0.0, -1.0, 0.0]}}
    apply_setting(tables, f"{path}=-20.0")
    assert tables["load"]["force"] == [0.0, -20.0, 0.0]


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("load.force.3=1.0", "expected 'load.force' to be a list with a place 3, got 'load.force"),
        ("load.kind.0=1.0", "expected 'load.kind' to be a list with a place 0"),
        (
            "initial.centre.0=1.0",
            "place 0, got 'initial.centre.0=1.0'. Give the whole list first: i",
        ),
        ("fluid", "got 'fluid'. For example fluid.mu_bar=VALUE, without blanks."),
        ("fluid.viscosity", "For example fluid.viscosity=VALUE, without blanks."),
        ("0.x=1", "--set: expected table.key=value"),
    ],
)
def test_settings_that_lead_nowhere_say_what_would(setting, told):
    tables = {"load": {"kind": "gravity", "force": [0.0, -1.0, 0.0]}}
    with pytest.raises(InputError) as caught:
        apply_setting(tables, setting)
    assert caught.value.where == "--set"
    assert told in str(caught.value)


SPECTRAL = "stepping = {rtol = 1e-4, until = 5.0}\n"


@pytest.mark.parametrize(
    ("text", "settings", "told"),
    [
        (
            SPECTRAL,
            ["engine=paper"],
            "stepping.rtol: expected keys of engine = 'paper', got stepping.rtol, which is of "
            "engine = 'spectral'. Take stepping.dt instead, or leave it out, in the file or with "
            "--set 'stepping={until=5.0}'.",
        ),
        (
            SPECTRAL + "discretization = {nodes = 20, adapt_nodes = false}\n",
            ["engine=paper"],
            "got discretization.nodes, discretization.adapt_nodes and stepping.rtol, which are of "
            "engine = 'spectral'. Take discretization.intervals and stepping.dt instead, or leave "
            "them out, in the file or with --set 'discretization={}' --set 'stepping={until=5.0}'.",
        ),
        (
            SPECTRAL,
            ["constraint.beta=20"],
            "constraint.beta: expected keys of engine = 'spectral', got constraint.beta, which is "
            "of engine = 'paper'. Leave it out, in the file or with --set 'constraint={}'.",
        ),
        (
            SPECTRAL,
            ["discretization.intervals=100"],
            "which is of engine = 'paper'. Take discretization.nodes instead, or leave it out",
        ),
        (SPECTRAL, ["engine=paperr"], "got 'paperr'. Did you mean 'paper'?"),
    ],
)
def test_keys_of_another_engine_are_told_with_how_to_go_on(text, settings, told, tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(
        f"{text}fiber.slenderness = 1e-2\nfluid.mu_bar = 1e4\nflow = {{kind = 'shear'}}\n"
    )
    with pytest.raises(InputError) as caught:
        load_case(file, settings)
    assert told in str(caught.value)
    for hint in ("stepping={until=5.0}", "discretization={}", "constraint={}"):
        if hint in str(caught.value):
            settings = [*settings, hint]
    if "'paperr'" not in told:
        assert load_case(file, settings).until == 5.0


def test_a_step_that_is_set_makes_a_case_one_for_the_other_engine(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(
        f"{SPECTRAL}fiber.slenderness = 1e-2\nfluid.mu_bar = 1e4\nflow = {{kind = 'shear'}}\n"
    )
    paper = load_case(file, ["engine=paper", "stepping.dt=0.01"])
    assert isinstance(paper.problem.engine, PaperEngine)
    assert paper.problem.engine.dt == 0.01
    spectral = load_case(file, ["stepping.dt=0.01"])
    assert isinstance(spectral.problem.engine, SpectralEngine)
    assert (spectral.problem.engine.dt, spectral.problem.engine.rtol) == (0.01, None)


def test_fibers_in_a_list_are_named_by_number():
    tables = {"fiber": [{"length": 1.0}, {"length": 2.0}]}
    apply_setting(tables, "fiber[1].length=5.0")
    assert [f["length"] for f in tables["fiber"]] == [1.0, 5.0]
    with pytest.raises(InputError, match=r"Say which one: fiber\[0\]"):
        apply_setting(tables, "fiber.length=5.0")
    single = {"fiber": [{"length": 1.0}]}
    apply_setting(single, "fiber.length=5.0")
    assert single["fiber"][0]["length"] == 5.0


def test_resolved_case_rebuilds_the_same_problem(file):
    case = load_case(file)
    tables = json.loads(json.dumps(case.tables()))
    again = case_from_tables(tables)
    assert again.problem == case.problem
    assert again.initial == case.initial
    assert again.record == case.record
    assert again.until == case.until
    assert again.tables() == case.tables()


def test_case_says_what_the_file_says(file):
    problem = load_case(file).problem
    assert problem.flow == SumOfFlows((Shear(2.0), Uniform((0.0, 0.5, 0.0))))
    assert problem.mobility == NonLocal(SpheroidalRegularization())
    assert problem.drag == pytest.approx(4.0 * np.pi, rel=1e-15)
    assert problem.engine == SpectralEngine().resolved(2.0, problem.drag * 2.0 * 16.0 / 3.0)


def test_papers_engine_takes_step_and_penalty_from_the_rate(file):
    engine = load_case(file, ["engine=paper"]).problem.engine
    assert engine == PaperEngine(intervals=100, dt=engine.dt, beta=40.0)
    assert engine.dt == pytest.approx(1.28 / (100 * 2.0), rel=1e-15)


def test_defaults_are_spelled_out(file):
    tables = load_case(file, ["flow={kind='shear'}"]).tables()
    assert tables["flow"] == {"kind": "shear", "rate": 1.0}
    assert tables["model"]["regularization"]["m"] == 2.0
    assert tables["record"] == {"positions_every": 0.02, "points": 11}
    assert tables["engine"] == "spectral"
    assert tables["stepping"] == {"until": 4.0, "rtol": 1e-4, "newton_passes": 1}
    assert tables["discretization"] == {"nodes": 16, "adapt_nodes": True}
    paper = load_case(file, ["flow={kind='shear'}", "engine=paper"]).tables()
    assert paper["constraint"]["beta"] == 20.0
    assert paper["constraint"]["solver"] == "fixed_point"
    assert tables["domain"] == {"kind": "free"}
    assert tables["load"] == {"kind": "none"}


def test_shape_is_the_papers_when_none_is_given(file):
    tables = read_tables(file)
    del tables["initial"]
    assert case_from_tables(tables).tables()["initial"]["kind"] == "nearly_straight"


def test_initial_file_is_found_from_the_case_and_stored_absolute(file):
    np.save(file.with_name("shape.npy"), np.linspace([0.0, 0.0, 0.0], [0.0, 1.99, 0.0], 20))
    case = load_case(file, ["initial={kind='file', path='shape.npy'}"])
    (curve,) = case.curves()
    ends = curve.at_fractions(np.array([0.0, 1.0]))
    np.testing.assert_allclose(ends, [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0]], atol=1e-12)
    assert case.tables()["initial"]["path"] == str(file.with_name("shape.npy").resolve())


def test_python_flow_gets_the_fibers_length_and_is_stored_with_its_checksum(file):
    source = file.with_name("wind.py")
    source.write_text("def gust(x, t):\n    return 0.0 * x + [1.0, 0.0, 0.0]\n")
    flow = "flow={kind='python', file='wind.py', velocity='gust'}"
    case = load_case(file, [flow, "stepping.dt=0.1"], allow_python=True)
    assert case.problem.flow.length_scale == 2.0
    stored = case.tables()["flow"]
    assert stored["file"] == str(source.resolve())
    rebuilt = problem_from_tables(case.tables(), allow_python=True)
    points = np.ones((2, 3))
    np.testing.assert_array_equal(rebuilt.flow.velocity(points, 0.0), [[1.0, 0.0, 0.0]] * 2)
    source.write_text(source.read_text().replace("1.0", "2.0"))
    with pytest.raises(InputError, match=r"flow\.file: .* a changed file"):
        problem_from_tables(case.tables(), allow_python=True)


def test_missing_gradient_that_was_named_is_refused(file):
    file.with_name("wind.py").write_text("def velocity(x, t):\n    return x\n")
    flow = "flow={kind='python', file='wind.py', gradient='slope'}"
    with pytest.raises(InputError, match=r"flow\.gradient: expected a function in"):
        load_case(file, [flow, "stepping.dt=0.1"], allow_python=True)


def test_flow_typed_in_python_cannot_be_rebuilt_and_says_so(file):
    from dataclasses import replace

    from stokesfibers.flow import TimeDependentShear, UserFlow

    problem = load_case(file).problem
    for flow in (UserFlow(lambda x, _t: x), TimeDependentShear(lambda t: t)):
        tables = problem_to_tables(replace(problem, flow=SumOfFlows((Shear(), flow))))
        tables = json.loads(json.dumps(tables))
        with pytest.raises(InputError, match=r"flow\.flows\[1\].*Resume it from Python"):
            problem_from_tables(tables, allow_python=True)


@pytest.mark.parametrize("key", ["length", "rigidity"])
@pytest.mark.parametrize("several", [False, True])
def test_a_viscosity_in_units_needs_length_and_rigidity_in_them(key, several):
    """Left out, they would be 1 in whatever the units are: wrong by many orders in SI."""
    tables = tomllib.loads(TEXT)
    del tables["fiber"][key]
    where = rf"fiber\.{key}"
    if several:
        tables["fiber"], where = [tables["fiber"]], rf"fiber\[0\]\.{key}"
    with pytest.raises(InputError, match=rf"^{where}: expected .* in the units of fluid.viscosity"):
        case_from_tables(tables)
    tables["fluid"] = {"mu_bar": 1e3}
    assert case_from_tables(tables).problem.mu_bar == 1e3


CYCLES = {
    "fiber": {"slenderness": 1e-2},
    "fluid": {"mu_bar": 1e3},
    "flow": {"kind": "oscillatory_shear", "frequency": 0.25},
    "stepping": {"cycles": 3.0},
}


def test_the_time_to_stop_may_be_in_cycles_of_the_flow():
    case = case_from_tables(CYCLES)
    assert case.until == 12.0
    assert case.record.positions_every == 12.0 / 200.0
    again = case_from_tables(case.tables())
    assert (again.until, "cycles" in again.tables()["stepping"]) == (12.0, False)


@pytest.mark.parametrize(
    ("change", "fragment"),
    [
        (
            {"flow": {"kind": "shear"}},
            "stepping.cycles: expected a flow that oscillates, got shear",
        ),
        ({"stepping": {"cycles": 3.0, "until": 1.0}}, "stepping: expected either until or cycles"),
        ({"stepping": {"cycles": -1.0}}, "stepping.cycles: expected a finite number above zero"),
        ({"stepping": {}}, "stepping.until: expected the time to stop, got nothing"),
    ],
    ids=str,
)
def test_cycles_that_cannot_be_are_refused(change, fragment):
    with pytest.raises(InputError, match=re.escape(fragment)):
        case_from_tables(CYCLES | change)


def test_until_and_cycles_replace_each_other():
    tables = {"stepping": {"until": 3.0}}
    apply_setting(tables, "stepping.cycles=4")
    assert tables == {"stepping": {"cycles": 4}}
    apply_setting(tables, "stepping.until=5.0")
    assert tables == {"stepping": {"until": 5.0}}
