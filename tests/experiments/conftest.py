"""One folder of results per tier: runs that several figures share are computed once."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from stokesfibers.experiments.base import Settings
from stokesfibers.experiments.registry import EXPERIMENTS


@dataclass(frozen=True)
class Reproduced:
    """What one reproduction left: the summary it returned, and the files it wrote.

    Attributes
    ----------
    summary
        The dictionary returned.
    folder
        Where the files are.
    """

    summary: dict[str, Any]
    folder: Path

    def ours(self, start: str) -> float:
        """Return our value of the only row whose quantity starts with `start`."""
        return self._row(start)["ours"]

    def verdict(self, start: str) -> str:
        """Return the verdict of the only row whose quantity starts with `start`."""
        return self._row(start)["verdict"]

    def _row(self, start: str) -> dict[str, Any]:
        found = [row for row in self.summary["rows"] if row["quantity"].startswith(start)]
        assert len(found) == 1, f"{len(found)} rows start with {start!r}"
        return found[0]

    def data(self) -> xr.Dataset:
        """Return the data written."""
        path = self.folder / f"{self.summary['name']}.nc"
        with xr.open_dataset(path, engine="scipy") as data:
            return data.load()


def _reproduce(name: str, folder: Path, *, quick: bool) -> Reproduced:
    summary = EXPERIMENTS[name].reproduce(folder, quick=quick)
    for file in summary["files"]:
        assert (folder / file).stat().st_size > 0, file
    assert json.loads((folder / f"{name}.json").read_text()) == summary
    wrong = [row for row in summary["rows"] if row["verdict"] == "differs"]
    assert not wrong, wrong
    assert any(row["verdict"] == "agrees" for row in summary["rows"])
    return Reproduced(summary, folder)


@pytest.fixture(scope="session")
def quick_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the quick tier."""
    return tmp_path_factory.mktemp("quick")


@pytest.fixture(scope="session")
def quick(quick_folder: Path) -> Callable[[str], Reproduced]:
    """Return a function that reproduces an experiment in its quick tier."""
    return lambda name: _reproduce(name, quick_folder, quick=True)


@pytest.fixture(scope="session")
def quick_settings(quick_folder: Path) -> Settings:
    """Return the settings of the quick tier, with its shared runs."""
    return Settings(quick_folder, quick=True)


@pytest.fixture(scope="session")
def full(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Reproduced]:
    """Return a function that reproduces an experiment with the paper's parameters."""
    folder = tmp_path_factory.mktemp("full")
    return lambda name: _reproduce(name, folder, quick=False)
