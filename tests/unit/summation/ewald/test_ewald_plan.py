"""Plans: what is refused, what is chosen, threads, repeated sums, and few points."""

from __future__ import annotations

import builtins
from itertools import product

import numpy as np
import pytest

from stokesfibers.core.errors import InputError, MissingExtraError
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.sheared import Sheared
from stokesfibers.summation.ewald import EwaldSum
from stokesfibers.summation.ewald.cloud import gather
from support import assert_close

pytest.importorskip("ducc0")
WORKERS = Workers(1)
CUBE = Periodic((1.0, 1.0, 1.0))


def _cloud(count):
    rng = np.random.default_rng(4)
    return rng.random((count, 3)), rng.standard_normal((count, 3))


@pytest.mark.parametrize("domain", [CUBE, Sheared((1.0, 1.0, 1.0), 0.2), Free()])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_threads_change_nothing(domain, tolerance):
    x, f = _cloud(3000)
    names = np.repeat(np.arange(300), 10)
    radius = np.linspace(0.0, 0.01, 3000)
    found = []
    for workers in (Workers(1), Workers(), Workers()):
        plan = EwaldSum(tolerance).plan(domain, x, filaments=names, radius=radius, workers=workers)
        found += [plan.execute(f), plan.execute(f)]
    for other in found[1:]:
        assert other.tobytes() == found[0].tobytes()


def test_a_plan_serves_many_forces_and_is_linear():
    x, f = _cloud(300)
    plan = EwaldSum(1e-8).plan(CUBE, x, workers=WORKERS)
    g = f[::-1].copy()
    one, other = plan.execute(f), plan.execute(g)
    assert_close(plan.execute(2.0 * f - 3e-5 * g), 2.0 * one - 3e-5 * other, rtol=1e-9)
    assert_close(plan.execute(1e-200 * f), 1e-200 * one, rtol=1e-13)
    assert not plan.execute(0.0 * f).any()


def test_no_points_no_targets():
    none = np.zeros((0, 3))
    x, f = _cloud(5)
    for domain in (CUBE, Free()):
        assert EwaldSum().plan(domain, none, workers=WORKERS).execute(none).shape == (0, 3)
        assert EwaldSum().plan(domain, x, none, workers=WORKERS).execute(f).shape == (0, 3)
        found = EwaldSum().plan(domain, none, x, workers=WORKERS).execute(none)
        assert found.shape == (5, 3)
        assert not found.any()


def test_one_and_two_points_in_free_space():
    f = np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    x = np.array([[5.0, 5.0, 5.0], [5.0, 5.0, 5.5]])
    assert np.abs(EwaldSum().plan(Free(), x[:1], workers=WORKERS).execute(f[:1])).max() < 1e-5
    found = EwaldSum(1e-9).plan(Free(), x, workers=WORKERS).execute(f)
    assert_close(found, [[0.0, 4.0, 0.0], [2.0, 0.0, 0.0]], rtol=1e-9)


def test_keys_are_equal_for_one_filament_in_the_same_image_only():
    """A filament spans five cells along y and two along z, another lies in one."""
    cell = Sheared((1.0, 1.0, 1.0), 0.3)
    along = np.linspace(0.1, 0.9, 7)[:, None] * [2.5, 5.5, 1.5]
    sources = np.concatenate([along, [[0.2, 0.3, 0.4], [0.3, 0.3, 0.4], [4.0, 3.3, 0.4]]])
    names = np.array([5] * 7 + [2, 2, -1])
    cloud = gather(cell, sources, None, filaments=names)
    taken = cloud.lattice.wrapped(sources)[1].T
    assert np.ptp(taken[:7, 1]) == 4
    assert np.ptp(taken[:7, 2]) == 1
    images = np.array(list(product(range(-3, 4), (-1, 0, 1), (-1, 0, 1))))
    for i, j in np.ndindex(10, 10):
        alike = cloud.keys[j] - images @ cloud.jumps == cloud.keys[i]
        own = i == j or (names[i] == names[j] and names[i] >= 0)
        expected = own & np.all(images == taken[j] - taken[i], axis=1)
        assert np.array_equal(alike, expected), (i, j)


def test_coincident_points_are_finite():
    x = np.array([[0.2, 0.3, 0.4], [0.2, 0.3, 0.4], [0.7, 0.3, 0.4]])
    found = EwaldSum(1e-6).plan(CUBE, x, workers=WORKERS).execute(np.ones((3, 3)))
    assert np.isfinite(found).all()


def test_the_choice_can_be_read_and_overridden():
    x, _ = _cloud(2000)
    plan = EwaldSum(1e-6).plan(CUBE, x, workers=WORKERS)
    split = plan.choice.split
    assert split.kind == "prolate"
    assert split.tolerance == 1e-6
    assert 0.0 < split.rc <= 0.5
    assert np.all(np.array(plan.choice.modes) > split.k_max / np.pi)
    assert plan.choice.precision == "single"
    assert plan.choice.pairs > 2000 * 2000 * 4.0 / 3.0 * np.pi * split.rc**3
    other = EwaldSum(1e-6, "gaussian", rc=0.2, bandwidth=40.0).plan(CUBE, x, workers=WORKERS)
    assert other.choice.split.kind == "gaussian"
    assert other.choice.split.rc == 0.2
    assert other.choice.split.k_max == pytest.approx(200.0)


def test_the_cutoff_shrinks_with_the_density():
    small, large = (
        EwaldSum(1e-4).plan(CUBE, _cloud(n)[0], workers=WORKERS).choice for n in (1000, 30000)
    )
    assert large.split.rc < 0.5 * small.split.rc
    # lists stay linear in the number of points
    assert large.pairs / 30000 < 6.0 * small.pairs / 1000


@pytest.mark.parametrize("tolerance", [1e-15, 1.0, -1e-3, float("nan"), "1e-3"])
def test_tolerance_out_of_reach(tolerance):
    with pytest.raises(InputError, match="tolerance"):
        EwaldSum(tolerance)


def test_tolerance_out_of_reach_says_what_is_reachable():
    with pytest.raises(InputError, match=r"1e-12 is the least that is reachable"):
        EwaldSum(1e-15)


def test_bad_settings_are_refused():
    with pytest.raises(InputError, match="split"):
        EwaldSum(split="other")
    with pytest.raises(InputError, match="rc"):
        EwaldSum(rc=-1.0)
    x, _ = _cloud(10)
    with pytest.raises(InputError, match=r"rc: .*half the least period"):
        EwaldSum(rc=0.6).plan(CUBE, x, workers=WORKERS)
    with pytest.raises(InputError, match="Fourier modes"):
        EwaldSum(rc=0.005).plan(CUBE, x, workers=WORKERS)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(bad):
    x, f = _cloud(10)
    wrong = x.copy()
    wrong[3, 1] = bad
    with pytest.raises(InputError, match=r"sources\[3\]"):
        EwaldSum().plan(CUBE, wrong, workers=WORKERS)
    with pytest.raises(InputError, match=r"targets\[3\]"):
        EwaldSum().plan(CUBE, x, wrong, workers=WORKERS)
    plan = EwaldSum().plan(CUBE, x, workers=WORKERS)
    with pytest.raises(InputError, match=r"forces\[3\]"):
        plan.execute(wrong)
    with pytest.raises(InputError, match="radius"):
        EwaldSum().plan(CUBE, x, radius=bad, workers=WORKERS)
    assert np.isfinite(plan.execute(f)).all()


def test_wrong_shapes_are_refused():
    x, f = _cloud(10)
    with pytest.raises(InputError, match="sources"):
        EwaldSum().plan(CUBE, x.ravel(), workers=WORKERS)
    with pytest.raises(InputError, match="filaments"):
        EwaldSum().plan(CUBE, x, filaments=np.zeros(9, int), workers=WORKERS)
    with pytest.raises(InputError, match="filaments"):
        EwaldSum().plan(CUBE, x, filaments=np.zeros(10), workers=WORKERS)
    with pytest.raises(InputError, match="radius"):
        EwaldSum().plan(CUBE, x, radius=np.zeros(9), workers=WORKERS)
    with pytest.raises(InputError, match="forces"):
        EwaldSum().plan(CUBE, x, workers=WORKERS).execute(f[:5])


def test_a_missing_library_says_how_to_get_it(monkeypatch):
    plain = builtins.__import__

    def without(name, *args, **kwargs):
        if name == "ducc0":
            raise ImportError(name)
        return plain(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtraError, match=r"pip install 'stokesfibers\[fast\]'"):
        EwaldSum().plan(CUBE, _cloud(5)[0], workers=WORKERS)
