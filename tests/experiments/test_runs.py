"""Shared runs: computed once, used again, continued, replaced when they are of another case."""

from __future__ import annotations

import json
import os
import signal
from dataclasses import replace

import numpy as np
import pytest

from stokesfibers.core.errors import StokesFibersError
from stokesfibers.experiments import runs
from stokesfibers.experiments.base import Settings
from stokesfibers.experiments.sheared_cells import CellRun, uniform
from stokesfibers.experiments.tiers import QUICK, BucklingRun
from stokesfibers.io.store import RunStore

SHORT = replace(QUICK, name="short", until=1.536)
RUN = BucklingRun(SHORT, 2e5, 20)


def _count_steps(monkeypatch) -> list[float]:
    taken: list[float] = []
    step = runs.PaperStepper.step

    def counted(self, carry):
        taken.append(carry.step)
        return step(self, carry)

    monkeypatch.setattr("stokesfibers.stepping.paper.PaperStepper.step", counted)
    return taken


def test_finished_run_is_used_again(monkeypatch, tmp_path):
    first = runs.finished([RUN], Settings(tmp_path))[0]
    position = first["trajectory"]["position"].to_numpy()
    taken = _count_steps(monkeypatch)
    again = runs.finished([RUN, RUN], Settings(tmp_path))
    assert taken == []
    np.testing.assert_array_equal(again[1]["trajectory"]["position"], position)


def test_stopped_run_is_continued_to_the_same_result(monkeypatch, tmp_path):
    whole = runs.finished([RUN], Settings(tmp_path / "whole"))[0]
    folder = tmp_path / "stopped" / "runs"
    folder.mkdir(parents=True)

    def stop(moment) -> None:
        if moment.time > 1.0:
            raise RuntimeError("the power went")

    with pytest.raises(RuntimeError):
        runs._compute(RUN, folder, stop)
    taken = _count_steps(monkeypatch)
    resumed = runs.finished([RUN], Settings(tmp_path / "stopped"))[0]
    assert 0 < len(taken) <= 30
    for name in ("position", "tension"):
        np.testing.assert_array_equal(resumed["trajectory"][name], whole["trajectory"][name])


def test_run_of_another_case_under_the_same_name_is_replaced(tmp_path):
    other = replace(SHORT, amplitude=-5e-3)
    runs.finished([BucklingRun(other, 2e5, 20)], Settings(tmp_path))
    found = runs.finished([RUN], Settings(tmp_path))[0]
    fresh = runs.finished([RUN], Settings(tmp_path / "fresh"))[0]
    np.testing.assert_array_equal(found["trajectory"]["position"], fresh["trajectory"]["position"])


def test_a_store_from_before_a_key_existed_is_used(monkeypatch, tmp_path):
    """Its case lacks what has a default now."""
    runs.finished([RUN], Settings(tmp_path))
    tables = runs._tables

    def longer(run):
        found = tables(run)
        assert found["initial"].pop("centre") == [0.0, 0.0, 0.0]
        return found

    store = tmp_path / "runs" / f"{RUN.name}.zarr"
    monkeypatch.setattr(runs, "_tables", longer)
    runs._compute(RUN, tmp_path / "runs")
    monkeypatch.setattr(runs, "_tables", tables)
    with RunStore.open(store) as held:
        assert "centre" not in json.loads(held.attributes["case"])["initial"]
    taken = _count_steps(monkeypatch)
    runs.finished([RUN], Settings(tmp_path))
    assert taken == []


def test_failed_run_is_kept_but_not_finished(monkeypatch, tmp_path):
    unstable = replace(RUN, beta=60.0)
    tree = runs.attempted([unstable], Settings(tmp_path))[0]
    assert runs.status(tree)["code"] == "failed"
    taken = _count_steps(monkeypatch)
    with pytest.raises(StokesFibersError, match="blew up"):
        runs.finished([unstable], Settings(tmp_path))
    assert taken == []


def test_two_processes_give_the_same_runs_as_one(tmp_path):
    pair = [RUN, replace(RUN, mirrored=True)]
    told: list[float] = []
    settings = Settings(tmp_path / "two", workers=2, progress=lambda _, share: told.append(share))
    two = runs.finished(pair, settings)
    one = runs.finished(pair, Settings(tmp_path / "one"))
    for a, b in zip(two, one, strict=True):
        np.testing.assert_array_equal(a["trajectory"]["position"], b["trajectory"]["position"])
    assert told[-1] == pytest.approx(1.0)


def test_progress_grows_to_the_end(tmp_path):
    told: list[float] = []
    pair = [RUN, replace(RUN, mirrored=True)]
    runs.finished(pair, Settings(tmp_path, progress=lambda _, share: told.append(share)))
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)
    assert len(told) > 10


def test_times_that_were_not_recorded_are_refused(tmp_path):
    tree = runs.finished([RUN], Settings(tmp_path))[0]
    assert runs.frames(tree, np.array([0.512, 1.536])).sizes["time"] == 2
    with pytest.raises(StokesFibersError, match="not recorded"):
        runs.frames(tree, np.array([0.55]))


def test_mirrored_run_starts_from_minus_x(tmp_path):
    pair = runs.finished([RUN, replace(RUN, mirrored=True)], Settings(tmp_path))
    one, other = (tree["trajectory"]["position"].to_numpy()[0, 0] for tree in pair)
    np.testing.assert_allclose(other, -one, atol=1e-15)
    assert np.abs(one).max() > 0.49


def test_a_run_of_the_high_order_engine_is_used_again_with_its_own_points(tmp_path):
    run = CellRun("again", uniform(2), 1e3, 0.1, 1, 0.02)
    assert run.schedule.points is None
    first = runs.finished([run], Settings(tmp_path))[0]
    assert runs._is_same(run, tmp_path / "runs")
    again = runs.finished([run], Settings(tmp_path))[0]
    assert first["numerics"].identical(again["numerics"]), "wall times too: nothing was run"


def test_whoever_stops_one_run_stops_them_all(monkeypatch, tmp_path):
    plan = [BucklingRun(SHORT, mu_bar, 20) for mu_bar in (1e5, 2e5)]

    def stop(_: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(runs, "_watch", lambda *_: stop)
    with pytest.raises(KeyboardInterrupt):
        runs.finished(plan, Settings(tmp_path))
    assert len(list((tmp_path / "runs").glob("*.zarr"))) == 1
