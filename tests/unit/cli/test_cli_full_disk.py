"""A disk that fills up: before the run, while it runs, and again after it has space."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable

import numpy as np
import pytest

from stokesfibers.io import atomic
from stokesfibers.io.reader import open_run

FillUp = Callable[[int], None]


@pytest.fixture
def fill_up(monkeypatch) -> FillUp:
    """Return a function after which only so many more writes succeed."""
    real = atomic._write

    def after(writes: int) -> None:
        left = [writes]

        def write(fd: int, data: memoryview) -> None:
            if left[0] <= 0:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            left[0] -= 1
            real(fd, data)

        monkeypatch.setattr(atomic, "_write", write)

    return after


def test_run_that_cannot_be_made_leaves_nothing(case, invoke, fill_up):
    fill_up(5)
    result = invoke("run", case, "--out", case.with_name("run.zarr"))
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert "No space left on device" in line
    assert {p.name for p in case.parent.iterdir()} == {"case.toml"}


def test_old_run_survives_when_the_new_one_cannot_be_made(run, case, invoke, fill_up):
    before = open_run(run)["trajectory"]["position"].to_numpy()
    fill_up(5)
    assert invoke("run", case, "--out", run, "--overwrite").exit_code == 2
    assert np.array_equal(open_run(run)["trajectory"]["position"].to_numpy(), before)
    assert {p.name for p in case.parent.iterdir()} == {"case.toml", "run.zarr"}


@pytest.mark.parametrize("writes", [90, 140, 200])
def test_run_keeps_what_it_had_and_goes_on_when_there_is_space(
    writes, run, case, invoke, fill_up, monkeypatch
):
    out = case.with_name("full.zarr")
    with monkeypatch.context():
        fill_up(writes)
        result = invoke("run", case, "--out", out)
    monkeypatch.undo()
    assert result.exit_code == 3
    assert "Traceback" not in result.output
    message = " ".join(result.stderr.split())
    assert message.startswith("error: failed at t = ")
    assert "No space left on device" in message
    assert "Free some space, then resume the run" in message
    assert f"stokesfibers show {out}" in message
    kept = open_run(out)["trajectory"]["position"].to_numpy()
    whole = open_run(run)["trajectory"]["position"].to_numpy()
    assert len(kept) < len(whole)
    assert np.array_equal(kept, whole[: len(kept)])
    shown = invoke("show", out)
    assert shown.exit_code == 0
    assert invoke("resume", out, "--quiet").exit_code == 0
    assert np.array_equal(open_run(out)["trajectory"]["position"].to_numpy(), whole)
