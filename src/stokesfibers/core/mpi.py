"""The ranks that an MPI launcher started, through mpi4py, which is imported only when asked for."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter, sleep
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stokesfibers.core.errors import InputError, MissingExtraError
from stokesfibers.core.team import ALONE, AbstractTeam, edges_of

_LAUNCHERS = (
    ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"),
    ("PMI_RANK", "PMI_SIZE"),
    ("PALS_RANKID", "PALS_SIZE"),
    ("SLURM_PROCID", "SLURM_STEP_NUM_TASKS"),
)
"""What launchers set: Open MPI; MPICH, Intel MPI and kin; Cray; srun."""
_PATIENCE, _NAP = 1e-3, 1e-4  # seconds: how long to wait awake, and the naps from then on
_FAREWELL = 0.5  # seconds that a launcher gets to pass on what was said, and to end the other ranks


def launched(environment: Mapping[str, str] | None = None) -> tuple[int, int]:
    """Return this process's rank and the number of ranks, as the launcher's environment says.

    Without a launcher they are 0 and 1.
    """
    held = os.environ if environment is None else environment
    for rank, size in _LAUNCHERS:
        if held.get(rank, "").isdigit() and held.get(size, "").isdigit():
            return int(held[rank]), int(held[size])
    return 0, 1


def team_of_launcher(mpi: bool | None = None) -> AbstractTeam:
    """Return the ranks of this run.

    Parameters
    ----------
    mpi
        Whether there are others; None if the launcher's environment is to say.

    Raises
    ------
    MissingExtraError
        If there are others and mpi4py, or the MPI library it needs, is not installed.
    InputError
        If mpi4py sees other ranks than were launched.
    """
    _, size = launched()
    if mpi is False or (mpi is None and size == 1):
        return ALONE
    try:
        import mpi4py

        mpi4py.rc.thread_level = "funneled"
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        raise MissingExtraError("mpi4py", "mpi", "A run on several ranks") from error
    team = MpiTeam(MPI.COMM_WORLD)
    if size not in (1, team.size):
        raise InputError(
            "mpirun",
            f"{size} ranks, as launched",
            f"{team.size} seen by mpi4py",
            "Start the run with the launcher of the MPI library that mpi4py uses.",
        )
    return ALONE if team.size == 1 else team


class MpiTeam(AbstractTeam):
    """The ranks of a communicator.

    MPI libraries wait awake, and a rank that waits keeps one that works from its core. So ranks
    meet before they exchange anything, and who waits for long naps. Between naps it looks whether
    another rank has aborted: launchers now and then leave ranks running.

    Parameters
    ----------
    world
        Of mpi4py.
    """

    def __init__(self, world: Any) -> None:
        from mpi4py import MPI

        self._mpi, self._world, self._ends = MPI, world, world.Dup()
        self.rank, self.size, self.busy = world.Get_rank(), world.Get_size(), False
        node = world.Split_type(MPI.COMM_TYPE_SHARED)
        own = os.sched_getaffinity(0)
        self.neighbours = sum(bool(own & cores) for cores in node.allgather(own))

    def complete(self, rows: NDArray, edges: NDArray[np.int64] | None = None) -> None:
        if edges is None:
            edges = edges_of(len(rows), self.size)
        width = int(np.prod(rows.shape[1:], dtype=np.int64))
        counts = [int(n) * width for n in np.diff(edges)]
        starts = [int(n) * width for n in edges[:-1]]
        flat = rows.reshape(-1)
        kind = self._mpi._typedict[flat.dtype.char]
        self._meet()
        self._world.Allgatherv(self._mpi.IN_PLACE, [flat, counts, starts, kind])

    def copy_from(self, rank: int, values: NDArray) -> None:
        self._meet()
        self._world.Bcast(values, root=rank)

    def swap(self, other: int, mine: NDArray, theirs: NDArray) -> None:
        nothing = bytearray()
        hail = self._world.Isend([nothing, self._mpi.BYTE], dest=other)
        self._wait(self._world.Irecv([nothing, self._mpi.BYTE], source=other).Test)
        hail.Wait()
        self._world.Sendrecv(mine, dest=other, recvbuf=theirs, source=other)

    def any(self, flag: bool) -> bool:
        self._meet()
        return bool(self._world.allreduce(bool(flag), op=self._mpi.LOR))

    def tell(self, word: Any, arrays: Sequence[NDArray] = ()) -> None:
        ready = [np.ascontiguousarray(values, dtype=float) for values in arrays]
        self._meet()
        self._world.bcast((word, [values.shape for values in ready]), root=0)
        for values in ready:
            self._world.Bcast(values, root=0)

    def hear(self) -> tuple[Any, list[NDArray]]:
        self._meet()
        word, shapes = self._world.bcast(None, root=0)
        arrays = [np.empty(shape) for shape in shapes]
        for values in arrays:
            self._world.Bcast(values, root=0)
        return word, arrays

    def abort(self, code: int) -> None:
        word = [np.array([code]), self._mpi.LONG]
        others = set(range(self.size)) - {self.rank}
        sent = [self._ends.Isend(word, dest=rank) for rank in others]
        sleep(_FAREWELL)
        self._mpi.Request.Testall(sent)
        self._world.Abort(code)

    def _meet(self) -> None:
        self._wait(self._world.Ibarrier().Test)

    def _wait(self, done: Callable[[], bool]) -> None:
        """Return once `done`; awake at first, then between naps."""
        until = perf_counter() + _PATIENCE
        while not done():
            if perf_counter() > until:
                if self._ends.Iprobe():
                    self._follow()
                sleep(_NAP)

    def _follow(self) -> None:
        """End as the rank that aborted, unless the launcher is faster."""
        code = np.empty(1, dtype=int)
        self._ends.Recv([code, self._mpi.LONG])
        sleep(2.0 * _FAREWELL)
        self._world.Abort(int(code[0]))
