"""What records say of themselves in their docstrings, told of a file instead of Python."""

from __future__ import annotations

import inspect
import re


def summary(cls: type) -> str:
    """Return the first line of a docstring."""
    return _in_toml(inspect.cleandoc(cls.__doc__ or "").partition("\n")[0])


def meanings(cls: type) -> dict[str, str]:
    """Return the texts of the section Attributes of a numpydoc docstring, by name."""
    text = inspect.cleandoc(cls.__doc__ or "")
    _, _, section = text.partition("Attributes\n----------\n")
    section = re.split(r"\n\w+\n-{3,}\n", section)[0]
    found: dict[str, str] = {}
    for names, meaning in re.findall(r"^(\w[\w, ]*)\n((?:[ \t]+.*\n?|\n)+)", section, re.M):
        for name in names.split(","):
            found[name.strip()] = _in_toml(" ".join(meaning.split()))
    return found


def _in_toml(text: str) -> str:
    """Return a meaning as it is said of a file, where a key that is None is left out."""
    text = text.replace("``", "").replace("`", "'")
    return text.replace("if None", "if left out").replace("None for", "default")
