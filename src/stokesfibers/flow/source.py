"""Where the functions of a user's flow come from, kept so that a stored run can be traced."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class SourceFile:
    """A file of source code as it was when the flow was made.

    Attributes
    ----------
    path
        Absolute path.
    sha256
        Hexadecimal digest of the file's bytes.
    """

    path: str
    sha256: str


def source_file(path: Path, content: bytes) -> SourceFile:
    """Return the record of the file at `path` whose bytes are `content`."""
    return SourceFile(str(path.resolve()), hashlib.sha256(content).hexdigest())


def sources_of(*functions: Callable[..., Any] | None) -> tuple[SourceFile, ...]:
    """Return the files that define `functions`, each once, in order.

    None, and functions without a readable file (typed at a prompt, compiled), add nothing.
    """
    found: dict[str, SourceFile] = {}
    for function in functions:
        if function is None:
            continue
        source = _source_of(function)
        if source is not None:
            found.setdefault(source.path, source)
    return tuple(found.values())


def _source_of(function: Callable[..., Any]) -> SourceFile | None:
    inner = inspect.unwrap(getattr(function, "func", function))
    try:
        name = inspect.getsourcefile(inner if hasattr(inner, "__qualname__") else type(inner))
        return None if name is None else source_file(Path(name), Path(name).read_bytes())
    except (TypeError, OSError):
        return None
