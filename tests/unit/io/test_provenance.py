"""Provenance: nothing is missing, and it survives JSON."""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime

import numpy as np

from stokesfibers.core.version import __version__
from stokesfibers.io.provenance import provenance


def test_provenance_is_complete() -> None:
    found = provenance()
    assert json.loads(json.dumps(found)) == found
    versions = found["versions"]
    assert versions.keys() == {
        "stokesfibers",
        "python",
        "numpy",
        "scipy",
        "numba",
        "zarr",
        "xarray",
    }
    assert all(text[0].isdigit() for text in versions.values())
    assert versions["stokesfibers"] == __version__
    assert versions["numpy"] == np.__version__
    assert versions["python"] == sys.version.split()[0]
    assert found.keys() == {"versions", "platform", "cpu_count", "time", "command"}
    assert found["platform"]
    assert found["cpu_count"] >= 1
    assert sys.argv[0] in found["command"]
    age = datetime.now(UTC) - datetime.fromisoformat(found["time"])
    assert -1 <= age.total_seconds() < 60
