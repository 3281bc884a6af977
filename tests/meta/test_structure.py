"""The house rules that a machine can count: layers, lengths, parameters."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "src" / "stokesfibers").rglob("*.py"))
COUNTED = [p for p in SOURCES if "kernels" not in p.parts]
LONGEST_MODULE = 300
LONGEST_FUNCTION = 60
MOST_POSITIONAL = 4


def _functions(path: Path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def _name(path: Path) -> str:
    return str(path.relative_to(ROOT / "src"))


def test_sources_are_found():
    assert len(COUNTED) > 40


@pytest.mark.parametrize("path", COUNTED, ids=_name)
def test_module_starts_with_a_docstring_and_is_short(path):
    text = path.read_text()
    assert len(text.splitlines()) <= LONGEST_MODULE
    if text.strip():
        assert ast.get_docstring(ast.parse(text)), "a module starts with what it is for"


@pytest.mark.parametrize("path", COUNTED, ids=_name)
def test_functions_are_short_with_few_positional_parameters(path):
    for function in _functions(path):
        length = function.end_lineno - function.lineno + 1
        assert length <= LONGEST_FUNCTION, f"{function.name}: {length} lines"
        arguments = [*function.args.posonlyargs, *function.args.args]
        own = [a for a in arguments if a.arg not in ("self", "cls")]
        assert len(own) <= MOST_POSITIONAL, f"{function.name}: {len(own)} positional parameters"


@pytest.mark.parametrize("path", SOURCES, ids=_name)
def test_nothing_inside_imports_the_package_root(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            assert all(alias.name != "stokesfibers" for alias in node.names)
        if isinstance(node, ast.ImportFrom):
            assert node.module != "stokesfibers" or path.name == "__init__.py"
