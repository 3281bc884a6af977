"""One small run for all tests of the studio; a test that changes it takes a copy."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from studio_runs import small_run


@pytest.fixture(scope="session")
def cell_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two fibers in a sheared cell, five shapes; not to be changed."""
    return small_run(tmp_path_factory.mktemp("studio") / "cell.zarr")


@pytest.fixture
def cell_copy(cell_run: Path, tmp_path: Path) -> Path:
    """The same run, to be changed."""
    return Path(shutil.copytree(cell_run, tmp_path / "copy.zarr"))
