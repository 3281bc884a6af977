"""Bad input and faults of suspensions by the Ewald sum: one clear line, or a run that keeps all."""

from __future__ import annotations

import builtins
import tracemalloc
from time import perf_counter

import numpy as np
import pytest
from click.testing import CliRunner

import stokesfibers as sf
from reference.ewald_slow import free_sum, relative
from stokesfibers.cli.main import main
from stokesfibers.config.case import load_case
from stokesfibers.core.errors import MissingExtraError
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.sheared import Sheared
from stokesfibers.fiber.suspension import Suspension
from stokesfibers.load import Gravity
from stokesfibers.load.user import UserLoad
from stokesfibers.summation import FastImages
from stokesfibers.summation.ewald import EwaldSum

pytest.importorskip("ducc0")
CELL = (2.5, 2.5, 2.5)
ENGINE = sf.SpectralEngine(nodes=8, rtol=1e-3)

CASE = """
engine = "spectral"
[fiber]
count = 3
slenderness = 1e-2
[fluid]
mu_bar = 2e3
[flow]
{flow}
[domain]
{domain}
[initial]
kind = "suspension"
box = [2.5, 2.5, 2.5]
seed = 1
least_gap = 0.05
[stepping]
rtol = 1e-3
until = 0.5
"""


def _load(tmp_path, *, domain, flow='kind = "shear"\nrate = 1.0'):
    path = tmp_path / "case.toml"
    path.write_text(CASE.format(flow=flow, domain=domain))
    return load_case(path)


BAD_DOMAINS = {
    "tolerance out of reach": (
        'kind = "sheared"\nperiods = [2.5, 2.5, 2.5]\nsum = "ewald"\ntolerance = 1e-16',
        ("domain.tolerance", "from 1e-12 to 1e-2"),
    ),
    "tolerance of one": (
        'kind = "periodic"\nperiods = [2.5, 2.5, 2.5]\nsum = "ewald"\ntolerance = 1.0',
        ("domain.tolerance", "from 1e-12 to 1e-2"),
    ),
    "tolerance not a number": (
        'kind = "periodic"\nperiods = [2.5, 2.5, 2.5]\nsum = "ewald"\ntolerance = nan',
        ("tolerance",),
    ),
    "cell smaller than a filament": (
        'kind = "sheared"\nperiods = [2.5, 0.9, 2.5]',
        ("domain.periods", "at least the longest fiber, 1"),
    ),
    "one period smaller than a filament": (
        'kind = "periodic"\nperiods = [0.5, 0.0, 0.0]\nsum = "ewald"',
        ("domain.periods", "at least the longest fiber, 1"),
    ),
    "no period": (
        'kind = "periodic"\nperiods = [0.0, 0.0, 0.0]\nsum = "ewald"',
        ("periods", "at least one above 0"),
    ),
    "negative period": (
        'kind = "periodic"\nperiods = [2.5, -2.5, 2.5]\nsum = "ewald"',
        ("periods",),
    ),
    "sheared with a free direction": (
        'kind = "sheared"\nperiods = [2.5, 2.5, 0.0]',
        ("periods", "three lengths above 0"),
    ),
    "infinite period": (
        'kind = "periodic"\nperiods = [2.5, inf, 2.5]',
        ("periods",),
    ),
    "two periods": (
        'kind = "periodic"\nperiods = [2.5, 2.5]',
        ("periods",),
    ),
    "another sum in a sheared cell": (
        'kind = "sheared"\nperiods = [2.5, 2.5, 2.5]\nsum = "exact"',
        ("domain.sum", "'ewald' in a sheared cell"),
    ),
}


@pytest.mark.parametrize("name", BAD_DOMAINS)
def test_bad_domains_are_refused_in_one_line(name, tmp_path):
    domain, parts = BAD_DOMAINS[name]
    with pytest.raises(sf.InputError) as fault:
        _load(tmp_path, domain=domain)
    assert "\n" not in str(fault.value)
    for part in parts:
        assert part in str(fault.value)


@pytest.mark.parametrize(
    "flow",
    ['kind = "none"', 'kind = "extension"\nrate = 1.0', 'kind = "uniform"\nvelocity = [1, 0, 0]'],
)
def test_sheared_cell_without_a_shear_is_refused(flow, tmp_path):
    with pytest.raises(sf.InputError, match="shear") as fault:
        _load(tmp_path, domain='kind = "sheared"\nperiods = [2.5, 2.5, 2.5]', flow=flow)
    assert "\n" not in str(fault.value)
    assert "flow" in str(fault.value)


def test_a_period_of_a_fibers_length_is_not_refused(tmp_path):
    case = _load(tmp_path, domain='kind = "periodic"\nperiods = [1.0, 2.5, 2.5]')
    assert case.problem.domain.lengths[0] == 1.0


def _problem(count=3, **changes):
    arguments = {
        "mu_bar": 2e3,
        "flow": sf.Shear(1.0),
        "engine": ENGINE,
        "domain": Sheared(CELL),
    }
    return sf.Problem(sf.Fiber(slenderness=1e-2, count=count), **(arguments | changes))


def _start(problem, until=0.6, **options):
    box = Suspension(seed=3, box=CELL, least_gap=0.05)
    curves = box.curves(problem.fibers, problem.domain.lengths)
    return sf.simulate(problem, curves, until=until, record=sf.every(0.1), threads=1, **options)


def _is_kept(result, out, since, last):
    """Assert that a run failed between two times and that its store is finite up to there."""
    assert result.status.code == "failed"
    assert since < result.status.time <= last
    kept = sf.open_run(out)
    assert kept.attrs["status"]["code"] == "failed"
    assert kept["trajectory"].sizes["time"] >= int(since / 0.1)
    for values in kept["trajectory"].to_dataset().data_vars.values():
        assert np.isfinite(values.to_numpy()).all()
    return result.status.explanation


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_users_flow_that_is_not_finite_on_the_way(bad, tmp_path):
    def velocity(points, t):
        return (
            np.full(points.shape, bad)
            if t > 0.35
            else np.stack([points[:, 1], 0.0 * points[:, 0], 0.0 * points[:, 0]], axis=1)
        )

    problem = _problem(flow=sf.UserFlow(velocity), domain=Periodic(CELL))
    out = tmp_path / "run.zarr"
    said = _is_kept(_start(problem, out=out), out, 0.1, 0.35)
    assert "background flow" in said
    assert "finite" in said
    assert "velocity" in said
    assert "t = 0." in said


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_users_load_that_is_not_finite_on_the_way(bad, tmp_path):
    def density(points, t):
        return np.full(points.shape, bad if t > 0.35 else 1.0)

    out = tmp_path / "run.zarr"
    said = _is_kept(_start(_problem(load=UserLoad(density)), out=out), out, 0.1, 0.35)
    assert "The load cannot be used" in said
    assert "finite" in said
    assert "density" in said
    assert "t = 0." in said


def test_a_missing_library_is_named_before_anything_is_written(tmp_path, monkeypatch):
    plain = builtins.__import__

    def without(name, *args, **kwargs):
        if name == "ducc0":
            raise ImportError(name)
        return plain(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    out = tmp_path / "run.zarr"
    with pytest.raises(MissingExtraError, match=r"pip install 'stokesfibers\[fast\]'"):
        _start(_problem(), out=out)
    assert not out.exists()


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (2.5, 0.0, 0.0), (0.0, -2.5, 5.0)])
def test_coincident_fibers_are_refused_also_when_images_coincide(shift):
    problem = _problem(count=2)
    kind, along = problem.kinds[0], np.array([0.6, 0.0, 0.8])
    middles = np.array([1.0, 1.0, 1.0]), np.array([1.0, 1.0, 1.0]) + shift
    pair = tuple(sf.shapes.segment(kind, centre=m, direction=along) for m in middles)
    with pytest.raises(sf.InputError, match=r"fibers 0 and 1 at a centreline distance") as fault:
        sf.simulate(problem, pair, until=0.2, record=sf.every(0.1), threads=1)
    assert "\n" not in str(fault.value)


def test_coincident_points_of_two_filaments_are_finite_for_the_sum():
    x = np.tile(np.random.default_rng(1).random((6, 3)), (2, 1))
    names = np.repeat([0, 1], 6)
    for domain in (Free(), Periodic(CELL), Sheared(CELL, 0.3)):
        plan = EwaldSum(1e-6).plan(domain, x, filaments=names, workers=Workers(1))
        assert np.isfinite(plan.execute(np.ones(x.shape))).all()


@pytest.mark.parametrize("far", [1e4, 1e6])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_a_point_far_from_a_crowd_costs_a_plain_sum_at_most(far, tolerance):
    """All is near: no grid reaches from the crowd to the one far away at its resolution."""
    random = np.random.default_rng(2)
    count = 3000
    x = np.concatenate([random.random((count - 1, 3)), [[far, 0.3 * far, 0.1]]])
    f = random.standard_normal(x.shape)
    tracemalloc.start()
    began = perf_counter()
    plan = EwaldSum(tolerance).plan(Free(), x, workers=Workers(1))
    found = plan.execute(f)
    seconds, most = perf_counter() - began, tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert plan.choice is not None
    assert plan.choice.pairs <= count**2
    assert np.prod(plan.choice.modes) < 1e6
    assert most < 100e6
    assert seconds < 60.0
    some = [0, 1500, count - 1]
    assert relative(found[some], free_sum(x[some], x, f, left_out=_same(some))) < tolerance


def _same(some):
    return lambda i, j: some[i] == j


def test_a_fiber_far_from_a_crowd_runs():
    problem = _problem(count=4, domain=Free(), image_sum=FastImages(), flow=sf.NoFlow(),
                       load=Gravity((0.0, -50.0, 0.0)))  # fmt: skip
    kind = problem.kinds[0]
    middles = [(0.0, 0.0, 0.0), (0.0, 0.2, 0.0), (0.1, 0.0, 0.4), (1e6, 2e5, 0.0)]
    crowd = tuple(sf.shapes.segment(kind, centre=m, direction=np.eye(3)[0]) for m in middles)
    until = 1e-2
    result = sf.simulate(problem, crowd, until=until, record=sf.every(until), threads=1)
    assert result.status.code == "done"
    fallen = -np.diff(result.data["observables"]["centre"].to_numpy()[..., 1], axis=0)[0]
    assert fallen[3] > 0.0
    assert fallen[:3].min() > 1.1 * fallen[3], "three together fall faster than one alone"


def test_the_command_says_it_in_one_line(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(
        CASE.format(flow='kind = "none"', domain='kind = "sheared"\nperiods = [2.5, 2.5, 2.5]')
    )
    found = CliRunner().invoke(main, ["run", str(path), "--out", str(tmp_path / "run.zarr")])
    assert found.exit_code == 2
    assert "shear" in found.output
    assert "Traceback" not in found.output
    assert not (tmp_path / "run.zarr").exists()
