"""The marker: the one file that says how much of a run store is valid.

It is the ``zarr.json`` of the root. Its inline consolidated metadata holds the metadata, and with
it the lengths, of all arrays; its attributes hold the status and which checkpoint counts. Readers
that use consolidated metadata, as xarray does, see one consistent state, whatever the writer does.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import google_crc32c  # of zarr, whose codec it is

from stokesfibers.core.errors import StoreError
from stokesfibers.io.atomic import write_atomic
from stokesfibers.io.layout import GROWING

NAME = "zarr.json"
FORMAT = "stokesfibers-run"
FORMAT_VERSION = 2
"""2: chunks have checksums."""
_READABLE = (1, 2)
_SEAL = "crc32c"  # of what says where values are; attributes may be added by hand
RESERVED = ("format", "format_version", _SEAL, "status", "checkpoint")
"""Attributes of the root that the store itself writes."""

Docs = Mapping[str, Mapping[str, Any]]
"""Zarr metadata of all groups and arrays below the root, by path."""


def encode(docs: Docs, attributes: Mapping[str, Any]) -> bytes:
    """Return the marker as the bytes of a file."""
    seal = _seal(docs, attributes.get("checkpoint"))
    head = {"format": FORMAT, "format_version": FORMAT_VERSION, _SEAL: seal}
    return _group(docs, {**head, **attributes})


def write_copies(folder: Path, docs: Docs) -> None:
    """Write the metadata files below the root, for readers that start there.

    They only repeat what the marker says, and are written after it. In a run in progress they may
    lag behind: replacing so many files at each commit would take longer than the rest of it.
    """
    for path, doc in docs.items():
        if doc["node_type"] == "array":
            (folder / path).mkdir(parents=True, exist_ok=True)
            write_atomic(folder / path / NAME, json.dumps(doc).encode())
    for group in {path.split("/")[0] for path in docs}:
        inside = {p.split("/")[1]: doc for p, doc in docs.items() if p.startswith(f"{group}/")}
        write_atomic(folder / group / NAME, _group(inside, docs[group].get("attributes", {})))


def _group(docs: Docs, attributes: Mapping[str, Any]) -> bytes:
    doc = {
        "zarr_format": 3,
        "node_type": "group",
        "attributes": attributes,
        "consolidated_metadata": {"kind": "inline", "must_understand": False, "metadata": docs},
    }
    return json.dumps(doc, allow_nan=False).encode()


def read(path: Path) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """Return the metadata of everything below the root, and the attributes of the root.

    Raises
    ------
    StoreError
        If `path` is missing, no folder, no Zarr store, not a run, of another version or damaged.
    """
    expected = "a run store (a folder such as run.zarr)"
    if not path.exists():
        raise StoreError(str(path), expected, "nothing there", "Check the path.")
    if not path.is_dir():
        raise StoreError(str(path), expected, "a file, not a folder", "Check the path.")
    try:
        text = (path / NAME).read_bytes()
    except FileNotFoundError:
        got = f"a folder without {NAME}, so not a Zarr store"
        raise StoreError(str(path), expected, got, "Check the path.") from None
    except OSError as error:
        raise StoreError(str(path), "to read the run", f"'{error.strerror}'") from error
    try:
        doc = json.loads(text)
        attributes = doc.get("attributes", {})
    except (ValueError, AttributeError) as error:
        hint = f"The arrays below it may be intact. ({error})"
        raise StoreError(str(path), f"a readable {NAME}", "a damaged one", hint) from error
    if attributes.get("format") != FORMAT:
        got = "a Zarr store of another kind"
        raise StoreError(str(path), "a run of stokesfibers", got, "Check the path.")
    version = attributes.get("format_version")
    if version not in _READABLE:
        hint = "Use the version of stokesfibers that wrote it, or a newer one."
        raise StoreError(str(path), f"format version {FORMAT_VERSION}", version, hint)
    try:
        docs = doc["consolidated_metadata"]["metadata"]
        _check_lengths(docs)
        if attributes.get(_SEAL) not in (None, _seal(docs, attributes.get("checkpoint"))):
            raise ValueError("its checksum does not match")
    except (KeyError, TypeError, ValueError) as error:
        raise StoreError(
            str(path), f"a complete {NAME}", f"a damaged one ({error!r})", "Restore it from a copy."
        ) from error
    return docs, attributes


def lengths(docs: Docs) -> dict[str, int]:
    """Return the number of records of each group that grows."""
    return {path.split("/")[0]: doc["shape"][0] for path, doc in growing(docs).items()}


def growing(docs: Docs) -> dict[str, Mapping[str, Any]]:
    """Return the metadata of the arrays that grow."""
    return {
        path: doc
        for path, doc in docs.items()
        if any(name in GROWING for name in doc.get("dimension_names", [])[:1])
    }


def with_lengths(docs: Docs, records: Mapping[str, int]) -> dict[str, Mapping[str, Any]]:
    """Return `docs` with the arrays that grow as long as `records` says for their group."""
    changed = {
        path: {**doc, "shape": [records[path.split("/")[0]], *doc["shape"][1:]]}
        for path, doc in growing(docs).items()
    }
    return {**docs, **changed}


def user_attributes(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes of the root as they will be read back; ValueError if they cannot be."""
    taken = attributes.keys() & set(RESERVED)
    if taken:
        raise ValueError(f"the store itself writes the attributes {sorted(taken)}")
    return json_ready(attributes, "attributes")


def json_ready(values: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Return `values` as they will be read back; ValueError if JSON cannot hold them exactly."""
    try:
        return json.loads(json.dumps(values, allow_nan=False))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} must hold finite JSON values only: {error}") from error


def finite(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return `values` with numbers that are not finite as text: a status must never be refused."""
    return {
        key: str(value) if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in values.items()
    }


def _check_lengths(docs: Docs) -> None:
    known = lengths(docs)
    for path, doc in growing(docs).items():
        if doc["shape"][0] != known[path.split("/")[0]]:
            raise ValueError(f"{path} has {doc['shape'][0]} records, its group another number")


def _seal(docs: Docs, checkpoint: Mapping[str, Any] | None) -> str:
    """Return the checksum of the metadata and of the entry of the checkpoint; older ones have none.

    It is of their content and not of the bytes, which other tools may write in another way.
    """
    text = json.dumps([docs, checkpoint], sort_keys=True, allow_nan=False)
    return f"{google_crc32c.value(text.encode()):08x}"
