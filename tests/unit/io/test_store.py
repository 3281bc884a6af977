"""The run store: what is written comes back, bit by bit; what must be refused is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray

from stokesfibers.core.errors import StoreError
from stokesfibers.core.variables import Variable, lookup
from stokesfibers.io import layout as layout_module
from stokesfibers.io.checkpoint import Checkpoint
from stokesfibers.io.layout import ArrayLayout
from stokesfibers.io.reader import open_run
from stokesfibers.io.store import RunStore

RUNNING = {"code": "running", "time": 0.0}
AWKWARD = np.array([-0.0, 5e-324, np.nan, -np.inf, 1 / 3, np.pi * 1e300])


def make_layout() -> dict[str, ArrayLayout]:
    spent = Variable("spent", "numerics", ("step", "stage"), "s", "t_w", "time by stage")
    arrays = [
        ArrayLayout(lookup("trajectory", "time")),
        ArrayLayout(lookup("trajectory", "position"), (2, 4, 3)),
        ArrayLayout(lookup("trajectory", "arclength"), fixed=np.linspace(0, 1, 8).reshape(2, 4)),
        ArrayLayout(lookup("observables", "time")),
        ArrayLayout(lookup("observables", "extra_stress"), (3, 3)),
        ArrayLayout(lookup("numerics", "order")),
        ArrayLayout(spent, (2,)),
    ]
    return {f"{a.variable.group}/{a.variable.name}": a for a in arrays}


def create(path: Path, **options: bool) -> RunStore:
    labels = {"stage": ("tension", "positions")}
    return RunStore.create(path, make_layout(), {"seed": 7}, labels=labels, **options)


def records(count: int, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    made: dict[str, np.ndarray] = {}
    for key, array in make_layout().items():
        if array.grows:
            values = rng.standard_normal((count, *array.shape_tail))
            made[key] = rng.integers(-9, 9, count) if key == "numerics/order" else values
    return made


def checkpoint(seed: int) -> Checkpoint:
    rng = np.random.default_rng(seed)
    arrays = {"x": rng.standard_normal((2, 4, 3)), "n": np.int64(seed), "none": np.zeros((0, 3))}
    return Checkpoint({k: np.asarray(v) for k, v in arrays.items()}, {"dt": 0.1 * seed, "k": "a"})


def assert_same_bits(got: np.ndarray, expected: np.ndarray) -> None:
    assert got.shape == expected.shape
    assert got.dtype == expected.dtype
    assert got.tobytes() == expected.tobytes()


def assert_records(path: Path, expected: dict[str, np.ndarray]) -> None:
    with xarray.open_datatree(path) as tree:
        for key, values in expected.items():
            assert_same_bits(tree[key].values, values)


@pytest.mark.parametrize("chunk_bytes", [1, 500, 128 * 1024])
def test_round_trip_is_exact(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, chunk_bytes: int
) -> None:
    monkeypatch.setattr(layout_module, "_CHUNK_BYTES", chunk_bytes)
    path = tmp_path / "run.zarr"
    parts = [records(n, seed=n) for n in (3, 0, 1, 11, 7)]
    parts[2]["trajectory/position"].flat[: AWKWARD.size] = AWKWARD
    parts[3]["observables/extra_stress"][...] = -0.0
    with create(path) as store:
        for part in parts:
            store.append(part)
            store.commit(RUNNING)
    expected = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    assert_records(path, expected)


def test_tree_is_labelled(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with create(path) as store:
        store.append(records(2))
        store.commit({"code": "done", "time": 1.5}, checkpoint(1))
    tree = open_run(path)
    position = tree["trajectory/position"]
    assert position.dims == ("time", "fiber", "node", "space")
    assert list(position.coords["space"].values) == ["x", "y", "z"]
    np.testing.assert_array_equal(position.coords["time"], records(2)["trajectory/time"])
    assert position.attrs == lookup("trajectory", "position").attrs()
    assert list(tree["observables/extra_stress"].coords["j"].values) == ["x", "y", "z"]
    assert list(tree["numerics/spent"].coords["stage"].values) == ["tension", "positions"]
    np.testing.assert_array_equal(
        tree["trajectory/arclength"], np.linspace(0, 1, 8).reshape(2, 4), strict=True
    )
    assert tree.attrs["seed"] == 7
    assert tree.attrs["status"] == {"code": "done", "time": 1.5}
    np.testing.assert_array_equal(tree["checkpoint/x"][0], checkpoint(1).arrays["x"])


def test_groups_open_by_themselves_after_close(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with create(path) as store:
        store.append(records(5))
        store.commit(RUNNING)
    dataset = xarray.open_zarr(path / "trajectory")
    np.testing.assert_array_equal(dataset["position"], records(5)["trajectory/position"])


def test_fixed_arrays_are_exact(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    for values in (np.full((2, 4), -0.0), np.resize(AWKWARD, (2, 4))):
        array = ArrayLayout(lookup("trajectory", "arclength"), fixed=values)
        layout = {**make_layout(), "trajectory/arclength": array}
        RunStore.create(path, layout, {}, labels={"stage": "ab"}, overwrite=True).close()
        assert_records(path, {"trajectory/arclength": values})


def test_only_committed_records_count(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    store = create(path)
    assert_records(path, records(0))
    store.append(records(4))
    store.commit({"code": "running", "time": 2.0})
    store.append(records(3, seed=1))
    assert set(store.lengths.values()) == {4}
    store.close()
    assert_records(path, records(4))
    again = RunStore.open(path)
    assert again.lengths == {"trajectory": 4, "observables": 4, "numerics": 4}
    assert again.status == {"code": "running", "time": 2.0}
    assert again.attributes == {"seed": 7}
    assert again.checkpoint() is None
    with pytest.raises(StoreError, match="read-only"):
        again.append(records(1))
    with pytest.raises(StoreError, match="closed"):
        store.commit(RUNNING)


def test_groups_grow_apart(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    steps = {k: v for k, v in records(6).items() if k.startswith("numerics/")}
    with create(path) as store:
        store.append(steps)
        store.commit(RUNNING)
        assert store.lengths == {"trajectory": 0, "observables": 0, "numerics": 6}
    assert_records(path, {**records(0), **steps})


def test_checkpoints_take_turns(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with create(path) as store:
        for seed in range(1, 5):
            store.append(records(2))
            store.commit(RUNNING, checkpoint(seed))
            store.append(records(1))
            store.commit(RUNNING)
            got = RunStore.open(path).checkpoint()
            assert got is not None
            assert got.arrays.keys() == checkpoint(seed).arrays.keys()
            for name, values in checkpoint(seed).arrays.items():
                assert_same_bits(got.arrays[name], values)
            assert got.meta == checkpoint(seed).meta
            assert set(got.lengths.values()) == {3 * seed - 1}
        with pytest.raises(ValueError, match=r"\['x'\] changed"):
            store.commit(RUNNING, Checkpoint({**got.arrays, "x": np.zeros(3)}))


def test_reader_of_a_live_run_gets_a_whole_checkpoint(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with create(path) as store:
        store.commit(RUNNING, checkpoint(1))
        reader = RunStore.open(path)
        store.commit(RUNNING, checkpoint(2))
        store.commit(RUNNING, checkpoint(3))
        got = reader.checkpoint()
    assert got is not None
    assert got.meta == checkpoint(3).meta
    assert_same_bits(got.arrays["x"], checkpoint(3).arrays["x"])


def test_truncate_and_append_again(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with create(path) as store:
        store.append(records(5))
        store.commit(RUNNING, checkpoint(1))
        store.append(records(9, seed=1))
        store.commit(RUNNING)
    with RunStore.open(path, "a") as store:
        saved = store.checkpoint()
        assert saved is not None
        with pytest.raises(ValueError, match="cannot be cut to 4"):
            store.truncate({"numerics": 4})
        with pytest.raises(ValueError, match="cannot be cut to 15"):
            store.truncate({"numerics": 15})
        store.truncate(saved.lengths)
        assert store.lengths == saved.lengths
        assert RunStore.open(path).status == store.status == RUNNING
        store.truncate(saved.lengths, {"code": "back"})
        assert RunStore.open(path).status == store.status == {"code": "back"}
        assert_records(path, records(5))
        store.append(records(2, seed=3))
        assert_records(path, records(5))
        store.set_attributes({"until": 9.0})
        store.commit(RUNNING, checkpoint(2))
    old, new = records(5), records(2, seed=3)
    assert_records(path, {key: np.concatenate([old[key], new[key]]) for key in old})
    assert RunStore.open(path).attributes == {"seed": 7, "until": 9.0}


def test_wrong_records_are_refused_and_nothing_changes(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with create(path) as store:
        good = records(2)
        missing = {k: v for k, v in good.items() if k != "trajectory/time"}
        uneven = {**good, "trajectory/time": np.zeros(3)}
        shape = {**good, "trajectory/position": np.zeros((2, 2, 4, 2))}
        lossy = {**good, "numerics/order": np.array([1.5, 2.5])}
        unknown = {**good, "trajectory/arclength": np.zeros((2, 4))}
        for bad, match in [
            (missing, "lack.*trajectory/time"),
            (uneven, "differ in number"),
            (shape, "expected shape"),
            (lossy, "cannot store float64"),
            (unknown, "not arrays that grow"),
        ]:
            with pytest.raises(ValueError, match=match):
                store.append(bad)
        with pytest.raises(ValueError, match="finite JSON"):
            store.commit(RUNNING, Checkpoint({}, {"a": float("nan")}))
        with pytest.raises(ValueError, match="float32"):
            store.commit(RUNNING, Checkpoint({"a": np.zeros(2, np.float32)}))
        store.append(good)
        store.commit({"code": "failed", "time": float("nan")})
        assert store.status == {"code": "failed", "time": "nan"}
    assert_records(path, good)


def test_contradictory_layouts_are_refused(tmp_path: Path) -> None:
    base = make_layout()
    stress = lookup("observables", "extra_stress")
    seconds = Variable("w", "numerics", ("step",), "seconds", "w", "w")
    for key, array, match in [
        ("observables/stress", ArrayLayout(stress, (3, 3)), "cannot hold"),
        ("observables/extra_stress", ArrayLayout(stress, (3,)), "does not fit axes"),
        ("observables/extra_stress", ArrayLayout(stress, (2, 3)), "labels"),
        ("trajectory/tension", ArrayLayout(lookup("trajectory", "tension"), (2, 5)), "'node'"),
        ("trajectory/arclength", ArrayLayout(lookup("trajectory", "arclength")), "must be given"),
        ("numerics/w", ArrayLayout(seconds), "unit 'seconds'"),
    ]:
        with pytest.raises(ValueError, match=match):
            RunStore.create(tmp_path / "run.zarr", {**base, key: array}, {})
    with pytest.raises(ValueError, match="status"):
        RunStore.create(tmp_path / "run.zarr", base, {"status": 1})
    assert list(tmp_path.iterdir()) == []


def test_overwriting_needs_permission_and_a_run(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with create(path) as store:
        store.append(records(3))
        store.commit(RUNNING)
    with pytest.raises(StoreError, match="--overwrite"):
        create(path)
    assert_records(path, records(3))
    with create(path, overwrite=True) as store:
        assert set(store.lengths.values()) == {0}
        with pytest.raises(StoreError, match=r"in use by process \d+"):
            create(path, overwrite=True)
        store.append(records(1))
        store.commit(RUNNING)
    assert_records(path, records(1))
    assert [p.name for p in tmp_path.iterdir()] == ["run.zarr"]
    assert not list(path.glob(".*"))


def test_foreign_things_are_never_overwritten(tmp_path: Path) -> None:
    folder, file, empty, foreign = (tmp_path / n for n in ("folder", "file", "empty", "foreign"))
    folder.mkdir()
    (folder / "thesis.tex").write_text("years of work")
    file.write_text("text")
    empty.mkdir()
    xarray.Dataset({"a": ("x", [1.0])}).to_zarr(foreign, zarr_format=3, consolidated=False)
    before = sorted(tmp_path.rglob("*"))
    for path in (folder, file, empty, foreign):
        with pytest.raises(StoreError, match="Nothing else is ever overwritten"):
            create(path, overwrite=True)
    assert sorted(tmp_path.rglob("*")) == before
    with pytest.raises(StoreError, match="missing folder"):
        create(tmp_path / "no" / "run.zarr")
    for path, match in [
        (tmp_path / "nowhere", "nothing there"),
        (file, "not a folder"),
        (folder, "not a Zarr store"),
        (foreign, "another kind"),
    ]:
        for opener in (RunStore.open, open_run):
            with pytest.raises(StoreError, match=match):
                opener(path)


def test_damaged_markers_are_named(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    create(path).close()
    file = path / "zarr.json"
    whole = file.read_bytes()
    doc = json.loads(whole)
    shapes = json.loads(whole)
    shapes["consolidated_metadata"]["metadata"]["trajectory/time"]["shape"] = [3]
    for text, match in [
        (whole[: len(whole) // 2], "damaged"),
        (b"", "damaged"),
        (b"[]", "damaged"),
        (b"\xff\xfe", "damaged"),
        (json.dumps({**doc, "consolidated_metadata": None}).encode(), "damaged"),
        (json.dumps(shapes).encode(), "damaged.*another number"),
        (
            json.dumps({**doc, "attributes": {**doc["attributes"], "format_version": 3}}).encode(),
            "format version 2, got 3",
        ),
    ]:
        file.write_bytes(text)
        for opener in (RunStore.open, lambda p: RunStore.open(p, "a"), open_run):
            with pytest.raises(StoreError, match=match):
                opener(path)
    file.write_bytes(whole)
    RunStore.open(path, "a").close()


def test_flipped_bit_in_the_checkpoint_is_detected(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    with create(path) as store:
        store.append(records(2))
        store.commit(RUNNING, checkpoint(1))
        store.commit(RUNNING, checkpoint(2))
    unused, used = (path / f"checkpoint/x/c/{slot}/0/0/0" for slot in (0, 1))
    for file in (unused, used):
        data = bytearray(file.read_bytes())
        data[37] ^= 1
        file.write_bytes(data)
        if file is unused:
            RunStore.open(path, "a").close()
    with pytest.raises(StoreError, match="checksum of slot 1"):
        RunStore.open(path, "a")
    with pytest.raises(StoreError, match="checksum of slot 1"):
        RunStore.open(path).checkpoint()
    used.write_bytes(used.read_bytes()[:-1])
    with pytest.raises(StoreError, match="array 'x' cannot be read"):
        RunStore.open(path, "a")
    used.unlink()
    with pytest.raises(StoreError, match="array 'x' cannot be read"):
        RunStore.open(path).checkpoint()
    assert_records(path, records(2))
