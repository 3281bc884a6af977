"""Damage is detected and named: by plain xarray, by our reader, when a run goes on."""

from __future__ import annotations

import json
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray

from stokesfibers.core.errors import StoreError
from stokesfibers.core.variables import lookup
from stokesfibers.io import layout as layout_module
from stokesfibers.io import marker, records
from stokesfibers.io.integrity import MISSING, damages
from stokesfibers.io.layout import ArrayLayout
from stokesfibers.io.reader import open_run
from stokesfibers.io.store import RunStore

LAYOUT = {
    "trajectory/time": ArrayLayout(lookup("trajectory", "time"), ()),
    "trajectory/position": ArrayLayout(lookup("trajectory", "position"), (2, 5, 3)),
    "trajectory/tension": ArrayLayout(lookup("trajectory", "tension"), (2, 5)),
    "trajectory/arclength": ArrayLayout(
        lookup("trajectory", "arclength"), fixed=np.arange(10.0).reshape(2, 5)
    ),
    "numerics/time": ArrayLayout(lookup("numerics", "time"), ()),
    "numerics/order": ArrayLayout(lookup("numerics", "order"), ()),
}
RECORDS = 20
CHUNK = "trajectory/position/c/2/0/0/0"  # records 8 to 11
GROWING = [name for name, array in LAYOUT.items() if array.grows]


def _records(start: int, stop: int) -> dict[str, np.ndarray]:
    index = np.arange(start, stop)
    return {
        name: np.multiply.outer(index + 1, np.ones(LAYOUT[name].shape_tail)).astype(
            LAYOUT[name].variable.dtype
        )
        for name in GROWING
    }


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A run of several chunks; the last ones are not full."""
    monkeypatch.setattr(layout_module, "_CHUNK_BYTES", 4 * 240)
    out = tmp_path / "run.zarr"
    with RunStore.create(out, LAYOUT, {}) as store:
        for start in range(0, RECORDS - 2, 3):
            store.append(_records(start, start + 3))
            store.commit({"code": "running", "time": 0.0})
        store.append(_records(18, RECORDS))
        store.commit({"code": "done", "time": 20.0})
    return out


def _flip(file: Path, bit: int = 0, place: int = 100) -> None:
    data = bytearray(file.read_bytes())
    data[place % len(data)] ^= 1 << bit
    file.write_bytes(data)


def test_a_whole_store_has_no_damage_and_is_exact(path):
    assert damages(path) == ()
    data = open_run(path)
    for name, values in _records(0, RECORDS).items():
        assert np.array_equal(data[name].to_numpy(), values)
    assert len(list((path / "trajectory/position/c").iterdir())) == 5


@pytest.mark.parametrize("place", [0, 700, 960, -1], ids=["first", "middle", "checksum", "last"])
@pytest.mark.parametrize("bit", [0, 7])
def test_a_flipped_bit_is_named_by_all_readers(place, bit, path):
    _flip(path / CHUNK, bit, place)
    (found,) = damages(path)
    assert (found.chunk, found.array) == (CHUNK, "trajectory/position")
    assert found.fault == "does not match its checksum"
    assert found.records == (8, 12)
    assert found.times == (9.0, 12.0)
    with pytest.raises(ValueError, match="checksum"):
        xarray.open_datatree(path, engine="zarr")["trajectory"]["position"].to_numpy()
    data = open_run(path)["trajectory"]
    with pytest.raises(StoreError, match=f"damaged chunk '{CHUNK}'.*records 8 to 11"):
        data["position"].to_numpy()
    # the rest can be read
    assert np.array_equal(data["position"][:8].to_numpy(), _records(0, 8)["trajectory/position"])
    assert np.isfinite(data["tension"].to_numpy()).all()
    with pytest.raises(StoreError, match=rf"{CHUNK} does not match.*t = 9 to 12"):
        RunStore.open(path, "a")
    assert not (path / ".lock").exists()


@pytest.mark.parametrize("size", [0, 1, 500, 963, 2000])
def test_another_length_is_named(size, path):
    file = path / CHUNK
    file.write_bytes((file.read_bytes() * 3)[:size])
    assert damages(path)[0].fault == f"has {size} bytes instead of 964"
    with pytest.raises(ValueError, match=r"checksum|buffer|reshape|size"):
        xarray.open_datatree(path, engine="zarr")["trajectory"]["position"].to_numpy()
    with pytest.raises(StoreError, match=f"{CHUNK}'.*has {size} bytes"):
        open_run(path)["trajectory"]["position"].to_numpy()


def test_every_chunk_is_watched(path):
    """One bit in each file that holds values, one at a time."""
    files = [f for f in path.rglob("c/**/*") if f.is_file() and f.parts[-3:-1] != ("space", "c")]
    assert len(files) > 10
    for file in files:
        before = file.read_bytes()
        _flip(file)
        assert [d.chunk for d in damages(path)] == [str(file.relative_to(path))]
        file.write_bytes(before)


def test_values_that_are_missing_read_as_nan_with_a_warning(path):
    (path / CHUNK).unlink()
    assert [d.fault for d in damages(path)] == [MISSING]
    plain = xarray.open_datatree(path, engine="zarr")["trajectory"]["position"].to_numpy()
    assert np.isnan(plain[8:12]).all()
    assert np.isfinite(plain[:8]).all()
    with pytest.warns(UserWarning, match=f"{CHUNK} is missing; records 8 to 11"):
        found = open_run(path)["trajectory"]["position"].to_numpy()
    assert np.isnan(found[8:12]).all()
    (path / "numerics/order/c/0").unlink()
    with pytest.warns(UserWarning, match="numerics/order/c/0 is missing"):
        assert (open_run(path)["numerics"]["order"].to_numpy() == -1).all()
    # who deleted it knows: the run goes on, also behind what is missing in the chunk to fill
    (path / "trajectory/position/c/4/0/0/0").unlink()
    with RunStore.open(path, "a") as store:
        store.append(_records(20, 26))
        store.commit({"code": "done", "time": 26.0})
    with pytest.warns(UserWarning, match="is missing"):
        found = open_run(path)["trajectory"]["position"].to_numpy()
    lost = np.isnan(found).any(axis=(1, 2, 3))
    assert np.flatnonzero(lost).tolist() == [8, 9, 10, 11, 16, 17, 18, 19]
    assert np.array_equal(found[20:], _records(20, 26)["trajectory/position"])


def test_a_chunk_that_is_to_be_gone_on_with_is_looked_at_first(path):
    """Even if it was changed after the store was opened."""
    with RunStore.open(path, "a") as store:
        _flip(path / "trajectory/tension/c/1/0/0")
        with pytest.raises(StoreError, match="tension/c/1/0/0', which does not match"):
            store.append(_records(20, 21))


def test_flipped_bits_in_the_marker_are_found(path):
    """In numbers that still parse, too; what is said of the run may be changed by hand."""
    file = path / marker.NAME
    whole = file.read_bytes()
    spot = whole.index(b'"shape": [20')
    for place in (spot + 11, whole.index(b'"float64"') + 6, len(whole) // 2):
        _flip(file, 0, place)
        for opener in (RunStore.open, open_run):
            with pytest.raises(StoreError):
                opener(path)
        file.write_bytes(whole)
    doc = json.loads(whole)
    doc["attributes"]["note"] = "shown at the seminar"
    file.write_text(json.dumps(doc, indent=2))
    assert open_run(path).attrs["note"] == "shown at the seminar"


def test_a_run_of_format_1_opens_and_goes_on(path, monkeypatch):
    """Without checksums its lengths are watched, and it stays as it is."""
    old = path.with_name("old.zarr")
    with monkeypatch.context() as patch:
        patch.setattr(layout_module, "Crc32cCodec", lambda: None)
        patch.setattr(
            layout_module, "_AS_IS", {**layout_module._AS_IS, "filters": None}, raising=True
        )
        patch.setattr(marker, "FORMAT_VERSION", 1)
        real = layout_module.zarr.Group.create_array

        def plain(self, *args, **options):
            return real(self, *args, **{**options, "compressors": None})

        patch.setattr(layout_module.zarr.Group, "create_array", plain)
        with RunStore.create(old, LAYOUT, {}) as store:
            store.append(_records(0, 6))
            store.commit({"code": "running", "time": 6.0})
    assert not records.RecordArray.from_doc(
        "trajectory/position", marker.read(old)[0]["trajectory/position"]
    ).sealed
    with RunStore.open(old, "a") as store:
        store.append(_records(6, 10))
        store.commit({"code": "done", "time": 10.0})
    data = open_run(old)
    for name, values in _records(0, 10).items():
        assert np.array_equal(data[name].to_numpy(), values)
    (old / "trajectory/position/c/1/0/0/0").write_bytes(b"0" * 17)
    assert damages(old)[0].fault == "has 17 bytes instead of 960"


def test_a_tree_can_be_sent_to_another_process(path):
    again = pickle.loads(pickle.dumps(open_run(path)))
    assert np.array_equal(
        again["trajectory"]["tension"].to_numpy(), _records(0, RECORDS)["trajectory/tension"]
    )
    _flip(path / "trajectory/tension/c/0/0/0")
    with pytest.raises(StoreError, match="tension/c/0/0/0"):
        pickle.loads(pickle.dumps(open_run(path)))["trajectory"]["tension"].to_numpy()


def test_a_folder_that_cannot_be_written_to_is_still_read(path, tmp_path):
    copy = tmp_path / "read_only.zarr"
    shutil.copytree(path, copy)
    for place in (copy, *copy.rglob("*")):
        place.chmod(0o555 if place.is_dir() else 0o444)
    try:
        assert damages(copy) == ()
        assert open_run(copy)["trajectory"]["position"].to_numpy().shape[0] == RECORDS
    finally:
        for place in (copy, *copy.rglob("*")):
            place.chmod(0o755)
