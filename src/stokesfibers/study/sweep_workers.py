"""Where the cases of a sweep run: in this process, in processes of this machine, on a cluster.

Processes and clusters are those of Dask (the extra ``sweep``), which is imported when used. What a
case gives does not depend on where it runs: each runs on one thread, alone.
"""

from __future__ import annotations

import queue
import signal
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from typing import Any

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError, MissingExtraError
from stokesfibers.core.parallel import cores
from stokesfibers.study.sweep_folder import State
from stokesfibers.study.sweep_job import Job, Tick, run_job

_POLL_SECONDS = 0.5
_CONNECT_SECONDS = "10s"
_LOST = "Its worker process died; short of memory? What it had stored is kept"
_LOST_CLUSTER = "The cluster was lost or took the case back. What it had stored is kept"

Outcome = tuple[Job, State]
"""A case that ended, and how it stands."""


def workers_of(workers: int | None, cases: int) -> int:
    """Return how many processes to use: as many as asked for, or cores, but not above `cases`.

    One, if none are asked for and Dask is not installed.

    Raises
    ------
    MissingExtraError
        If several are asked for and it is not.
    """
    asked = cores() if workers is None else checks.whole("workers", workers, 1)
    count = max(1, min(asked, cases))
    if count > 1 and not has_dask():
        if workers is not None:
            raise MissingExtraError("distributed", "sweep", "A sweep on several processes")
        return 1
    return count


def has_dask() -> bool:
    """Return whether several processes can be used."""
    return find_spec("distributed") is not None


def outcomes(
    jobs: Sequence[Job], *, workers: int, scheduler: str | None, tick: Tick
) -> Generator[Outcome | None, None, None]:
    """Run `jobs` and yield each as it ends, and None now and then so that the caller can look.

    Parameters
    ----------
    jobs
        What to run, in order.
    workers
        Processes of this machine; one is this process.
    scheduler
        Address of a running Dask scheduler, which is used instead; None for this machine.
    tick
        Called now and then by runs in this process.

    Raises
    ------
    MissingExtraError
        If Dask is needed and not installed.
    InputError
        If there is no scheduler at the address.
    """
    if not jobs:
        return
    if workers == 1 and scheduler is None:
        for job in jobs:
            yield job, run_job(job, tick)
        return
    with _client(workers, scheduler) as client:
        yield from _on_dask(client, jobs)


def _on_dask(client: Any, jobs: Sequence[Job]) -> Generator[Outcome | None, None, None]:
    """Submit all jobs; their futures come back through a queue, in the order they end."""
    ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
    # A later session of the same sweep must not get this one's results: the token is in the key.
    names = [f"{job.case.name}-{job.token}" for job in jobs]
    futures = client.map(run_job, jobs, key=names, pure=False)
    by_key = {future.key: job for future, job in zip(futures, jobs, strict=True)}
    for future in futures:
        future.add_done_callback(ended.put)
    left = len(futures)
    while left:
        try:
            future = ended.get(timeout=_POLL_SECONDS)
        except queue.Empty:
            yield None
            continue
        left -= 1
        job = by_key[future.key]
        yield job, _state(job, future)
        future.release()


def _state(job: Job, future: Any) -> State:
    """Return how a job ended; that of a lost one is noted here, its worker being gone."""
    if future.status == "finished":
        with suppress(Exception):
            return future.result(timeout=_CONNECT_SECONDS)
    reached = job.folder.state(job.case).time
    if future.status == "error":
        error = future.exception()
        died = type(error).__name__ == "KilledWorker"
        state = State("failed", reached, _LOST if died else f"{error!r}", final=False)
    else:
        state = State("failed", reached, _LOST_CLUSTER, final=False)
    with suppress(OSError):
        job.folder.write_note(job.case, state)
    return state


@contextmanager
def _client(workers: int, scheduler: str | None) -> Iterator[Any]:
    """Give a client of the cluster at `scheduler`, or of one of our own, ended with the block."""
    dask, distributed = _libraries()
    # A case that kills its worker goes on from its checkpoint on another one, but not for ever.
    quiet = {
        "distributed.scheduler.allowed-failures": 1,
        "distributed.admin.log-format": "%(message)s",
    }
    with dask.config.set(quiet):
        if scheduler is not None:
            try:
                client = distributed.Client(scheduler, timeout=_CONNECT_SECONDS)
            except (OSError, TimeoutError, ValueError) as error:
                got = f"'{scheduler}' ({error})"
                raise InputError("--scheduler", "the address of a scheduler", got) from None
            with client:
                yield client
            return
        cluster = distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=None,
            dashboard_address="127.0.0.1:0",  # any free port; by default a busy one is warned of
            silence_logs="CRITICAL",
        )
        with cluster, distributed.Client(cluster) as client:
            client.register_plugin(_deaf(distributed))
            yield client


def _deaf(distributed: Any) -> Any:
    """Return a plugin for workers of our own: Ctrl-C is the sweep's business, not theirs."""

    class Deaf(distributed.WorkerPlugin):
        name = "stokesfibers-deaf"

        def setup(self, worker: Any) -> None:  # noqa: ARG002
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    return Deaf()


def _libraries() -> tuple[Any, Any]:
    """Return dask and distributed.

    Raises
    ------
    MissingExtraError
        If they are not installed.
    """
    try:
        import dask
        import distributed
    except ImportError as error:
        raise MissingExtraError("distributed", "sweep", "A sweep on several processes") from error
    return dask, distributed
