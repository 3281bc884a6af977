"""The documentation says what is there: links, commands, cases and formulas; the site builds."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import stokesfibers as sf
from stokesfibers.cli.main import main

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
SKIPPED = {"_build", "gallery", "generated"}
PAGES = sorted(p for p in DOCS.rglob("*.md") if not SKIPPED & set(p.relative_to(DOCS).parts))
READ = [ROOT / "README.md", *PAGES]
MADE_WHEN_BUILT = "gallery/"
FORMULA = re.compile(r"\$\$(.+?)\$\$|\$([^$\n]+?)\$", flags=re.S)
SIZED = re.compile(r"\\[Bb]igg?[lrm]?(?![a-z])")  # MathJax knows them, docutils does not
FENCED = re.MULTILINE | re.DOTALL
WHOLE_CASES = ("tutorial.md", "faq.md")


def _name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def _prose(path: Path) -> str:
    return re.sub(r"`[^`\n]*`", "", re.sub(r"```.*?```", "", path.read_text(), flags=re.S))


def test_pages_are_found():
    assert len(PAGES) > 15


@pytest.mark.parametrize("page", READ, ids=_name)
def test_relative_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)\s]+)\)", FORMULA.sub("", _prose(page)))
    for link in links:
        target = link.partition("#")[0]
        if target and not re.match(r"[a-z]+:", target) and MADE_WHEN_BUILT not in target:
            assert (page.parent / target).exists(), link
    for link in links:  # pages of the gallery come from scripts of the same name
        if MADE_WHEN_BUILT in link and not link.endswith("index.rst"):
            script = ROOT / "examples" / f"{Path(link).stem}.py"
            assert script.exists(), link


@pytest.mark.parametrize("page", READ, ids=_name)
def test_commands_exist(page):
    for block in re.findall(r"^```(?:sh|console)\n(.*?)^```", page.read_text(), FENCED):
        for name in re.findall(r"^(?:\$ )?(?:mpirun -n \d+ )?stokesfibers ([a-z]+)", block, re.M):
            assert name in main.commands, name


@pytest.mark.parametrize("name", WHOLE_CASES)
def test_cases_load(name, tmp_path):
    blocks = re.findall(r"```toml\n(.*?)```", (DOCS / name).read_text(), flags=re.S)
    whole = [block for block in blocks if "[fiber]" in block and "[stepping]" in block]
    assert whole
    for block in whole:
        (tmp_path / "case.toml").write_text(block)
        assert sf.load_case(tmp_path / "case.toml").problem.fibers


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_formulas_can_be_shown(page):
    latex2mathml = pytest.importorskip("docutils.utils.math.latex2mathml")
    for display, inline in FORMULA.findall(_prose(page)):
        source = SIZED.sub("", (display or inline).strip()).replace(r"\dots", r"\ldots")
        assert "<math" in latex2mathml.tex2mathml(source, as_block=bool(display)), source


def test_the_api_page_names_everything_public():
    named = set(
        re.findall(r"^\.\. auto\w+:: (?:[\w.]+\.)?(\w+)", (DOCS / "api.md").read_text(), re.M)
    )
    assert set(sf.__all__) - named <= {"__version__", "plot", "shapes"}


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_site_builds_without_warnings(tmp_path):
    """With all examples and the notebook executed."""
    pytest.importorskip("sphinx")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", DOCS, tmp_path / "html"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    pages = list((tmp_path / "html").rglob("*.html"))
    assert len(pages) > 30
    names = {page.relative_to(tmp_path / "html").as_posix() for page in pages}
    broken = []
    for page in pages:
        for link in re.findall(r'(?:href|src)="([^"#?]+)', page.read_text()):
            if not re.match(r"[a-z]+:|//", link):
                target = (page.parent / link).resolve()
                if not target.exists():
                    broken.append((page.name, link))
    assert not broken, broken
    assert "gallery/buckling_in_shear.html" in names
