"""Wheel and source distribution: what is in them, and that both work in clean environments."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

from stokesfibers.core.version import __version__

ROOT = Path(__file__).parents[2]
MODULES = {
    p.relative_to(ROOT / "src").as_posix() for p in (ROOT / "src" / "stokesfibers").rglob("*.py")
}
DATA = {
    p.relative_to(ROOT / "src").as_posix()
    for p in (ROOT / "src" / "stokesfibers").rglob("*")
    if p.is_file() and p.suffix not in (".py", ".pyc", ".nbi", ".nbc")
}
SHIPPED = {
    f"stokesfibers/{p.relative_to(ROOT).as_posix()}"
    for p in (ROOT / "cases").rglob("*")
    if p.is_file()
}
CASE = """\
fiber.slenderness = 1e-2
fluid.mu_bar = 1e3
flow.kind = "shear"
stepping = {rtol = 1e-3, until = 0.2}
"""
SWEEP = """\
base = "case.toml"
grid.fiber.slenderness = [1e-2, 1e-3]
collect.final = ["elastic_energy"]
"""
_NO_INDEX = ("No matching distribution", "Could not find a version", "connection", "Temporary")

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


def _call(*words: object, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command outside the source tree, without what this environment adds to Python."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV"))}
    return subprocess.run(
        [str(word) for word in words], cwd=folder, env=clean, capture_output=True, text=True
    )


def _skip_if_offline(result: subprocess.CompletedProcess[str]) -> None:
    if result.returncode and any(sign in result.stderr for sign in _NO_INDEX):
        pytest.skip("no package index can be reached")
    assert result.returncode == 0, result.stderr[-2000:]


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with wheel and source distribution, built as a release is."""
    out = tmp_path_factory.mktemp("dist")
    _skip_if_offline(_call(sys.executable, "-m", "build", "--outdir", out, ROOT, folder=out))
    return out


@pytest.fixture(scope="module")
def wheel(dist: Path) -> zipfile.ZipFile:
    """The wheel."""
    return zipfile.ZipFile(next(dist.glob("*.whl")))


def test_wheel_holds_the_package_and_nothing_else(wheel):
    names = {n for n in wheel.namelist() if ".dist-info/" not in n}
    assert names == MODULES | DATA | SHIPPED
    assert len(MODULES) > 100


def test_wheel_says_what_it_is(wheel):
    name = next(n for n in wheel.namelist() if n.endswith("/METADATA"))
    found = Parser().parsestr(wheel.read(name).decode())
    assert found["Name"] == "stokesfibers"
    assert found["Version"] == __version__
    assert found["License-Expression"] == "BSD-3-Clause"
    assert found["Requires-Python"] == ">=3.11"
    core = [r for r in found.get_all("Requires-Dist", []) if "extra ==" not in r]
    assert not [r for r in core if r.startswith(("dask", "distributed", "ducc0", "mpi4py"))]
    assert {"sweep", "fast", "mpi", "dev"} <= set(found.get_all("Provides-Extra", []))
    assert "## Two commands" in found.get_payload()
    assert any(n.endswith("licenses/LICENSE") for n in wheel.namelist())


def test_source_distribution_holds_what_tests_and_users_need(dist):
    with tarfile.open(next(dist.glob("*.tar.gz"))) as archive:
        names = {n.partition("/")[2] for n in archive.getnames()}
    assert {f"src/{m}" for m in MODULES} <= names
    kept = {"LICENSE", "README.md", "CITATION.cff", "cases/buckling.toml", "tests/support.py"}
    assert kept <= names
    assert not [n for n in names if ".zarr" in n or "__pycache__" in n or n.startswith(".venv")]


@pytest.fixture(scope="module", params=["*.whl", "*.tar.gz"], ids=["wheel", "sdist"])
def installed(request, dist, tmp_path_factory) -> Path:
    """The folder of the commands of a clean environment with the package in it."""
    place = tmp_path_factory.mktemp("clean")
    made = _call(sys.executable, "-m", "venv", place / "env", folder=place)
    assert made.returncode == 0, made.stderr
    commands = place / "env" / ("Scripts" if sys.platform == "win32" else "bin")
    file = next(dist.glob(request.param))
    _skip_if_offline(_call(commands / "python", "-m", "pip", "install", "-q", file, folder=place))
    return commands


def test_installed_package_works(installed, tmp_path):
    (tmp_path / "case.toml").write_text(CASE)
    (tmp_path / "sweep.toml").write_text(SWEEP)

    def run(*words: str) -> str:
        result = _call(installed / "stokesfibers", *words, folder=tmp_path)
        assert result.returncode == 0, f"{words}: {result.stderr}"
        return result.stdout

    assert run("--version").strip() == f"stokesfibers {__version__}"
    assert "bad" not in run("doctor")
    run("run", "case.toml", "--out", "run.zarr")
    assert json.loads(run("show", "run.zarr", "--json"))["status"]["code"] == "done"
    run("plot", "run.zarr", "shapes", "--out", "shapes.png")
    assert (tmp_path / "shapes.png").stat().st_size > 5000
    run("reproduce", "fig14", "--quick", "--out", "figures")
    assert json.loads((tmp_path / "figures" / "fig14.json").read_text())["verdict"] == "agrees"
    run("sweep", "sweep.toml", "--workers", "1")
    assert json.loads(run("sweep", "status", "sweep", "--json"))["counts"]["done"] == 2
    missing = _call(installed / "stokesfibers", "sweep", "sweep.toml", "--out", "two",
                    "--workers", "2", folder=tmp_path)  # fmt: skip
    assert missing.returncode == 2
    assert "pip install 'stokesfibers[sweep]'" in missing.stderr
    everything = "import stokesfibers as sf; [getattr(sf, name) for name in sf.__all__]"
    assert _call(installed / "python", "-c", everything, folder=tmp_path).returncode == 0
