"""Kernels are the same machine code in every process, whatever was compiled there before."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
KERNELS = sorted((ROOT / "src" / "stokesfibers" / "kernels").glob("*.py"))
# Prints the instructions of all kernels that a few steps of some cases compile, by name.
CHILD = """
import importlib, json, pkgutil, re, sys
from pathlib import Path

import numba
import numpy as np

def first(x, k, j, z, c):
    a = x**2 + x**3 + x**-2 + x**k + x**j + k**2 + np.round(x) + np.hypot(x, x)
    a += max(x, 1.0) + min(x, 2.0) + max(0.0, x) + min(1.0, x) + max(k, j) + max(x, 1.0, x)
    a += abs(z) + abs(c) + min(x, 1.0, x)
    return a, z * z + z / x + np.sqrt(z) + 1j * z + 2.0 * z / z, c * c + c / x + 1j * c + 2.0 * c

freedom = set(sys.argv[1].split())
begun = numba.njit(fastmath=freedom or False, error_model="numpy")(first)
begun(1.5, 3, np.int32(2), 1.0 + 2.0j, np.complex64(1j))

import stokesfibers.kernels
from stokesfibers.config.case import load_case
from stokesfibers.run.simulate import simulate

for name, until, settings in json.loads(sys.argv[3]):
    case = load_case(Path(sys.argv[2]) / (name + ".toml"), settings=settings)
    simulate(case.problem, case.curves(), until=until, record=case.record, threads=1)
    print(name, file=sys.stderr)

called = re.compile(
    r'"?[.]bytes[.][-0-9]+"?|[\\w.$"-]*_ZN[\\w.$%@-]*|[.]const[.][^ ,)"]*|[.]L[\\w.]*'
)

def instructions(text):
    lines = (line.strip() for line in text.splitlines())
    return [called.sub("*", k) for k in lines if k and k[0] not in ".#" and k[-1] != ":"]

found = {}
for module in pkgutil.iter_modules(stokesfibers.kernels.__path__):
    kernels = importlib.import_module("stokesfibers.kernels." + module.name)
    for name, kernel in vars(kernels).items():
        if getattr(kernel, "targetoptions", {}).get("forceinline") or module.name == "dense":
            continue
        for signature in getattr(kernel, "signatures", []):
            library = kernel.overloads[signature].library
            found[f"{module.name}.{name} {signature}"] = instructions(library.get_asm_str())
print(json.dumps(found))
"""
CASES = [
    ("fig12", 0.03, ["fiber.count=3", "domain.reach=2"]),
    ("suspension", 0.01, ["fiber.count=3"]),
    ("sheared_cell", 0.001, ["fiber.count=3"]),
    ("settling", 1e-5, []),
]


def _compiled(where: Path, *words: str) -> dict[str, list[str]]:
    done = subprocess.run(
        [sys.executable, "-c", CHILD, *words, str(ROOT / "cases"), json.dumps(CASES)],
        env={**os.environ, "NUMBA_CACHE_DIR": str(where)},
        capture_output=True,
        text=True,
        timeout=550,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_kernels_do_not_depend_on_what_was_compiled_before(tmp_path):
    strict = _compiled(tmp_path / "one", "")
    free = _compiled(tmp_path / "two", "reassoc contract arcp nsz")
    assert set(strict) == set(free)
    assert len({name.split()[0] for name in strict}) >= 25
    for name, instructions in strict.items():
        assert len(instructions) > 50
        assert free[name] == instructions, name


def _compiled_functions(path: Path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef) and "njit" in ast.unparse(node.decorator_list):
            yield node


@pytest.mark.parametrize("path", KERNELS, ids=lambda path: path.stem)
def test_kernels_write_powers_and_complex_numbers_out(path):
    for function in _compiled_functions(path):
        for node in ast.walk(function):
            told = f"{path.name}: {function.name}: {ast.unparse(node)}"
            if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.Pow):
                power = node.right if isinstance(node, ast.BinOp) else node.value
                assert not isinstance(power, ast.Name), told
                assert not isinstance(getattr(power, "value", None), int), told
            if isinstance(node, ast.Constant):
                assert not isinstance(node.value, complex), told
