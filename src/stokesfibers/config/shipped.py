"""The case files that come with the package, to start from."""

from __future__ import annotations

import re
from pathlib import Path

from stokesfibers.core.errors import InputError
from stokesfibers.core.tables import did_you_mean

_PACKAGE = Path(__file__).resolve().parents[1]
_FOLDERS = (_PACKAGE / "cases", _PACKAGE.parents[1] / "cases")
"""In an installed package, and in a source tree."""
_BASE = re.compile(r'^base = "(.+)"', re.MULTILINE)


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
    """Copy a shipped case, with the files that it reads, and return what was written.

    A sweep is called ``NAME_sweep.toml``, beside the case that it varies.

    Parameters
    ----------
    name
        One of `shipped_cases`.
    out
        File to write; ``NAME.toml`` or ``NAME_sweep.toml`` in this folder if None.

    Raises
    ------
    InputError
        If there is no such case, or a file is in the way.
    """
    cases = shipped_cases()
    if name not in cases:
        raise InputError(
            "NAME", f"one of {', '.join(cases)}", repr(name), did_you_mean(name, cases)
        )
    source = cases[name]
    is_sweep = name.startswith("sweeps/")
    target = out or Path(f"{source.stem}_sweep.toml" if is_sweep else source.name)
    text = source.read_text(encoding="utf-8")
    written = {target: text.encode()}
    if is_sweep:
        base = _BASE.search(text)
        assert base is not None
        varied = source.parent / base[1]
        written[target] = _BASE.sub(f'base = "{varied.name}"', text, count=1).encode()
        written[target.with_name(varied.name)] = varied.read_bytes()
    shapes = source.with_suffix(".npy")
    if shapes.exists():
        written[target.with_name(shapes.name)] = shapes.read_bytes()
    for new, content in written.items():
        if new.exists() and (new == target or new.read_bytes() != content):
            raise InputError("--out", "a file that does not exist", str(new), "Choose another.")
        if not new.parent.is_dir():
            raise InputError("--out", "a file in a folder that exists", str(new))
    for new, content in written.items():
        new.write_bytes(content)
    return list(written)
