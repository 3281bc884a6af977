"""What commands about a sweep's folder share: its dataset as it is now, and values to stay at."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def stay_at(text: str) -> tuple[str, str]:
    """Return name and value of ``NAME=VALUE``."""
    from stokesfibers.core.errors import InputError

    name, equal, value = text.partition("=")
    if not (name and equal and value):
        raise InputError("at", "NAME=VALUE", repr(text))
    return name.strip(), value.strip()


def held_dataset(folder: Path) -> xr.Dataset:
    """Return the sweep's dataset: the stored one, or while it runs what there is."""
    import xarray as xr

    from stokesfibers.study.sweep_dataset import dataset
    from stokesfibers.study.sweep_folder import DATASET, RUNS, SweepFolder

    plan = SweepFolder(folder).plan()  # errors name the folder as it was typed
    held = SweepFolder(folder.resolve())
    if (folder / DATASET).is_dir() and not held.active():
        data = xr.open_zarr(folder / DATASET).load()
        runs = [f"{RUNS}/{held.store(case).name}" for case in plan.cases]
        # after a kill it is still that of the sweep before
        if data.attrs["status"] == "done" and data["run"].to_numpy().ravel().tolist() == runs:
            return data
    return dataset(held, plan)
