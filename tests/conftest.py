"""Set-up of all tests: one BLAS thread, and property tests that repeat exactly."""

from __future__ import annotations

import pytest
from hypothesis import settings
from threadpoolctl import threadpool_limits

from support import assert_close as _assert_close

settings.register_profile("repeatable", derandomize=True, deadline=None, print_blob=False)
settings.load_profile("repeatable")


@pytest.fixture(scope="session", autouse=True)
def _one_blas_thread():
    """Run as the package runs: small dense systems, bitwise the same every time."""
    with threadpool_limits(1, user_api="blas"):
        yield


@pytest.fixture(autouse=True)
def _commits_at_all_records(monkeypatch):
    """Commit at each record of positions, as a run slower than two a second does."""
    monkeypatch.setattr("stokesfibers.run.recorder.LEAST_COMMIT_SECONDS", 0.0)


@pytest.fixture(autouse=True)
def _nothing_takes_long(monkeypatch):
    """Let no word of patience come between, however slow the machine."""
    monkeypatch.setattr("stokesfibers.cli.bars.PATIENCE_SECONDS", 3600.0)


@pytest.fixture
def assert_close():
    """Return the comparison that refuses to be vacuous."""
    return _assert_close
