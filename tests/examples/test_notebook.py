"""The notebook of the documentation runs from top to bottom and shows what it says."""

from __future__ import annotations

import asyncio
import re
import sys
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[2] / "docs" / "notebook.ipynb"


@pytest.fixture(scope="module")
def executed():
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    if sys.platform == "win32":
        asyncio.set_event_loop_policy(asyncio.WindowsSelectorEventLoopPolicy())
    return nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3").execute()


def _outputs(notebook, kind: str) -> list[str]:
    found = []
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            found.append(output.get("data", {}).get(kind, "") or output.get("text", ""))
    return found


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_notebook_runs_and_draws(executed):
    assert sum(bool(data) for data in _outputs(executed, "image/png")) >= 2
    text = "\n".join(_outputs(executed, "text/plain"))
    assert "done at t = 6.2" in text
    assert "elastic_energy" in text
    assert re.search(r"Dimensions:\s+\(mu_bar: 8\)", text)


def test_notebook_is_kept_without_outputs():
    """What it shows is made when the documentation is built, and cannot grow stale."""
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(code) >= 5
    assert all(not cell.outputs and cell.execution_count is None for cell in code)
