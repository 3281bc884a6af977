"""One case of a sweep, run where a worker is: started, resumed or found done; it never raises."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from stokesfibers.config.case import Case
from stokesfibers.core.errors import InputError, StoreError
from stokesfibers.core.status import Status
from stokesfibers.io import lock
from stokesfibers.run.advance import Moment
from stokesfibers.run.interrupt import ask_to_stop
from stokesfibers.run.simulate import resume, simulate
from stokesfibers.study.sweep_folder import State, SweepFolder, is_token
from stokesfibers.study.sweep_plan import SweepCase, key_of, load_case

_LOOK_SECONDS = 0.25
_WAIT_SECONDS = 60.0
Tick = Callable[[], None]


@dataclass(frozen=True)
class Job:
    """A case and what a worker has to know about its sweep.

    Attributes
    ----------
    case
        The case.
    folder
        The sweep's folder; workers on other machines must see it at the same path.
    base
        Where relative paths of the case start.
    token
        Of the session: the run stops when the session ends.
    allow_python
        Whether the case may run users' Python files.
    again
        Whether a case that failed for good starts anew.
    """

    case: SweepCase
    folder: SweepFolder
    base: Path
    token: str
    allow_python: bool = False
    again: bool = False


def run_job(job: Job, tick: Tick | None = None) -> State:
    """Run a case to its end, or until its session ends; return how it stands.

    A failure is noted in the sweep's folder. `tick` is called now and then during the run.
    """
    if not is_token(job.folder, job.token):
        return job.folder.state(job.case)
    try:
        before = job.folder.state(job.case)
        if before.code == "done" or (before.code == "failed" and before.final and not job.again):
            return before
        _wait_for_last_writer(job)
        case = _as_planned(job)
        if isinstance(case, str):  # what has changed can be put back
            return _failed(job, case, final=False)
        job.folder.write_note(job.case, None)
        status = _run(job, case, anew=before.code == "failed" and before.final, tick=tick)
    except StoreError as error:
        return _failed(job, str(error), final=False)
    except InputError as error:
        return _failed(job, str(error), final=True)
    except MemoryError:
        return _failed(job, "Not enough memory on the worker", final=False)
    except OSError as error:
        return _failed(job, f"{error.filename or 'system'}: {error.strerror or error}", final=False)
    except Exception as error:
        what = traceback.format_exception_only(error)[-1].strip()
        last = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(last.filename).name}, line {last.lineno}"
        told = f"This is a fault of stokesfibers, please report it: {what} ({place})"
        return _failed(job, told, final=False)
    found = job.folder.state(job.case)
    if status.code == "failed" and found.code != "failed":  # its store can no longer be written
        return _failed(job, str(status), final=False)
    return found


def _as_planned(job: Job) -> Case | str:
    """Return the case as it was planned; if its files are others by now, what to say of that."""
    try:
        case = load_case(job.case, job.base, allow_python=job.allow_python)
    except InputError as error:  # all cases could be loaded when the sweep was planned
        return f"{error} It has changed since the sweep was planned: put it back, or start again"
    if key_of(case) == job.case.key:
        return case
    return "A file it uses has changed since the sweep was planned: put it back, or start again"


def _run(job: Job, case: Case, *, anew: bool, tick: Tick | None) -> Status:
    """Start or resume the run of a case."""
    store, watch = job.folder.store(job.case), _Watch(job, tick)
    if store.exists() and not anew:
        # Its files may lie elsewhere than when it began, so the problem is not the stored one.
        result = resume(store, problem=case.problem, watch=watch, threads=1)
    else:
        result = simulate(
            case.problem,
            case.curves(),
            until=case.until,
            record=case.record,
            out=store,
            overwrite=True,
            case=case.tables(),
            watch=watch,
            stop=case.stop,
            threads=1,
        )
    return result.status


class _Watch:
    """Looks now and then whether the session goes on, and asks the run to stop if not."""

    def __init__(self, job: Job, tick: Tick | None) -> None:
        self._job, self._tick, self._last = job, tick, time.monotonic()

    def __call__(self, moment: Moment) -> None:  # noqa: ARG002
        now = time.monotonic()
        if now - self._last < _LOOK_SECONDS:
            return
        self._last = now
        if not is_token(self._job.folder, self._job.token):
            ask_to_stop()
        if self._tick is not None:
            self._tick()


def _wait_for_last_writer(job: Job) -> None:
    """Wait for a run of an earlier session, on a cluster that outlived it, to notice its end."""
    store, end = job.folder.store(job.case), time.monotonic() + _WAIT_SECONDS
    while store.exists():
        try:
            lock.release(lock.acquire(store), store)
        except StoreError:
            if time.monotonic() > end:
                raise
            time.sleep(_LOOK_SECONDS)
        else:
            return


def _failed(job: Job, reason: str, *, final: bool) -> State:
    state = State("failed", job.folder.state(job.case).time, reason, final)
    try:
        job.folder.write_note(job.case, state)
    except OSError:
        return State("failed", state.time, f"{reason} (and this could not be noted)", final=False)
    return state
