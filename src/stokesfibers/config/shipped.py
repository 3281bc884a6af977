"""The case files that come with the package, to start from."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Copies:
    """What `copied` made.

    Attributes
    ----------
    written
        The files written, the one asked for first.
    kept
        The case that a sweep varies, where there was one already that differs from the shipped.
    """

    written: tuple[Path, ...]
    kept: Path | None = None


def copied(name: str, out: Path | None = None) -> Copies:
    """Copy a shipped case, with the files that it reads.

    A sweep is called ``NAME_sweep.toml``, beside the case that it varies. That case is kept if
    there is one: somebody may have edited it.

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
    kept = None
    if is_sweep:
        base = _BASE.search(text)
        assert base is not None
        varied = source.parent / base[1]
        written[target] = _BASE.sub(f'base = "{varied.name}"', text, count=1).encode()
        beside = target.with_name(varied.name)
        if _differs(beside, varied.read_bytes()):
            kept = beside
        else:
            written[beside] = varied.read_bytes()
    shapes = source.with_suffix(".npy")
    if shapes.exists():
        written[target.with_name(shapes.name)] = shapes.read_bytes()
    _refuse_what_is_in_the_way(target, written, "NAME" if out is None else "--out")
    for new, content in written.items():
        new.write_bytes(content)
    return Copies(tuple(written), kept)


def _refuse_what_is_in_the_way(target: Path, written: Mapping[Path, bytes], where: str) -> None:
    for new, content in written.items():
        if new == target and new.exists():
            hint = "It is kept; choose another name with --out FILE."
            raise InputError(where, "a file to write that does not exist", str(new), hint)
        if _differs(new, content):
            expected = f"to write '{new}', which the case reads"
            hint = "It is kept; choose another folder with --out FOLDER/FILE."
            raise InputError(where, expected, "another file of that name", hint)
        if not new.parent.is_dir():
            raise InputError(where, "a file in a folder that exists", str(new))


def _differs(file: Path, content: bytes) -> bool:
    """Return whether there is a file already that holds something else."""
    return file.exists() and (not file.is_file() or file.read_bytes() != content)
