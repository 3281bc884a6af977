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


def said(*names: str) -> str:
    result = CliRunner().invoke(main, ["keys", *names])
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
