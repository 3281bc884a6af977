"""The case files that come with the package, to start from."""

from __future__ import annotations

from pathlib import Path

from stokesfibers.core.errors import InputError

_PACKAGE = Path(__file__).resolve().parents[1]
_FOLDERS = (_PACKAGE / "cases", _PACKAGE.parents[1] / "cases")
"""In an installed package, and in a source tree."""


def shipped_cases() -> dict[str, Path]:
    """Return the shipped case files by name; sweeps are called ``sweeps/NAME``."""
    folder = next((f for f in _FOLDERS if f.is_dir()), None)
    if folder is None:
        return {}
    found = sorted([*folder.glob("*.toml"), *folder.glob("sweeps/*.toml")])
    return {str(path.relative_to(folder).with_suffix("")): path for path in found}


def about(path: Path) -> str:
    """Return the first line of a case file, which says what it is."""
    with path.open(encoding="utf-8") as file:
        return file.readline().lstrip("# ").strip()


def copied(name: str, out: Path | None = None) -> list[Path]:
    """Copy a shipped case, with the file of shapes that it reads, and return what was written.

    Parameters
    ----------
    name
        One of `shipped_cases`.
    out
        File to write; ``NAME.toml`` in this folder if None.

    Raises
    ------
    InputError
        If there is no such case, or a file is in the way.
    """
    cases = shipped_cases()
    if name not in cases:
        raise InputError("NAME", f"one of {', '.join(cases)}", repr(name))
    source = cases[name]
    target = out or Path(source.name)
    pairs = [(source, target)]
    shapes = source.with_suffix(".npy")
    if shapes.exists():
        pairs.append((shapes, target.with_name(shapes.name)))
    for _, new in pairs:
        if new.exists():
            raise InputError("--out", "a file that does not exist", str(new), "Choose another.")
        if not new.parent.is_dir():
            raise InputError("--out", "a file in a folder that exists", str(new))
    for old, new in pairs:
        new.write_bytes(old.read_bytes())
    return [new for _, new in pairs]
