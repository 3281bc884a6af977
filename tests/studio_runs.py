"""A small stored run that viewers and exports of the tests show: two fibers in a sheared cell."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import stokesfibers as sf
from stokesfibers.io import marker

PERIODS = (1.5, 1.25, 2.0)
SLENDERNESS = (0.02, 0.01)


def small_run(out: Path) -> Path:
    """Simulate two fibers of different thickness, which leave the cell, and return the store."""
    fibers = tuple(sf.Fiber(length=1.0, slenderness=eps, rigidity=1.0) for eps in SLENDERNESS)
    engine = sf.SpectralEngine(rtol=1e-2)
    cell = sf.Sheared(periods=PERIODS)
    problem = sf.Problem(fibers, mu_bar=5e4, flow=sf.Shear(rate=1.0), domain=cell, engine=engine)
    s = np.linspace(0.0, 1.0, 41)
    bent = np.stack([s, 1.1 + 0.08 * np.sin(np.pi * s), 0.0 * s + 0.3], axis=1)
    turned = np.stack([0.2 + 0.4 * s, 0.1 - 0.7 * s, 1.2 + 0.5 * s], axis=1)
    shapes = np.stack([along(line) for line in (bent, turned)])
    schedule = sf.every(0.1, observables=0.05, points=21)
    sf.simulate(problem, shapes, until=0.4, record=schedule, out=out)
    return out


def along(line: np.ndarray) -> np.ndarray:
    """Return a polyline scaled to length one."""
    return line / np.sum(np.linalg.norm(np.diff(line, axis=0), axis=1))


def set_status(run: Path, code: str) -> None:
    """Make a store look as if its run were at `code`."""
    docs, attributes = marker.read(run)
    _write(run, docs, {**attributes, "status": {**attributes["status"], "code": code}})


def forget_shapes(run: Path) -> None:
    """Make a store look as if its run had recorded no shape yet."""
    docs, attributes = marker.read(run)
    _write(run, marker.with_lengths(docs, {**marker.lengths(docs), "trajectory": 0}), attributes)


def _write(run: Path, docs: marker.Docs, attributes: Mapping[str, Any]) -> None:
    made = set(marker.RESERVED) - {"status", "checkpoint"}
    kept = {k: v for k, v in attributes.items() if k not in made}
    (run / marker.NAME).write_bytes(marker.encode(docs, kept))
