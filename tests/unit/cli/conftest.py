"""A small case that no check doubts, and the commands as a user types them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from stokesfibers.cli.main import main

CASE = """\
engine = "paper"
[fiber]
slenderness = 1e-2

[fluid]
mu_bar = 1e4

[flow]
kind = "shear"

[initial]
kind = "nearly_straight"
angle = 2.0
amplitude = 0.1

[discretization]
intervals = 20

[stepping]
dt = 0.0128
until = 0.256

[record]
positions_every = 0.064
observables_every = 0.0256
"""

Invoke = Callable[..., Result]


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """A case of twenty steps."""
    file = tmp_path / "case.toml"
    file.write_text(CASE)
    return file


@pytest.fixture
def invoke() -> Invoke:
    """Run a command in this process."""
    return lambda *words: CliRunner().invoke(main, [str(word) for word in words])


@pytest.fixture
def run(case: Path, invoke: Invoke) -> Path:
    """The stored run of the case."""
    out = case.with_name("run.zarr")
    result = invoke("run", case, "--out", out, "--quiet")
    assert result.exit_code == 0, result.stderr
    return out


def status_of(out: Path) -> dict[str, object]:
    """Return the stored status of a run."""
    return json.loads((out / "zarr.json").read_text())["attributes"]["status"]
