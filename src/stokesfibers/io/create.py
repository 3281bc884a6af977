"""Making the folder of a new run: whole or not at all, and never over anything but a run."""

from __future__ import annotations

import json
import os
import shutil
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from stokesfibers.core.errors import StoreError
from stokesfibers.core.status import Status
from stokesfibers.io import lock, marker
from stokesfibers.io.atomic import disk_errors, write_atomic
from stokesfibers.io.layout import ArrayLayout, layout_files


def create_folder(
    path: Path,
    layout: Mapping[str, ArrayLayout],
    attributes: Mapping[str, Any],
    labels: Mapping[str, Sequence[str]],
    *,
    overwrite: bool,
) -> int:
    """Make the store described in `RunStore.create` and return its lock.

    It is built beside `path` under a hidden name and moved into place when whole.
    """
    own = marker.user_attributes(attributes)
    files = layout_files(layout, labels)
    _check_place(path, overwrite)
    part = path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}.partial")
    with disk_errors(path):
        try:
            part.mkdir()
            _write_files(part, files, own)
            fd = lock.acquire(part)
            try:
                _move(part, path)
            except BaseException:
                os.close(fd)
                raise
        except BaseException:
            shutil.rmtree(part, ignore_errors=True)
            raise
    return fd


def _check_place(path: Path, overwrite: bool) -> None:
    if not path.parent.is_dir():
        hint = f"Make the folder {path.parent} first."
        raise StoreError(str(path), "a place in an existing folder", "a missing folder", hint)
    if not path.exists():
        return
    if not overwrite:
        hint = "Choose another path, or replace it with --overwrite."
        raise StoreError(str(path), "a path that does not exist yet", "one that does", hint)
    try:
        marker.read(path)
    except StoreError as error:
        raise StoreError(
            str(path),
            "a run of stokesfibers to overwrite",
            f"something else ({error.got})",
            "Nothing else is ever overwritten; remove it yourself.",
        ) from error


def _write_files(folder: Path, files: Mapping[str, bytes], attributes: Mapping[str, Any]) -> None:
    docs = {}
    for name, data in files.items():
        if name == marker.NAME:
            continue
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if name.endswith(f"/{marker.NAME}"):
            docs[name.removesuffix(f"/{marker.NAME}")] = json.loads(data)
        else:
            write_atomic(folder / name, data)
    marker.write_copies(folder, docs)
    marked = {"status": Status("running", 0.0).to_dict(), "checkpoint": None}
    write_atomic(folder / marker.NAME, marker.encode(docs, {**attributes, **marked}), sync=True)


def _move(part: Path, path: Path) -> None:
    """Move the finished store to its place; an old run there goes only once that is done."""
    if not path.exists():
        part.rename(path)
        return
    marker.read(path)
    held = lock.acquire(path)
    old = part.with_suffix(".old")
    try:
        path.rename(old)
        try:
            part.rename(path)
        except BaseException:
            old.rename(path)
            raise
    finally:
        os.close(held)
    shutil.rmtree(old, ignore_errors=True)
