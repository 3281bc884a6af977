"""The text beside a run in the viewer: what it is, how it ended, what the colours mean."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stokesfibers.plot.case import stored_case

if TYPE_CHECKING:
    import xarray as xr


def about(rr: Any, data: xr.DataTree, name: str, *shown: str) -> Any:
    """Return the text as a Rerun document.

    Parameters
    ----------
    rr
        The package rerun.
    data
        The stored run.
    name
        What it is called.
    shown
        What colours show, and what else there is to see, a line each.
    """
    return rr.TextDocument(about_text(data, name, *shown), media_type=rr.MediaType.MARKDOWN)


def about_text(data: xr.DataTree, name: str, *shown: str) -> str:
    """Return the text in Markdown; arguments as `about`."""
    status: Any = data.attrs.get("status", {})
    if not isinstance(status, Mapping):
        status = {}
    said = " ".join(str(status[k]) for k in ("explanation", "hint") if status.get(k))
    sizes = data["trajectory"].sizes
    lines = [
        f"# {name}",
        f"**{status.get('code', 'unknown')}** at t = {status.get('time', 0.0):.6g}. {said}",
        f"{sizes['fiber']} fibers, {sizes['node']} points each, {sizes['time']} recorded shapes.",
        *(f"{line}." for line in shown),
    ]
    tables = [_table(key, value) for key, value in stored_case(data).items()]
    return "\n\n".join([*lines, "## Case", *tables])


def _table(key: str, value: Any) -> str:
    """Return a table of the case as code: nothing in it is taken for formatting."""
    if isinstance(value, Mapping):
        rows = "\n".join(f"{k} = {json.dumps(v)}" for k, v in value.items())
        return f"```\n[{key}]\n{rows}\n```"
    if isinstance(value, list) and all(isinstance(v, Mapping) for v in value):
        return "\n".join(_table(f"[{key}]", v) for v in value)
    return f"```\n{key} = {json.dumps(value)}\n```"
