"""``stokesfibers sweep``: what it says and returns, with good input and bad."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import xarray as xr

from stokesfibers.cli.sweep_cost import _rows
from stokesfibers.cli.sweep_held import held_dataset
from stokesfibers.cli.sweep_words import _line
from stokesfibers.cli.words import span
from stokesfibers.io.reader import open_run
from stokesfibers.run.estimate import Cost
from stokesfibers.study.sweep_folder import State
from stokesfibers.study.sweep_plan import read_plan
from stokesfibers.study.sweep_tally import Tally

SWEEPS = sorted((Path(__file__).parents[3] / "cases" / "sweeps").glob("*.toml"))
SWEEP = """\
[case]
fiber.slenderness = 1e-2
flow.kind = "shear"
initial = {kind = "nearly_straight", angle = 2.0, amplitude = 0.1}
stepping = {rtol = 1e-3, until = 0.5}
record = {positions_every = 0.25}

[grid]
fluid.mu_bar = [1e3, 1e4]

[collect]
final = ["elastic_energy"]
"""
NOWHERE = "error: nowhere: expected the folder of a sweep, with its sweep.json, got nothing there."
BROKEN_FLOW = """\
def velocity(x, t):
    if t > 0.3:
        raise RuntimeError("no wind")
    return 0.0 * x
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A sweep of two short cases, in the current folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "twofold.toml"
    path.write_text(SWEEP)
    return path


def test_the_plain_form_runs_the_sweep_and_says_where(file, invoke):
    result = invoke("sweep", file, "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "2 cases in twofold: 2 new." in result.stdout
    assert "done: 2 of 2 cases, stored in twofold/sweep.zarr" in result.stdout
    lines = result.stderr.splitlines()
    assert [line.partition("-")[0] for line in lines] == [
        "[1/2] done: mu_bar=1000",
        "[2/2] done: mu_bar=10000",
    ]
    data = xr.open_zarr("twofold/sweep.zarr").load()
    assert data["elastic_energy_final"].dims == ("mu_bar", "fiber")
    again = invoke("sweep", "--workers", 1, file, "--out", "twofold", "--quiet")
    assert (again.exit_code, again.output) == (0, "")


def test_settings_change_the_base_and_netcdf_is_written(file, invoke):
    words = ("--workers", 1, "--set", "stepping.until=0.25", "--netcdf", "out.nc")
    result = invoke("sweep", "run", file, *words)
    assert result.exit_code == 0, result.output
    data = xr.load_dataset("out.nc", engine="scipy")
    assert data["time_reached"].to_numpy().tolist() == [0.25, 0.25]
    assert data["status"].to_numpy().tolist() == ["done", "done"]


def test_dry_run_lists_the_cases_and_makes_nothing(file, invoke):
    result = invoke("sweep", file, "--dry-run")
    assert result.exit_code == 0
    assert "fluid.mu_bar" in result.stdout
    assert "mu_bar=10000-" in result.stdout
    cost = result.stdout.partition("\nCost\n")[2].splitlines()
    assert [line.split("-")[0].strip() for line in cost[:2]] == ["mu_bar=1000", "mu_bar=10000"]
    assert re.fullmatch(r"  all 2, if alike +about .+ on (one process|2 processes), .+ kB", cost[2])
    assert not Path("twofold").exists()


def test_dry_run_tells_the_groups_of_all_cases(file, invoke):
    """eta = mu_bar / 8.2103, threshold 306.4 in shear; B only where there is a weight.

    The arc's height is 0.1 / 256, of which |cos(2)| is across the fiber.
    """
    said = invoke("sweep", file, "--dry-run").stdout
    rows = [line.split("  ") for line in said.partition("of all cases\n")[2].splitlines()[:5]]
    groups = {row[1].strip(): " ".join(row[2:]).strip() for row in rows if len(row) > 2}
    assert groups["mu_bar"].startswith("1000 to 10000")
    assert groups["eta"].startswith("121.8 to 1218")
    assert groups["buckling"].startswith("0.3975 to 3.975")
    assert groups["bend"].startswith("0.000162557")
    assert "B" not in groups
    text = SWEEP.replace('flow.kind = "shear"', 'flow.kind = "none"')
    text = text.replace("[grid]\n", "[grid]\nload.force.1 = [-50.0, -20.0]\n").replace(
        "[case]", '[case]\nload = {kind = "gravity", force = [0.0, -1.0, 0.0]}\nfluid.mu_bar = 1.0'
    )
    file.write_text(text)
    said = invoke("sweep", file, "--dry-run").stdout
    assert re.search(r"B +20 to 50 ", said)
    assert "buckling" not in said


def test_groups_of_an_oscillating_shear_hold_its_strain(file, invoke):
    """1 / (pi f), to and fro."""
    wave = 'flow = {kind = "oscillatory_shear", frequency = 1.0}'
    text = SWEEP.replace('flow.kind = "shear"', wave).replace("until = 0.5", "cycles = 1")
    file.write_text(text.replace("[grid]\n", "[grid]\nflow.frequency = [0.1, 1.0]\n"))
    assert re.search(r"strain +0\.3183 to 3\.183 ", invoke("sweep", file, "--dry-run").stdout)
    case = file.with_name("one.toml")
    case.write_text(text.partition("[grid]")[0].replace("[case]\n", "fluid.mu_bar = 1e3\n"))
    assert re.search(r"strain +0\.31831 ", invoke("check", case).stdout)


def test_many_cases_are_told_by_ten_lines_and_each_that_failed(capsys):
    cases = [SimpleNamespace(key=str(k), name=f"case{k}") for k in range(40)]
    ends = ["failed" if k == 6 else "done" for k in range(40)]
    for k, case in enumerate(cases):
        states = [State(code if j <= k else "waiting", 1.0) for j, code in enumerate(ends)]
        _line(Tally(True, tuple(zip(cases, states, strict=True))), case)  # type: ignore[arg-type]
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 11
    assert said[1] == "[7/40] failed: case6"
    assert said[-1] == "[40/40] done: case39"


def test_values_that_differ_by_less_than_the_tolerance_are_doubted(file, invoke):
    file.write_text(SWEEP.replace("[1e3, 1e4]", "[1e3, 1.0001e3]"))
    result = invoke("sweep", file, "--workers", 1)
    row = next(x for x in result.stdout.splitlines() if "elastic_energy_final" in x)
    low, _, high = row.split()[1:]
    assert low != high  # enough digits to tell by how much
    said = invoke("sweep", "plot", "twofold").stderr
    assert "of them, and rtol = 0.001 allows errors as large" in said
    # how values differ with the tolerance is what such a sweep shows
    both = "[1e3, 1.0001e3]\nstepping.rtol = [1e-3, 1e-6]"
    file.write_text(SWEEP.replace("[1e3, 1e4]", both))
    assert invoke("sweep", file, "--workers", 1).exit_code == 0
    assert "allows errors" not in invoke("sweep", "plot", "twofold").stderr
    assert "allows errors" in invoke("sweep", "plot", "twofold", "--at", "rtol=1e-3").stderr
    assert "allows errors" not in invoke("sweep", "plot", "twofold", "--at", "rtol=1e-6").stderr
    file.write_text(SWEEP)
    assert invoke("sweep", file, "--workers", 1).exit_code == 0
    assert "allows errors" not in invoke("sweep", "plot", "twofold").stderr


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([1.0, 0.99997], "0.99997 to 1"),
        ([2.0], "2"),
        ([3.14159, 1e5], "3.142 to 100000"),
        ([1.0, 1.0 + 1e-12], "1"),
        ([0.0, 0.0], "0"),
        ([-1.0, 2e-9], "-1 to 2e-09"),
        ([1.2345e-5, 1.2346e-5], "1.2345e-05 to 1.2346e-05"),
        ([1.0, float("inf")], "1 to inf"),
        ([1e308, -1e308], "-1e+308 to 1e+308"),
    ],
)
def test_ranges_have_digits_that_tell_their_ends_apart(values, said):
    assert span(values) == said


def test_status_tells_counts_and_how_to_go_on(file, invoke):
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    result = invoke("sweep", "status", "twofold")
    assert result.exit_code == 0
    assert result.stdout.startswith("not running: twofold, 2 cases, 100 % done")
    assert "2 done" in result.stdout
    file.write_text(SWEEP.replace("[1e3, 1e4]", "[1e4, 1e5]"))
    assert "1 new, 1 kept" in invoke("sweep", file, "--dry-run").stdout
    result = invoke("sweep", file, "--workers", 1)
    assert "1 case of the last sweep not asked for any more: left out, kept" in result.stdout
    found = json.loads(invoke("sweep", "status", "twofold", "--json").stdout)
    assert found["counts"] == {
        "done": 2,
        "running": 0,
        "interrupted": 0,
        "waiting": 0,
        "failed": 0,
    }
    assert found["share"] == 1.0
    assert [state["values"] for state in found["states"]] == [
        {"fluid.mu_bar": 1e4},
        {"fluid.mu_bar": 1e5},
    ]
    assert all(Path(state["run"]).is_dir() for state in found["states"])


def test_a_failure_is_said_with_its_reason_and_gives_code_3(file, invoke):
    Path("flow.py").write_text(BROKEN_FLOW)
    flow = 'flow = {kind = "python", file = "flow.py"}'
    file.write_text(SWEEP.replace('flow.kind = "shear"', flow))
    assert invoke("sweep", file, "--workers", 1).exit_code == 2
    result = invoke("sweep", file, "--workers", 1, "--allow-python")
    assert result.exit_code == 3
    assert "error: 2 of 2 cases failed" in result.stderr
    assert "no wind" in result.stderr
    shown = invoke("sweep", "status", "twofold").stdout
    assert "2 failed" in shown
    # The function fails at another time in each case, and it is one reason all the same.
    assert shown.count("no wind") == result.stderr.count("no wind") == 1
    assert shown.count("The numbers are those of the first") == 1
    found = json.loads(invoke("sweep", "status", "twofold", "--json").stdout)
    assert len({state["reason"] for state in found["states"]}) == 2


def test_the_same_reason_is_said_once(file, invoke):
    start = 'initial = {kind = "lattice", cells = [1, 1, 2], box = [2.0, 2.0, 1e-3]}'
    text = SWEEP.replace(next(s for s in SWEEP.splitlines() if "initial" in s), start)
    file.write_text(text.replace("[case]", "[case]\nfiber.count = 2"))
    result = invoke("sweep", file, "--workers", 1)
    assert result.exit_code == 3
    assert result.stderr.count("fibers whose surfaces do not overlap") == 1
    assert result.stderr.count("mu_bar=10000-") == 2  # as it ended, and below the reason


def test_collect_makes_the_dataset_anew(file, invoke):
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    result = invoke("sweep", "collect", "twofold")
    assert (result.exit_code, result.stdout) == (0, "twofold/sweep.zarr holds 2 of 2 cases.\n")


def test_collect_names_a_run_that_was_changed(file, invoke, tmp_path):
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    chunk = min(tmp_path.glob("twofold/runs/*.zarr/observables/elastic_energy/c/0/0"))
    chunk.write_bytes(bytes(8) + chunk.read_bytes()[8:] + b"x")
    for words in (("collect", "twofold"), ("run", file, "--workers", 1)):
        result = invoke("sweep", *words)
        assert result.exit_code == 3
        assert "The run cannot be read" in result.stderr
        assert "can be trusted" not in result.stdout
        assert "'sweep --retry' runs the case anew" in result.stderr
    assert "1 failed" in invoke("sweep", "status", "twofold").stdout
    assert invoke("sweep", file, "--workers", 1, "--retry").exit_code == 0
    assert "failed" not in invoke("sweep", "status", "twofold").stdout


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("sweep", "no.toml"), "no.toml: expected a sweep file, got nothing: no such file"),
        (("sweep", "twofol.toml"), "Did you mean 'twofold.toml'?"),
        (("sweep", "status", "nowhere"), NOWHERE),
        (("sweep", "collect", "nowhere"), NOWHERE),
        (("sweep", "collect", "."), "with its sweep.json, got a folder without sweep.json."),
        (("sweep", "bad.toml"), "grid.fluid.mu_bar: expected different values"),
        (("sweep", "twofold.toml", "--out", "no/such"), "a missing folder. Make the folder"),
        (("sweep", "twofold.toml", "--set", "fluid.mu_bar=3"), "a key that is not swept"),
        (("sweep", "twofold.toml", "--workers", "0"), "0 is not in the range x>=1"),
        (("sweep", "twofold.toml", "--out", "."), "expected the folder of a sweep, or an empty"),
    ],
)
@pytest.mark.usefixtures("file")
def test_bad_input_is_told_with_code_2(invoke, words, told):
    Path("bad.toml").write_text(SWEEP.replace("[1e3, 1e4]", "[1e3, 1e3]"))
    result = invoke(*words)
    assert result.exit_code == 2
    assert told in result.stderr
    assert "Traceback" not in result.output


def test_help_names_the_plain_form_and_the_other_commands(invoke):
    said = invoke("sweep", "--help").stdout
    assert "sweep SWEEP.toml [OPTIONS] | COMMAND" in said
    for word in ("run", "status", "collect"):
        assert f"  {word} " in said
    assert "sweep status DIR [--json]" in said
    options = invoke("sweep", "run", "--help").stdout
    for option in ("--out", "--workers", "--scheduler", "--set", "--retry", "--dry-run"):
        assert f"  {option} " in options
        assert f"  {option} " in said


def test_doubtful_results_are_counted_and_explained(tmp_path, monkeypatch, invoke):
    monkeypatch.chdir(tmp_path)
    coarse = SWEEP.replace("rtol = 1e-3", "dt = 0.25, order = 1").replace(
        "amplitude = 0.1", "amplitude = 20.0"
    )
    Path("rough.toml").write_text(coarse.replace("[1e3, 1e4]", "[1e3, 1e5]"))
    result = invoke("sweep", "rough.toml", "--workers", 1)
    assert result.exit_code == 0
    assert "cannot be trusted; 'stokesfibers sweep status rough' says why." in result.stderr
    assert "can be trusted" not in result.stdout
    found = json.loads(invoke("sweep", "status", "rough", "--json").stdout)
    doubts = [state["doubt"] for state in found["states"]]
    assert found["doubtful"] == sum(map(bool, doubts)) > 0
    assert found["counts"]["done"] == 2
    held = xr.open_zarr("rough/sweep.zarr")["doubt"].to_numpy().tolist()
    assert doubts == held
    said = invoke("sweep", "status", "rough").stdout
    assert f"2 done, {found['doubtful']} of them doubtful" in said
    assert "\nDoubtful\n" in said
    assert next(filter(None, doubts)).rstrip(".") in said


def test_means_over_part_of_a_period_are_refused(file, invoke):
    waves = "flow = {kind = 'oscillatory_shear', frequency = 4.0}"
    text = SWEEP.replace('flow.kind = "shear"', waves) + 'mean = ["shear_stress"]\n'
    text = text.replace("positions_every = 0.25", "positions_every = 0.05")
    file.write_text(text.replace("frequency = 4.0", "frequency = 7.0"))
    assert "at least four whole periods of the flow, 0.142857" in invoke("sweep", file).stderr
    file.write_text(text.replace("frequency = 4.0", "frequency = 12.5") + "block = 0.1225\n")
    said = invoke("sweep", file).stderr
    assert "four whole periods of the flow, 0.08 each in blocks of 0.16, got 0.5" in said
    file.write_text(text.replace("frequency = 4.0", "frequency = 30.0"))
    said = invoke("sweep", file).stderr
    assert "at least 8 records in each period of the flow, 0.0333333, got one each 0.005" in said
    file.write_text(text.replace("frequency = 4.0", "frequency = 8.0"))
    assert invoke("sweep", file, "--dry-run").exit_code == 0


@pytest.mark.parametrize("shipped", SWEEPS, ids=lambda p: p.stem)
def test_shipped_sweeps_are_valid(shipped):
    assert len(read_plan(shipped).cases) >= 6


def test_some_sweeps_are_shipped():
    assert SWEEPS


def test_a_figure_of_a_sweep_is_one_command(file, invoke):
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    result = invoke("sweep", "plot", "twofold")
    assert result.exit_code == 0, result.output
    target = Path("twofold-elastic_energy_final.png")
    assert result.stdout.strip() == str(target.resolve())
    assert (
        "It shows elastic_energy_final; there are also: time_reached, wall_time." in result.stderr
    )
    assert target.stat().st_size > 5000
    result = invoke("sweep", "plot", "twofold", "wall_time", "--out", "t.pdf", "--at", "mu_bar=9e3")
    assert result.exit_code == 2
    assert "--at: expected a parameter to draw along, got a single case" in result.stderr
    for options, said in (
        (("elastic",), "NAME: expected one of elastic_energy_final"),
        (("--x", "mu"), "--x: expected a swept parameter: mu_bar"),
        (("--at", "mu_bar"), "--at: expected NAME=VALUE"),
        (("--out", "t.bmp"), "--out: expected a file name ending in .png"),
    ):
        result = invoke("sweep", "plot", "twofold", *options)
        assert (result.exit_code, said in result.stderr) == (2, True), result.stderr
    assert not Path("t.pdf").exists()
    assert "sweep plot twofold" in invoke("plot", "twofold", "shapes").stderr


def test_the_texts_of_a_figure_are_those_asked_for(file, invoke, monkeypatch):
    file.write_text(SWEEP.replace("[grid]\n", "[grid]\nfiber.slenderness = [1e-2, 2e-2]\n"))
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    drawn = []
    monkeypatch.setattr("stokesfibers.plot.save", lambda axes, path, _: drawn.append(axes) or path)
    texts = ("--label", "energy", "--xlabel", "viscosity", "--legend", "thickness")
    assert invoke("sweep", "plot", "twofold", *texts).exit_code == 0
    ((ax,),) = drawn
    title = ax.get_legend().get_title().get_text()
    assert (ax.get_ylabel(), ax.get_xlabel(), title) == ("energy", "viscosity", "thickness")


def test_a_sweep_that_has_not_ended_is_drawn_from_its_runs(file, invoke):
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    shutil.rmtree("twofold/sweep.zarr")
    files = ("--out", "t.svg", "--out", "t.png")
    result = invoke("sweep", "plot", "twofold", *files, "--dark")
    assert result.stdout.split() == ["t.svg", "t.png"]
    assert Path("t.svg").is_file()
    assert Path("t.png").is_file()


def test_what_all_cases_have_alike_is_said_for_the_caption(file, invoke):
    file.write_text(SWEEP.replace("[grid]\n", "[grid]\ninitial.angle = [1.0, 2.0]\n"))
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    said = invoke("sweep", "plot", "twofold").stderr.partition("In all cases: ")[2]
    assert said.strip() == (
        "fiber length 1, slenderness 0.01 (radius / length), rigidity 1; flow shear, rate 1; "
        "initial nearly straight, amplitude 0.1 (an arc of height up to 0.00039 L); "
        "mobility nonlocal; "
        "regularization spheroidal, m 2; rtol 0.001; until 0.5; recorded every 0.025."
    )
    file.write_text(SWEEP.replace("[grid]\n", "[grid]\nfiber.slenderness = [1e-2, 1e-3]\n"))
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    said = invoke("sweep", "plot", "twofold").stderr.partition("In all cases: ")[2]
    assert "amplitude 0.1 (an arc of height 0.00016 L)" in said  # |cos(2)| of 0.1 / 256
    assert said.strip().endswith("recorded every 0.025; slenderness is radius / length.")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("flow.rate = 5.0", "mu_bar 1000 (8 pi mu L^4 / E)"),
        ("flow.rate = -1.0", "mu_bar 1000 (8 pi mu |rate| L^4 / E)"),
        ('flow = {kind = "oscillatory_shear", frequency = 1}', "(8 pi mu amplitude L^4 / E)"),
    ],
)
def test_what_mu_bar_means_is_said_with_the_rate_only_where_that_is_one(file, invoke, text, told):
    shear = 'flow.kind = "shear"'
    text = text if "{" in text else f"{shear}\n{text}"
    grid = SWEEP.replace("fluid.mu_bar = [1e3, 1e4]", "initial.angle = [1.0, 2.0]")
    file.write_text(grid.replace(shear, f"fluid.mu_bar = 1e3\n{text}"))
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    assert told in invoke("sweep", "plot", "twofold").stderr


def test_cycles_that_not_all_cases_have_are_not_said(file, invoke):
    text = SWEEP.replace('kind = "shear"', 'kind = "oscillatory_shear"\nflow.frequency = 2.0')
    text = text.replace(", until = 0.5", "").partition("[grid]")[0]
    collect = '[collect]\nfinal = ["elastic_energy"]\n'
    ends = ("stepping.cycles = 1", "stepping.until = 0.7")
    cases = "".join(f'[[cases]]\nname = "{k}"\n{end}\n' for k, end in enumerate(ends))
    file.write_text(f"{text}{cases}{collect}".replace("[case]\n", "[case]\nfluid.mu_bar = 1e3\n"))
    result = invoke("sweep", file, "--workers", 1, "--quiet")
    assert result.exit_code == 0, result.output
    said = invoke("sweep", "plot", "twofold").stderr.partition("In all cases: ")[2]
    assert "frequency 2" in said
    assert "cycles" not in said.replace("cycles per time", "")


def test_names_of_files_are_said_as_they_are(file, invoke):
    Path("my_flow.py").write_text("def my_velocity(x, t):\n    return 0.0 * x\n")
    user = 'flow = {kind = "python", file = "my_flow.py", velocity = "my_velocity"}'
    file.write_text(SWEEP.replace('flow.kind = "shear"', user))
    result = invoke("sweep", file, "--workers", 1, "--quiet", "--allow-python")
    assert result.exit_code == 0, result.output
    said = invoke("sweep", "plot", "twofold").stderr.partition("In all cases: ")[2]
    assert "my_flow.py" in said
    assert "velocity my_velocity" in said


def test_lists_that_differ_share_what_is_alike_in_them(file, invoke):
    kinds = "fiber = [{slenderness = 1e-2}, {slenderness = 2e-2}]"
    lattice = 'initial = {kind = "lattice", cells = [2, 1, 1], box = [4, 4, 4]}'
    text = SWEEP.replace("fiber.slenderness = 1e-2", kinds).replace(
        'initial = {kind = "nearly_straight", angle = 2.0, amplitude = 0.1}', lattice
    )
    file.write_text(text.replace("fluid.mu_bar = [1e3, 1e4]", '"fiber[0].length" = [1.0, 1.2]'))
    result = invoke("sweep", file, "--workers", 1, "--quiet", "--set", "fluid.mu_bar=1e3")
    assert result.exit_code == 0, result.output
    said = invoke("sweep", "plot", "twofold").stderr.partition("In all cases: ")[2]
    for told in ("fiber[0] slenderness 0.01,", "fiber[1] length 1, slenderness 0.02,"):
        assert told in said
    assert "fiber[0] length" not in said


def test_the_run_of_a_case_is_found_by_its_values(file, invoke):
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    result = invoke("sweep", "find", "twofold", "mu_bar=9e3")
    assert open_run(result.stdout.strip()).attrs["status"]
    assert Path(result.stdout.strip()).name.startswith("mu_bar=10000-")
    assert "It has mu_bar = 10000." in result.stderr
    for values, said in (
        ((), "NAME=VALUE: expected a value of each parameter, got none of mu_bar"),
        (("mu=1",), "NAME=VALUE: expected a swept parameter: mu_bar"),
        (("mu_bar",), "NAME=VALUE: expected NAME=VALUE, got 'mu_bar'"),
    ):
        result = invoke("sweep", "find", "twofold", *values)
        assert (result.exit_code, said in result.stderr) == (2, True), result.stderr
    shutil.rmtree(next(Path("twofold/runs").glob("mu_bar=1000-*")))
    shutil.rmtree("twofold/sweep.zarr")
    result = invoke("sweep", "find", "twofold", "mu_bar=1e3")
    assert "a case that has begun, got mu_bar = 1000, which waits" in result.stderr


def test_the_range_of_what_was_collected_is_said(file, invoke):
    said = invoke("sweep", file, "--workers", 1).stdout
    data = xr.open_zarr("twofold/sweep.zarr").load()
    held = data["elastic_energy_final"].to_numpy()
    assert f"  elastic_energy_final  {held.min():.4g} to {held.max():.4g}\n" in said
    assert "wall_time" not in said


def test_that_all_results_can_be_trusted_is_said(file, invoke):
    assert "can be trusted" in invoke("sweep", file, "--workers", 1).stdout
    assert "2 done, all can be trusted" in invoke("sweep", "status", "twofold").stdout


def test_the_cost_of_all_cases_is_the_mean_of_both_ends_over_the_processes():
    short = Cost(100, 11, 21, 1e-3, 10.0, 1_000_000, settled=True)
    long = replace(short, seconds=50.0, store_bytes=3_000_000)
    rows = dict(_rows({"a": short, "b": long}, 8, 4))
    assert rows == {
        "a": "about 10 s, store 1 MB",
        "b": "about 50 s, store 3 MB",
        "all 8, if alike": "about 1 min 0 s of steps on 4 processes, 16 MB",
        "": "and a few tenths of a second for each, to begin and to store",
    }
    rows = dict(_rows({"a": short, "b": replace(long, settled=False)}, 8, 4))
    assert list(rows) == ["a", "b"]
    assert "cannot be told" in rows["b"]
    assert dict(_rows({"a": None}, 1, 1)) == {"a": "unknown: the first steps cannot be taken here"}


def test_doubtful_choices_are_said_once_with_their_cases(file, invoke):
    file.write_text(SWEEP + '[[cases]]\nname = "a"\n[[cases]]\nname = "b"\ninitial.angle = 170.0\n')
    said = invoke("sweep", file, "--dry-run").stderr
    told = said.partition("Doubtful choices")[2]
    assert told.count("initial.angle: more than a whole turn") == 1
    assert [line.strip()[:9] for line in told.splitlines()[2:]] == ["mu_bar=10", "mu_bar=10"]
    assert invoke("sweep", file, "--dry-run", "--quiet").stderr == ""


def test_dry_run_names_variants_and_single_values(file, invoke):
    variants = '[[cases]]\nname = "thin"\n[[cases]]\nname = "slow"\nflow.rate = 0.5\n'
    text = SWEEP.replace("[1e3, 1e4]", "[1e3]")
    file.write_text(text + variants)
    said = invoke("sweep", file, "--dry-run").stdout.splitlines()
    assert next(line for line in said if "mu_bar" in line).split() == [
        *("mu_bar", "1", "1000", "fluid.mu_bar")
    ]
    assert "thin to slow" in next(line for line in said if "flow.rate" in line)


def test_the_folder_of_an_earlier_version_is_collected(file, invoke):
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    described = json.loads(Path("twofold/sweep.json").read_text())
    described["collect"]["largest"] = ["orientation_tensor"]
    Path("twofold/sweep.json").write_text(json.dumps(described))
    result = invoke("sweep", "collect", "twofold")
    assert result.exit_code == 0, result.output
    assert xr.open_zarr("twofold/sweep.zarr")["orientation_tensor_largest"].sizes["mu_bar"] == 2


def test_means_that_have_not_settled_are_not_called_trusted(file, invoke):
    text = SWEEP.replace("positions_every = 0.25", "positions_every = 0.05")
    file.write_text(text + 'mean = ["largest_tension"]\n')
    result = invoke("sweep", file, "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "means over time have not settled" in result.stderr
    assert "can be trusted" not in result.stdout


def test_a_sweep_without_a_case_that_is_done_has_no_figure(tmp_path, monkeypatch, invoke):
    monkeypatch.chdir(tmp_path)
    Path("wind.py").write_text(BROKEN_FLOW)
    flow = 'flow = {kind = "python", file = "wind.py"}'
    Path("all.toml").write_text(SWEEP.replace('flow.kind = "shear"', flow))
    result = invoke("sweep", "all.toml", "--workers", 1, "--allow-python")
    assert result.exit_code == 3
    assert "error: 2 of 2 cases failed.\n" in result.stderr
    assert "Next" not in result.output
    assert "cannot be trusted" not in result.output
    result = invoke("sweep", "plot", "all")
    assert result.exit_code == 2
    assert "a case that is done, and numbers collected, got none of 2 done" in result.stderr


def test_a_dataset_of_an_earlier_sweep_is_not_drawn(file, invoke):
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    shutil.copytree("twofold/sweep.zarr", "before")
    file.write_text(SWEEP.replace("[1e3, 1e4]", "[1e3, 1e4, 2e4]"))
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    shutil.rmtree("twofold/sweep.zarr")
    Path("before").rename("twofold/sweep.zarr")  # as a kill leaves it
    assert held_dataset(Path("twofold")).sizes["mu_bar"] == 3
    assert invoke("sweep", "collect", "twofold").exit_code == 0
    assert held_dataset(Path("twofold")).sizes["mu_bar"] == 3


def test_means_of_each_fiber_are_those_of_its_values(tmp_path, monkeypatch, invoke):
    monkeypatch.chdir(tmp_path)
    lattice = 'initial = {kind = "lattice", cells = [2, 1, 1], box = [4, 4, 4]}'
    text = SWEEP.replace(
        'initial = {kind = "nearly_straight", angle = 2.0, amplitude = 0.1}', lattice
    )
    text = text.replace("fiber.slenderness = 1e-2", "fiber = {slenderness = 1e-2, count = 2}")
    text = text.replace("positions_every = 0.25", "positions_every = 0.1")
    Path("two.toml").write_text(text + 'mean = ["largest_tension", "shear_stress"]\n')
    result = invoke("sweep", "two.toml", "--workers", 1)
    assert result.exit_code == 0, result.output
    data = xr.open_zarr("two/sweep.zarr")
    assert data["largest_tension_mean"].dims == ("mu_bar", "fiber")
    assert data["largest_tension_mean_settled"].attrs["long_name"].startswith("whether the mean")
    run = xr.open_datatree(f"two/{data['run'].values[1]}", engine="zarr")
    tension = run["observables"]["largest_tension"]
    for k in range(2):
        mean = float(tension.isel(fiber=k).mean())
        assert float(data["largest_tension_mean"][1, k]) == pytest.approx(mean, rel=1e-12)
    count = int((data["largest_tension_mean_settled"] == 0).sum())
    count += int((data["shear_stress_mean_settled"] == 0).sum())
    told = f"{count} of 6 means over time have not settled: run longer."
    assert (told in result.stderr) is bool(count)
    assert "numbers: elastic_energy" in invoke("sweep", _with(text, "centre"), "--dry-run").stderr


def _with(text: str, name: str) -> Path:
    path = Path("other.toml")
    path.write_text(text + f'mean = ["{name}"]\n')
    return path


def test_what_an_axis_follows_from_is_said(file, invoke):
    file.write_text(SWEEP.replace("[grid]\n", "[grid]\nfiber.slenderness = [1e-2, 1e-3]\n"))
    assert invoke("sweep", file, "--workers", 1, "--quiet").exit_code == 0
    told = "eta is mu_bar / abs(c), c = log(eps^2 e).\n"
    result = invoke("sweep", "plot", "twofold", "--x", "eta")
    assert result.exit_code == 0
    assert told in result.stderr
    assert told not in invoke("sweep", "plot", "twofold").stderr
