"""Flows loaded from a user's Python file: what is found, recorded and refused."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from stokesfibers.core.errors import InputError
from stokesfibers.flow import load_user_flow, to_dict

GOOD_FILE = """\
from dataclasses import dataclass
import numpy as np

@dataclass
class Settings:
    rate: "float" = 2.0

def velocity(points, t):
    u = np.zeros_like(points)
    u[:, 0] = Settings().rate * t * points[:, 1]
    return u
"""
GRADIENT = """
def gradient(points, t):
    g = np.zeros((len(points), 3, 3))
    g[:, 0, 1] = 2.0 * t
    return g
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "my_flow.py"
    path.write_text(text)
    return path


def test_velocity_alone_takes_differences(tmp_path: Path) -> None:
    flow = load_user_flow(write(tmp_path, GOOD_FILE))
    x = np.array([[1.0, 3.0, 2.0]])
    assert_array_equal(flow.velocity(x, 0.5), [[3.0, 0.0, 0.0]])
    assert flow.gradient_function is None
    expected = np.zeros((1, 3, 3))
    expected[0, 0, 1] = 1.0
    assert_allclose(flow.gradient(x, 0.5), expected, rtol=0.0, atol=1e-9)
    assert flow.name == "my_flow"


def test_gradient_is_found(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD_FILE + GRADIENT)
    flow = load_user_flow(str(path), length_scale=2.0)
    assert flow.length_scale == 2.0
    assert flow.gradient_function is not None
    assert flow.gradient(np.zeros(3), 0.75)[0, 1] == 1.5


def test_other_names(tmp_path: Path) -> None:
    text = "def inflow(points, t): return points\ndef d(points, t): return t\n"
    flow = load_user_flow(write(tmp_path, text), "inflow", "d")
    assert_array_equal(flow.velocity(np.ones(3), 0.0), np.ones(3))
    with pytest.raises(InputError, match=r"my_flow.*\.d'"):
        flow.gradient(np.ones(3), 0.0)


def test_the_record_is_of_the_bytes_that_ran(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD_FILE)
    flow = load_user_flow(path)
    path.write_text("changed later")
    record = to_dict(flow)
    assert record["sources"] == [
        {
            "path": str(path.resolve()),
            "sha256": hashlib.sha256(GOOD_FILE.encode()).hexdigest(),
        }
    ]
    assert record["velocity_function"].startswith("my_flow_")
    assert record["velocity_function"].endswith(".velocity")


def test_an_edited_file_is_read_anew(tmp_path: Path) -> None:
    for factor in (2, 3):
        text = f"def velocity(points, t): return {factor} * points\n"
        flow = load_user_flow(write(tmp_path, text))
        assert_array_equal(flow.velocity(np.ones(3), 0.0), factor)
    assert not (tmp_path / "__pycache__").exists()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("def velocity(points, t) return points", "SyntaxError.*line 1"),
        ("\nimport no_such_module_here\n", r"ModuleNotFoundError.*\(line 2\)"),
        ("raise SystemExit(0)", "SystemExit"),
        ("x = 1\0", "null bytes"),
        ("def speed(points, t): return points", "named 'velocity', got a file with speed"),
        ("", "named 'velocity', got a file with no function"),
        ("velocity = 3.0", "'velocity' to be a function, got 3.0"),
        (GOOD_FILE + "gradient = 3.0", "'gradient' to be a function, got 3.0"),
    ],
)
def test_files_that_cannot_be_used(tmp_path: Path, text: str, reason: str) -> None:
    path = write(tmp_path, text)
    modules = set(sys.modules)
    with pytest.raises(InputError, match=reason) as caught:
        load_user_flow(path)
    assert caught.value.where == str(path)
    if "named" not in reason and "function" not in reason:
        assert set(sys.modules) == modules


def test_missing_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="FileNotFoundError"):
        load_user_flow(tmp_path / "absent.py")
    with pytest.raises(InputError, match="IsADirectoryError"):
        load_user_flow(tmp_path)


def test_future_imports_do_not_leak_into_the_file(tmp_path: Path) -> None:
    text = "def velocity(points: int, t): return points\nkind = velocity.__annotations__\n"
    flow: Any = load_user_flow(write(tmp_path, text))
    assert flow.velocity_function.__annotations__["points"] is int
