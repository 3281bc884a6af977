"""Sweeps: many runs that differ in a few parameters, and one dataset of what they give.

A sweep lives in a folder. What is finished is kept, what was interrupted goes on from its
checkpoints, a case that fails is noted with its reason and stops no other.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import xarray as xr

from stokesfibers.core.errors import InputError, StoreError
from stokesfibers.io.atomic import disk_errors, write_atomic
from stokesfibers.run.interrupt import ask_to_stop, stop_on_signal
from stokesfibers.study.sweep_dataset import dataset, write_dataset
from stokesfibers.study.sweep_folder import PLAN, State, SweepFolder, end_session, opened, session
from stokesfibers.study.sweep_job import Job
from stokesfibers.study.sweep_plan import Plan, Source, SweepCase, read_plan
from stokesfibers.study.sweep_tally import Tally, tally
from stokesfibers.study.sweep_workers import outcomes, workers_of

_LOOK_SECONDS = 0.5

Watch = Callable[[Tally, SweepCase | None], None]
"""Told how far the sweep is, and which case has just ended, if one has."""


@dataclass(frozen=True)
class Change:
    """What of a sweep is in its folder already.

    Attributes
    ----------
    kept
        Cases that ended before.
    begun
        Cases that go on from where they were.
    new
        Cases that are not there.
    removed
        Names of cases of the folder's last sweep that are not asked for any more; their runs stay.
    """

    kept: int
    begun: int
    new: int
    removed: tuple[str, ...]


def sweep(
    source: Source | Plan,
    out: str | PathLike[str],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    settings: Iterable[str] = (),
    allow_python: bool = False,
    retry: bool = False,
    watch: Watch | None = None,
) -> xr.Dataset:
    """Run all cases of a sweep and return their dataset, which is also in ``OUT/sweep.zarr``.

    Calling it again goes on where it was. With several workers, a script must do this below
    ``if __name__ == "__main__":``, since each worker imports it.

    Parameters
    ----------
    source
        TOML file, the same tables, or a plan that was read before.
    out
        Folder of the sweep; made if it is not there.
    workers
        Processes of this machine, by default one per core; 1 is this process.
    scheduler
        Address of a running Dask scheduler, used instead; its workers must see `out`.
    settings
        Changes of the base case, ``"table.key=value"``.
    allow_python
        Whether flows and loads from users' Python files may run.
    retry
        Whether cases that failed for good are tried anew.
    watch
        Called now and then, and when a case ends. If it raises, the sweep stops as on Ctrl-C first.

    Returns
    -------
    xarray.Dataset
        Swept parameters as coordinates; ``status`` of each case, NaN where it is not "done". The
        attribute ``status`` is "interrupted" if somebody asked the sweep to stop.

    Raises
    ------
    InputError, StoreError, MissingExtraError
        If something given cannot be used; no case has run then.
    """
    plan = source
    if not isinstance(plan, Plan):
        plan = read_plan(plan, settings, allow_python=allow_python)
    where = _Where(workers_of(workers, len(plan.cases)), scheduler, allow_python, retry)
    with opened(Path(out)) as folder:
        _write_plan(folder, plan)
        folder.adopt(plan)
        told = _Told(folder, plan, watch)
        _run(folder, plan, told, where)
        data = dataset(folder, plan, told.known)
        write_dataset(data, folder.path)
        if told.error is not None:
            raise told.error
        return data


@dataclass(frozen=True)
class _Where:
    """On how many processes or which cluster cases run, and what they may do."""

    workers: int
    scheduler: str | None
    allow_python: bool
    retry: bool


def _run(folder: SweepFolder, plan: Plan, told: _Told, where: _Where) -> None:
    """Run the cases that have not ended, until all have or somebody asks to stop."""
    cases = {case.key: case for case in plan.cases}.values()
    todo = [case for case in cases if where.retry or not _ended(folder.state(case))]
    share = tally(folder, plan, active=False).share
    facts = {"share": share, "workers": where.workers, "scheduler": where.scheduler}
    with stop_on_signal() as wish, session(folder, facts) as token:
        base, python = Path(plan.folder), where.allow_python
        jobs = [Job(case, folder, base, token, python, again=where.retry) for case in todo]
        coming = outcomes(
            jobs, workers=where.workers, scheduler=where.scheduler, tick=told.now_and_then
        )
        with closing(coming):
            for ended in coming:
                if ended is None:
                    told.now_and_then()
                else:
                    told.ended(*ended)
                if wish.stop or (ended is not None and ended[1].code == "interrupted"):
                    end_session(folder, token)


def collect(out: str | PathLike[str]) -> xr.Dataset:
    """Make the dataset of a sweep anew from its runs, write it to ``OUT/sweep.zarr``, return it.

    Raises
    ------
    StoreError
        If `out` is not the folder of a sweep, or cannot be written.
    """
    plan = SweepFolder(Path(out)).plan()  # errors name the folder as it was given
    folder = SweepFolder(Path(out).resolve())
    data = dataset(folder, plan)
    write_dataset(data, folder.path)
    return data


def changes(out: str | PathLike[str], plan: Plan) -> Change:
    """Return what of `plan` is in the folder already, and what there is not in the plan."""
    folder = SweepFolder(Path(out).resolve())
    held = folder.stores()
    codes = [folder.state(case, store=held.get(case.key)).code for case in plan.cases]
    try:
        before: Sequence[SweepCase] = folder.plan().cases
    except StoreError:
        before = ()
    keys = {case.key for case in plan.cases}
    return Change(
        kept=sum(code in ("done", "failed") for code in codes),
        begun=sum(code in ("running", "interrupted") for code in codes),
        new=codes.count("waiting"),
        removed=tuple(case.name for case in before if case.key not in keys),
    )


def _ended(state: State) -> bool:
    return state.code == "done" or (state.code == "failed" and state.final)


def _write_plan(folder: SweepFolder, plan: Plan) -> None:
    try:
        text = json.dumps(plan.to_table(), indent=1)
    except TypeError as error:
        raise InputError("sweep", "values that JSON can hold", f"others ({error})") from None
    with disk_errors(folder.path):
        write_atomic(folder.path / PLAN, text.encode())


class _Told:
    """Tells who watches, not too often; what has ended is looked up once."""

    def __init__(self, folder: SweepFolder, plan: Plan, watch: Watch | None) -> None:
        self._folder, self._plan, self._watch, self._last = folder, plan, watch, 0.0
        self.known: dict[str, State] = {}
        self.error: Exception | None = None

    def now_and_then(self) -> None:
        if time.monotonic() - self._last >= _LOOK_SECONDS:
            self._tell(None)

    def ended(self, job: Job, state: State) -> None:
        if state.code in ("done", "failed"):
            self.known[job.case.key] = state
            self._tell(job.case)

    def _tell(self, case: SweepCase | None) -> None:
        if self._watch is None:
            return
        found = tally(self._folder, self._plan, active=True, known=self.known)
        try:
            if self.error is None:
                self._watch(found, case)
        except Exception as error:
            # Not a fault of the case that runs now: that one is stored, then all stop.
            error.add_note("The sweep was stopped; the same call goes on from there.")
            self.error = error
        if self.error is not None:
            ask_to_stop()
        self._last = time.monotonic()
