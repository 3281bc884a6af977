"""When a run commits: not too often, since that costs, and not too rarely, since a kill loses."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.io.store import RunStore


@pytest.mark.parametrize(("seconds", "commits"), [(1e9, 2), (0.0, 10)])
def test_commits_keep_their_distance_and_records_do_not_depend_on_it(
    seconds, commits, monkeypatch, tmp_path
):
    monkeypatch.setattr("stokesfibers.run.recorder.LEAST_COMMIT_SECONDS", seconds)
    made, real = [], RunStore.commit
    monkeypatch.setattr(
        RunStore, "commit", lambda self, *args: (made.append(1), real(self, *args))[1]
    )
    fiber = sf.Fiber(slenderness=1e-2)
    engine = sf.SpectralEngine(dt=0.01, order=2, nodes=8)
    problem = sf.Problem(fiber, mu_bar=1e3, flow=sf.Shear(1.0), engine=engine)
    bent = sf.shapes.nearly_straight(fiber, angle=2.0, amplitude=1e-2)
    options = {"until": 1.0, "record": sf.every(0.1)}
    result = sf.simulate(problem, bent, out=tmp_path / "run.zarr", **options)
    assert result.status.code == "done"
    assert len(made) <= commits if seconds else len(made) >= commits
    kept = sf.open_run(tmp_path / "run.zarr")["trajectory"]["position"].to_numpy()
    expected = sf.simulate(problem, bent, **options).data["trajectory"]["position"].to_numpy()
    assert np.array_equal(kept, expected)


def test_steps_are_kept_where_no_record_comes_for_long(monkeypatch, tmp_path):
    """A kill between two records that are far apart loses no more than the last seconds."""
    fiber = sf.Fiber(slenderness=1e-2)
    engine = sf.SpectralEngine(dt=0.01, order=2, nodes=8)
    problem = sf.Problem(fiber, mu_bar=1e3, flow=sf.Shear(1.0), engine=engine)
    bent = sf.shapes.nearly_straight(fiber, angle=2.0, amplitude=1e-2)
    options = {"until": 0.5, "record": sf.every(0.5, observables=0.5)}
    expected = sf.simulate(problem, bent, **options).data
    monkeypatch.setattr("stokesfibers.run.recorder.MOST_COMMIT_SECONDS", 0.0)
    path, copy = tmp_path / "run.zarr", tmp_path / "copy.zarr"

    taken = []

    def killed(moment):
        taken.append(moment.time)
        if moment.time > 0.305:
            shutil.copytree(path, copy)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sf.simulate(problem, bent, out=path, watch=killed, **options)
    with RunStore.open(copy) as store:
        assert store.lengths["numerics"] == len(taken)
        assert store.status["time"] == taken[-1]
        checkpoint = store.checkpoint()
        assert checkpoint is not None
        assert checkpoint.meta["recorded"] == taken[-1]
    assert sf.resume(copy).status.code == "done"
    for group in ("trajectory", "observables", "numerics"):
        found = sf.open_run(copy)[group].to_dataset()
        for name, values in expected[group].to_dataset().data_vars.items():
            if name != "wall_time":
                assert np.array_equal(found[name], values, equal_nan=True), name


def test_commits_without_a_checkpoint_do_not_put_one_off(monkeypatch, tmp_path):
    """Records come often, checkpoints are asked for rarely: a kill still loses little."""
    clock = iter(range(10_000))
    monkeypatch.setattr("stokesfibers.run.recorder.monotonic", lambda: float(next(clock)))
    monkeypatch.setattr("stokesfibers.run.recorder.MOST_COMMIT_SECONDS", 9.5)
    fiber = sf.Fiber(slenderness=1e-2)
    engine = sf.SpectralEngine(dt=0.01, order=2, nodes=8)
    problem = sf.Problem(fiber, mu_bar=1e3, flow=sf.Shear(1.0), engine=engine)
    bent = sf.shapes.nearly_straight(fiber, angle=2.0, amplitude=1e-2)
    path, kept = tmp_path / "run.zarr", []

    def look(_):
        with RunStore.open(path) as store:
            checkpoint = store.checkpoint()
        assert checkpoint is not None
        kept.append(checkpoint.meta["recorded"])

    record = sf.every(0.01, observables=0.01, checkpoint=100.0)
    sf.simulate(problem, bent, out=path, watch=look, until=0.2, record=record)
    times = np.unique(kept)
    # the clock ticks a few times a step: a checkpoint each few steps, but not at each
    assert 4 <= len(times) < 0.6 * len(kept)
    assert times[-1] > 0.12
