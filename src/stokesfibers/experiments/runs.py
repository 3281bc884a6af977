"""Runs that several figures share: each is computed once, kept as a store, and used again."""

from __future__ import annotations

import json
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import StokesFibersError
from stokesfibers.core.tables import Table, choose, to_table
from stokesfibers.core.version import __version__
from stokesfibers.experiments.base import Progress, Settings
from stokesfibers.experiments.tiers import BucklingRun
from stokesfibers.fiber.initial import AbstractInitial
from stokesfibers.fiber.initials import INITIALS
from stokesfibers.io.reader import open_run
from stokesfibers.io.store import RunStore
from stokesfibers.observe.observables import fiber_stress_direct
from stokesfibers.observe.snapshot import Snapshot
from stokesfibers.problem.problem import Problem
from stokesfibers.problem.tables import problem_to_tables
from stokesfibers.run.advance import Moment, Watch
from stokesfibers.run.schedule import Schedule
from stokesfibers.run.simulate import resume, simulate
from stokesfibers.stepping.paper import PaperStepper

_TOLD_PER_RUN = 200
_POLL_SECONDS = 1.0


class Run(Protocol):
    """A run that experiments share: what is solved from where, and what is recorded."""

    @property
    def name(self) -> str:
        """Name of the run's store, without its suffix."""
        ...

    @property
    def problem(self) -> Problem:
        """The problem to solve."""
        ...

    @property
    def initial(self) -> AbstractInitial:
        """The shapes at time 0."""
        ...

    @property
    def until(self) -> float:
        """Time to stop."""
        ...

    @property
    def schedule(self) -> Schedule:
        """What is recorded when."""
        ...


def finished(runs: Sequence[Run], settings: Settings) -> list[xr.DataTree]:
    """Return the given runs, in order, as trees; compute or complete those that are not there.

    Parameters
    ----------
    runs
        What to run.
    settings
        Where runs are kept, how many processes may work, and who is told.

    Raises
    ------
    StokesFibersError
        If a run failed.
    KeyboardInterrupt
        If somebody asked a run to stop; it continues when asked for again.
    """
    trees = attempted(runs, settings)
    for run, tree in zip(runs, trees, strict=True):
        if status(tree)["code"] != "done":
            raise StokesFibersError(f"run {run.name} failed: {status(tree)['explanation']}")
    return trees


def attempted(runs: Sequence[Run], settings: Settings) -> list[xr.DataTree]:
    """As `finished`, but a run that blew up is returned with what it has."""
    folder = settings.folder / "runs"
    folder.mkdir(parents=True, exist_ok=True)
    missing = [r for r in dict.fromkeys(runs) if not _is_there(r, folder)]
    if settings.workers > 1 and len(missing) > 1:
        _compute_in_pool(missing, folder, settings)
    else:
        for number, run in enumerate(missing):
            _compute(run, folder, _watch(run, settings.progress, (number, len(missing))))
    trees = [open_run(_store(run, folder)) for run in runs]
    if any(status(tree)["code"] in ("running", "interrupted") for tree in trees):
        raise KeyboardInterrupt
    return trees


def status(tree: xr.DataTree) -> dict[str, Any]:
    """Return the status of a stored run."""
    held = tree.attrs["status"]
    return json.loads(held) if isinstance(held, str) else dict(held)


def frames(tree: xr.DataTree, times: Array) -> xr.Dataset:
    """Return the stored trajectory at `times`, each of which must have been recorded."""
    trajectory = tree["trajectory"].to_dataset()
    stored = trajectory["time"].to_numpy()
    picked = [int(np.argmin(np.abs(stored - t))) for t in np.atleast_1d(times)]
    worst = float(np.max(np.abs(stored[picked] - times)))
    if worst > 1e-6:
        raise StokesFibersError(f"times {times} were not recorded; nearest is {worst:g} off")
    return trajectory.isel(time=picked).load()


def series(tree: xr.DataTree, name: str) -> tuple[Array, Array]:
    """Return times and values of an observable; that of the only fiber, if per fiber."""
    observables = tree["observables"]
    values = observables[name].to_numpy()
    has_fiber = "fiber" in observables[name].dims
    return observables["time"].to_numpy(), values[:, 0] if has_fiber else values


def direct_normal_stress_difference(tree: xr.DataTree, run: BucklingRun) -> tuple[Array, Array]:
    """Return stored times and N_1 from int f x ds with f as printed in (9), (48)."""
    fibers = PaperStepper(run.problem).fibers
    trajectory = tree["trajectory"].to_dataset().load()
    time = trajectory["time"].to_numpy()
    values = np.empty(len(time))
    for k, (x, tension) in enumerate(
        zip(trajectory["position"].to_numpy(), trajectory["tension"].to_numpy(), strict=True)
    ):
        stress = fiber_stress_direct(Snapshot.take(time[k], fibers, x, tension))[0]
        values[k] = stress[0, 0] - stress[1, 1]
    return time, values


def bending_trace_over_energy(tree: xr.DataTree, run: BucklingRun) -> float:
    """Return the trace of the bending part of (48) as printed over the elastic energy (49).

    At the stored time of largest energy; integrating by parts gives 2 for the exact fiber.
    """
    fiber = PaperStepper(run.problem).fibers[0]
    best = (0.0, 0.0)
    for x in tree["trajectory"]["position"].to_numpy()[:, 0]:
        shape = fiber.shape(x.T)
        energy = 0.5 * float(np.sum(shape.xss**2, axis=0) @ fiber.grid.weights)
        trace = float(np.sum(shape.xssss * shape.x, axis=0) @ fiber.grid.weights)
        best = max(best, (energy, trace))
    return best[1] / best[0]


def _store(run: Run, folder: Path) -> Path:
    return folder / f"{run.name}.zarr"


def _tables(run: Run) -> Table:
    return {**problem_to_tables(run.problem), "initial": to_table(run.initial)}


def _is_same(run: Run, folder: Path) -> bool:
    """Return whether the store that is there is of this very case and of this version."""
    with RunStore.open(_store(run, folder)) as store:
        case = json.loads(store.attributes["case"])
        version = json.loads(store.attributes["provenance"])["versions"]["stokesfibers"]
    wanted = _tables(run)
    wanted["stepping"]["until"] = run.until
    wanted["record"] = to_table(run.schedule)
    if run.schedule.points is None:  # the engine's own choice, which the run has filled in
        case["record"].pop("points", None)
    if case["initial"].get("kind") in INITIALS:  # keys that came later have their defaults
        case["initial"] = to_table(choose(INITIALS, case["initial"], "initial"))
    return version == __version__ and case == json.loads(json.dumps(wanted))


def _is_there(run: Run, folder: Path) -> bool:
    """Return whether the run has ended by itself, well or not."""
    if not _store(run, folder).exists() or not _is_same(run, folder):
        return False
    with RunStore.open(_store(run, folder)) as store:
        return store.status["code"] in ("done", "failed")


def _compute(
    run: Run, folder: Path, watch: Watch | None = None, *, threads: int | None = None
) -> None:
    """Run, or continue what was stopped or killed; anything else of that name is replaced."""
    path = _store(run, folder)
    if path.exists() and _is_same(run, folder):
        result = resume(path, watch=watch, threads=threads)
    else:
        result = simulate(
            run.problem,
            run.initial.curves(run.problem.fibers, run.problem.domain.lengths),
            until=run.until,
            record=run.schedule,
            out=path,
            overwrite=True,
            case=_tables(run),
            watch=watch,
            threads=threads,
        )
    if result.status.code == "interrupted":  # whoever stops one run stops them all
        raise KeyboardInterrupt


def _watch(run: Run, progress: Progress | None, place: tuple[int, int]) -> Watch | None:
    """Return a watcher that tells `progress` the share done of all runs, not at every step."""
    if progress is None:
        return None
    number, count = place
    last = -1

    def watch(moment: Moment) -> None:
        nonlocal last
        now = int(_TOLD_PER_RUN * moment.time / moment.until)
        if now != last:
            last = now
            progress(run.name, (number + moment.time / moment.until) / count)

    return watch


def _compute_in_pool(missing: Sequence[Run], folder: Path, settings: Settings) -> None:
    """Compute runs in several processes, the longest first; how far they are, their stores say."""
    longest_first = sorted(missing, key=lambda run: -run.problem.engine.samples)
    with ProcessPoolExecutor(settings.workers, mp_context=get_context("spawn")) as pool:
        futures = {pool.submit(_compute, run, folder, threads=1): run for run in longest_first}
        try:
            _wait(futures, folder, settings.progress)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _wait(futures: dict[Future[None], Run], folder: Path, progress: Progress | None) -> None:
    pending = set(futures)
    while pending:
        done, pending = wait(pending, timeout=_POLL_SECONDS)
        for future in done:
            future.result()
        if progress is not None:
            shares = [_share_done(run, folder) for run in futures.values()]
            progress(f"{len(futures)} runs", sum(shares) / len(shares))


def _share_done(run: Run, folder: Path) -> float:
    path = _store(run, folder)
    if not path.exists():
        return 0.0
    with RunStore.open(path) as store:
        return min(float(store.status["time"]) / run.until, 1.0)


__all__ = [
    "Run",
    "attempted",
    "bending_trace_over_energy",
    "direct_normal_stress_difference",
    "finished",
    "frames",
    "series",
    "status",
]
