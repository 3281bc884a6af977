"""Work per fiber on several threads, with results that do not depend on how many.

Each task writes its own part of the output and reads nothing another task writes, so the order of
execution cannot change a bit. Kernels and LAPACK release the GIL.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from stokesfibers.core import checks
from stokesfibers.core.errors import InputError

Task = Callable[[int], None]


class Workers:
    """Runs a task for each fiber on a fixed number of threads.

    Parameters
    ----------
    threads
        Number of threads; None for all cores the process may use.

    Raises
    ------
    InputError
        If there are fewer cores.
    """

    def __init__(self, threads: int | None = None) -> None:
        cores = len(os.sched_getaffinity(0))
        if threads is not None and checks.whole("threads", threads, 1) > cores:
            raise InputError("threads", f"at most {cores}, the cores of this machine", threads)
        self.threads = threads or cores
        self._pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None

    def for_each(self, count: int, task: Task) -> None:
        """Call ``task(0) ... task(count - 1)``, in any order."""
        if self._pool is None or count == 1:
            for k in range(count):
                task(k)
        else:
            for done in [self._pool.submit(task, k) for k in range(count)]:
                done.result()
