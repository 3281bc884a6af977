"""A small made-up run: fibers that turn in a shear and bend into a C for a while."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

TIMES = np.linspace(0.0, 10.0, 41)
OBSERVED = np.linspace(0.0, 10.0, 101)
PEAK = 6.0


def _bend(times: np.ndarray, fibers: int) -> np.ndarray:
    """Return the turning of the tangent from end to end: (time, fiber)."""
    sizes = 3.0 - 0.5 * np.arange(fibers) / max(fibers - 1, 1)
    return sizes * np.exp(-(((times - PEAK) / 0.8) ** 2))[:, None]


def _position(fibers: int) -> np.ndarray:
    s = np.linspace(0.0, 1.0, 21)
    angle = np.pi - 0.3 * TIMES[:, None, None] + _bend(TIMES, fibers)[:, :, None] * (s - 0.5)
    tangent = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(angle)], axis=-1)
    steps = 0.5 * (tangent[:, :, 1:] + tangent[:, :, :-1]) * (s[1] - s[0])
    start = np.zeros((len(TIMES), fibers, 1, 3))
    position = np.concatenate([start, np.cumsum(steps, axis=2)], axis=2)
    position[..., 0] += 0.5 * np.arange(fibers)[:, None]
    return position


def make_run(fibers: int = 1, second: float = 0.0) -> xr.DataTree:
    """Return a run of `fibers` fibers with N_2 = `second` N_1, laid out as a run store."""
    position = _position(fibers)
    s = np.linspace(0.0, 1.0, 21)
    bend = _bend(OBSERVED, fibers)
    n1 = 100.0 * np.sin(OBSERVED)
    tension = np.cos(TIMES)[:, None, None] * (s * (1.0 - s)) * np.arange(1, fibers + 1)[:, None]
    end = np.arange(0.05, 10.001, 0.05)
    rejected = np.zeros(len(end), dtype=np.int64)
    rejected[[3, 70]] = 1
    status = {"code": "failed", "time": 10.0, "explanation": "Too long.", "hint": "Halve dt."}
    tree = xr.DataTree.from_dict(
        {
            "/trajectory": xr.Dataset(
                {
                    "position": (("time", "fiber", "node", "space"), position),
                    "tension": (("time", "fiber", "node"), tension),
                    "arclength": (("fiber", "node"), np.tile(s, (fibers, 1))),
                },
                coords={"time": TIMES, "space": ["x", "y", "z"]},
            ),
            "/observables": xr.Dataset(
                {
                    "elastic_energy": (("time", "fiber"), 0.5 * bend**2),
                    "first_normal_stress_difference": ("time", n1),
                    "second_normal_stress_difference": ("time", second * n1),
                    "shear_stress": ("time", 80.0 * np.cos(OBSERVED)),
                    "length_error": (("time", "fiber"), 1e-5 * bend),
                    "largest_curvature": (("time", "fiber"), bend),
                    "orientation_tensor": (("time", "i", "j"), np.tile(np.eye(3) / 3, (101, 1, 1))),
                    "centre": (("time", "fiber", "space"), np.zeros((101, fibers, 3))),
                },
                coords={"time": OBSERVED},
            ),
            "/numerics": xr.Dataset(
                {
                    "step_size": ("step", np.full(len(end), 0.05)),
                    "rejected": ("step", rejected),
                    "wall_time": (("step", "stage"), np.tile([0.25, 0.5], (len(end), 1))),
                },
                coords={"time": ("step", end), "stage": ["tension", "positions"]},
            ),
        }
    )
    tree.attrs["status"] = json.dumps(status)
    return tree


@pytest.fixture
def run() -> xr.DataTree:
    """One fiber."""
    return make_run()


@pytest.fixture
def pair() -> xr.DataTree:
    """Two fibers."""
    return make_run(fibers=2)


@pytest.fixture
def crowd() -> xr.DataTree:
    """Twelve fibers."""
    return make_run(fibers=12)


@pytest.fixture
def sheared_up() -> xr.DataTree:
    """One fiber whose second normal stress difference is a fifth of the first."""
    return make_run(second=0.2)
