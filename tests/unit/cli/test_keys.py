"""What ``stokesfibers keys`` lists is what a case, a sweep and a run may hold."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from stokesfibers.cli.main import main
from stokesfibers.config.keys import KEYS
from stokesfibers.config.reference import case_forms
from stokesfibers.observe.observables import WHERE
from stokesfibers.study.sweep_collect import Collect
from stokesfibers.study.sweep_plan import SWEEP_KEYS

_OBSERVED = [name for held in WHERE.values() for name in held if name != "time"]


def said(*names: str, columns: int = 110) -> str:
    result = CliRunner().invoke(main, ["keys", *names], env={"COLUMNS": str(columns)})
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.parametrize("path", [path for path in KEYS if "." in path])
def test_each_key_of_the_registry_is_told_of_its_table(path):
    table, _, key = path.partition(".")
    tables = {form.path for form in case_forms()[table]}
    assert path.rpartition(".")[0] in tables or f"{path}.kind" in KEYS
    if not key.startswith("orientation"):
        assert key.rpartition(".")[2] in said(table)


def test_each_key_says_what_it_is():
    bare = [
        (form.path, form.kind, key.name)
        for forms in case_forms().values()
        for form in forms
        for key in form.keys
        if not key.meaning
    ]
    assert bare == []


def test_kinds_stand_with_their_keys_defaults_and_units():
    told = said("flow")
    assert '[flow] kind = "planar_extension"\n  Planar extension, U = (rate x, -rate y, 0).' in told
    block = told.partition('kind = "oscillatory_shear"')[2].partition("[flow]")[0]
    assert "amplitude = 1.0" in block
    assert "[1/time]" in block
    assert "To be given." in block.partition("frequency  ")[2]
    assert "d_y / 256" in said("initial")
    assert 'kind = "von_mises_fisher"' in said("initial")


@pytest.mark.parametrize("text", ["None", "``", "`"])
def test_it_speaks_of_files_not_of_python(text):
    assert text not in said(*case_forms(), "engine", "sweep", "observables")


def test_defaults_that_depend_on_the_engine_are_told_not_shown():
    told = " ".join(said("domain").split())
    assert 'sum = "images"' not in told
    assert "by default ewald" in told
    assert "summed one by one" in told.partition('kind = "periodic"')[0]
    assert 'engine = "spectral"' in said("engine")


def test_without_a_name_everything_is_named():
    told = said()
    for name in (*case_forms(), *SWEEP_KEYS, *_OBSERVED):
        assert name in told
    assert "mobility, regularization, close_approach" in told


def test_observables_stand_where_they_are_recorded():
    told = said("observables")
    lines = {line.split()[0]: line for line in told.splitlines() if line.startswith("  ")}
    assert sorted(lines) == sorted(_OBSERVED)
    assert "of each fiber [force length]" in lines["elastic_energy"]
    assert "components" in lines["end_to_end"]
    assert "components" not in lines["end_to_end_distance"]
    below = told.partition("In steady shear with three periodic directions")[2]
    assert below.split()[0] == "specific_viscosity"


def test_a_sweep_has_its_tables_and_all_that_it_collects():
    told = said("sweep")
    for name in (*SWEEP_KEYS, *Collect().to_table()):
        assert name in told


@pytest.mark.parametrize(
    ("name", "hint"),
    [("initail", "Did you mean 'initial'?"), ("observable", "Did you mean 'observables'?")],
)
def test_an_unknown_name_is_refused(name, hint):
    result = CliRunner().invoke(main, ["keys", name])
    assert result.exit_code == 2
    assert hint in result.output


def test_a_table_may_be_written_as_in_the_file():
    assert said("[flow]") == said("flow") == said("flow.rate")


def test_one_kind_may_be_asked_for():
    told = said("flow.oscillatory_shear")
    assert told.count("kind = ") == 1
    assert "frequency" in told
    assert told in said("flow")


@pytest.mark.parametrize("columns", [60, 80])
def test_lines_fit_the_terminal(columns):
    told = said(*case_forms(), columns=columns).splitlines()
    assert max(len(line) for line in told if not line.startswith("[")) <= columns


def test_what_a_table_left_out_means_is_told():
    left_out = ", if the table is left out"
    told = [line for line in said(*case_forms()).splitlines() if left_out in line]
    kinds = {line.partition(left_out)[0] for line in told}
    assert kinds == {
        '[flow] kind = "none"',
        '[domain] kind = "free"',
        '[load] kind = "none"',
        '[initial] kind = "nearly_straight"',
    }
    assert "[fiber], or [[fiber]] for several\n" in said("fiber")


def test_keys_of_one_engine_or_one_kind_of_sum_say_so():
    told = " ".join(said("stepping", "model", "domain", "constraint").split())
    assert "1 / (2 beta) if that is smaller" in told
    assert "(paper) Fixed time step instead. (spectral)" in told
    assert "Default 20 with images, 2 with truncated." in told
    assert "Default 100 with fixed_point, 200 with krylov." in told
    assert "With sum = images or truncated." in told
    assert "reach = " not in told


def test_tables_in_tables_can_be_asked_for():
    told = said("initial.orientation")
    assert told.count("[initial.orientation] kind = ") == 4
    assert told.count("kind = ") == 4
    assert said("collect") == said("[[zip]]") == said("sweep")
    assert said("fiber[1].length") == said("fiber")
    result = CliRunner().invoke(main, ["keys", "flow.nonsense"])
    assert result.exit_code == 2
    assert "one of flow.shear, flow.oscillatory_shear" in result.output
