"""Where a run came from: versions, machine, time and command."""

from __future__ import annotations

import os
import platform
import shlex
import sys
from datetime import UTC, datetime
from importlib import metadata
from typing import Any

from stokesfibers.core.version import __version__

_PACKAGES = ("numpy", "scipy", "numba", "zarr", "xarray")


def provenance() -> dict[str, Any]:
    """Return what is needed to know where a run came from, as JSON-ready values.

    Returns
    -------
    dict
        ``versions`` (package name to version, with ``stokesfibers`` and ``python``),
        ``platform``, ``cpu_count``, ``time`` (now, UTC, ISO 8601) and ``command``.
    """
    versions = {"stokesfibers": __version__, "python": platform.python_version()}
    versions.update({name: metadata.version(name) for name in _PACKAGES})
    return {
        "versions": versions,
        "platform": platform.platform(),
        "cpu_count": os.cpu_count() or 1,
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": shlex.join(sys.argv),
    }
