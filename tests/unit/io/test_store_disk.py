"""A full disk at any write: the last commit stays readable and the error says what to do."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from stokesfibers.core.errors import StoreError
from stokesfibers.core.variables import lookup
from stokesfibers.io import atomic
from stokesfibers.io.checkpoint import Checkpoint
from stokesfibers.io.layout import ArrayLayout
from stokesfibers.io.reader import open_run
from stokesfibers.io.store import RunStore

LAYOUT = {
    f"observables/{name}": ArrayLayout(lookup("observables", name), tail)
    for name, tail in {"time": (), "extra_stress": (3, 3), "shear_stress": ()}.items()
}


def _records(start: int, count: int) -> dict[str, np.ndarray]:
    index = np.arange(start, start + count, dtype=float)
    return {key: np.multiply.outer(index + 0.5, np.ones(a.shape_tail)) for key, a in LAYOUT.items()}


def _checkpoint(number: int) -> Checkpoint:
    return Checkpoint({"a": np.full(50, number + 0.25), "b": np.arange(9)}, {"number": number})


def _fail_at(monkeypatch: pytest.MonkeyPatch, turn: int) -> Callable[[], int]:
    """Make the write number `turn` break off half-way; return a counter of writes."""
    count = 0
    real = atomic._write

    def write(fd: int, data: memoryview) -> None:
        nonlocal count
        count += 1
        if count == turn:
            real(fd, data[: len(data) // 2])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(fd, data)

    monkeypatch.setattr(atomic, "_write", write)
    return lambda: count


def _full_disk(action: Callable[[], None]) -> StoreError | None:
    """Return the error of an action that met a full disk, or None if it did not."""
    try:
        action()
    except StoreError as error:
        if f"'{os.strerror(errno.ENOSPC)}' (ENOSPC)" not in str(error):
            raise
        return error
    return None


def _flush(store: RunStore) -> None:
    store.append(_records(3, 2))
    store.commit({"code": "running"}, _checkpoint(2))


def _state(path: Path) -> tuple[int, int, bytes]:
    """Return length, number of the checkpoint and a fingerprint of the data, all verified."""
    data = open_run(path)["observables"].to_dataset().load()
    expected = _records(0, data.sizes["time"])
    for key, values in expected.items():
        np.testing.assert_array_equal(data[key.split("/")[1]], values, strict=False)
    saved = RunStore.open(path).checkpoint()
    if saved is None:
        return data.sizes["time"], -1, b""
    expected_saved = _checkpoint(saved.meta["number"])
    for name, values in expected_saved.arrays.items():
        np.testing.assert_array_equal(saved.arrays[name], values, strict=True)
    return data.sizes["time"], saved.meta["number"], saved.arrays["a"].tobytes()


@pytest.mark.parametrize("had_checkpoint", [False, True])
def test_full_disk_during_a_flush(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, had_checkpoint: bool
) -> None:
    turn = 0
    failures = 0
    while True:
        turn += 1
        path = tmp_path / f"run{turn}.zarr"
        with RunStore.create(path, LAYOUT, {}) as store:
            store.append(_records(0, 3))
            store.commit({"code": "running"}, _checkpoint(1) if had_checkpoint else None)
            before = _state(path)
            with monkeypatch.context() as patch:
                counter = _fail_at(patch, turn)
                error = _full_disk(lambda: _flush(store))
                if error is not None:
                    failures += 1
                    assert "Free some space, then resume" in str(error)
                    assert isinstance(error.__cause__, OSError)
                    assert _state(path) == before
                if counter() < turn:
                    break
        assert _state(path) == before
        # With space again the run goes on where it was.
        with RunStore.open(path, "a") as store:
            store.append(_records(3, 2))
            store.commit({"code": "done"}, _checkpoint(2))
        assert _state(path)[:2] == (5, 2)
    assert _state(path)[:2] == (5, 2)
    # Three arrays, the checkpoint's two (in both slots the first time) and the marker.
    assert failures == 3 + (2 if had_checkpoint else 4) + 1


def test_failed_flush_can_be_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.zarr"
    with RunStore.create(path, LAYOUT, {}) as store:
        store.append(_records(0, 4))
        for turn in (2, 5):  # the second chunk, the second array of the checkpoint
            with monkeypatch.context() as patch:
                _fail_at(patch, turn)
                with pytest.raises(StoreError, match="ENOSPC"):
                    store.commit({"code": "running"}, _checkpoint(1))
        with monkeypatch.context() as patch:
            _fail_at(patch, 5)
            with pytest.raises(StoreError, match="ENOSPC"):
                store.commit({"code": "running"}, _checkpoint(1))
        store.commit({"code": "running"}, _checkpoint(1))
    assert _state(path)[:2] == (4, 1)


@pytest.mark.parametrize("turn", [1, 3, 6, 7])  # the copies of the metadata, then the marker
def test_full_disk_during_truncation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, turn: int
) -> None:
    path = tmp_path / "run.zarr"
    with RunStore.create(path, LAYOUT, {}) as store:
        store.append(_records(0, 6))
        store.commit({"code": "running"})
        with monkeypatch.context() as patch:
            _fail_at(patch, turn)
            with pytest.raises(StoreError, match="ENOSPC"):
                store.truncate({"observables": 2})
        assert _state(path)[0] == 6
        assert store.lengths == {"observables": 6}
        store.append(_records(6, 1))
        store.commit({"code": "running"})
    assert _state(path)[0] == 7


@pytest.mark.parametrize("overwrite", [False, True])
def test_failed_creation_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, overwrite: bool
) -> None:
    path = tmp_path / "run.zarr"
    if overwrite:
        with RunStore.create(path, LAYOUT, {}) as store:
            store.append(_records(0, 3))
            store.commit({"code": "done"})
    for turn in range(1, 100):
        with monkeypatch.context() as patch:
            _fail_at(patch, turn)
            error = _full_disk(
                lambda: RunStore.create(path, LAYOUT, {}, overwrite=overwrite).close()
            )
        if error is None:
            break
        assert [p.name for p in tmp_path.iterdir()] == (["run.zarr"] if overwrite else [])
        if overwrite:
            assert _state(path)[0] == 3
    # Metadata of a group and three arrays, two sets of labels (metadata and values), the marker.
    # What comes after, the copies at closing, may fail unnoticed.
    assert turn == 1 + 3 + 2 * 2 + 1 + 1
    assert [p.name for p in tmp_path.iterdir()] == ["run.zarr"]
    assert _state(path)[0] == 0
