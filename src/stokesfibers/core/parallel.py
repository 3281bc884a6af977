"""Work per fiber on several threads and ranks, with results that do not depend on how many.

Each task writes its own part of the output and reads nothing another task writes, so the order of
execution cannot change a bit. Kernels and LAPACK release the GIL.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError
from stokesfibers.core.team import ALONE, AbstractTeam

Task = Callable[[int], None]


def cores() -> int:
    """Return how many cores this process may use; all of them where a system cannot tell."""
    told = getattr(os, "sched_getaffinity", None)
    return len(told(0)) if told is not None else os.cpu_count() or 1


class Workers:
    """Runs a task for each fiber on a fixed number of threads.

    Parameters
    ----------
    threads
        Number of threads; None for all cores the process may use, over the ranks on them.
    team
        The ranks that share the work; who uses the workers cuts it into shares.

    Raises
    ------
    InputError
        If there are fewer cores.
    """

    def __init__(self, threads: int | None = None, team: AbstractTeam = ALONE) -> None:
        available = cores()
        if threads is not None and checks.whole("threads", threads, 1) > available:
            raise InputError("threads", f"at most {available}, the cores of this machine", threads)
        self.threads = threads or max(1, available // team.neighbours)
        self.team = team
        self._pool = ThreadPoolExecutor(self.threads - 1) if self.threads > 1 else None

    @property
    def alone(self) -> Workers:
        """The threads of this rank, for work that the other ranks take no part in."""
        return self if self.team is ALONE else Workers(self.threads)

    def for_each(self, count: int, task: Task, *, block: int = 1) -> None:
        """Call ``task(0) ... task(count - 1)``, in any order; `block` of them go to one thread."""
        parts = -(-count // block)
        pool, others = self._pool, min(self.threads, parts) - 1
        if pool is None or others < 1:  # a single small task is done before a thread wakes
            for k in range(count):
                task(k)
            return
        numbers = itertools.count(0, block)

        def pull() -> None:
            while (first := next(numbers)) < count:
                for k in range(first, min(first + block, count)):
                    task(k)

        # this thread works too: waking the others costs as much as a small task
        helpers = [pool.submit(pull) for _ in range(others)]
        try:
            pull()
        finally:
            wait(helpers)
        for helper in helpers:
            helper.result()
