"""One rank leads a run, the others assist: they solve the systems of its steps with it.

Only the solves are shared. Rank 0 reads the case, holds the history, calls the user's functions,
judges steps and writes; before each solve it tells the others the state it is about. So nothing
but a solve can leave the ranks of different minds, and the others need neither case nor store.
"""

from __future__ import annotations

from contextlib import suppress
from itertools import count

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.core.parallel import Workers
from stokesfibers.core.team import AbstractTeam
from stokesfibers.stepping.spectral_carry import State
from stokesfibers.stepping.spectral_solve import IncrementSolver
from stokesfibers.stepping.spectral_system import FibersInFluid, Increment, Pass, Surroundings

_JOINT_FAILURES = (np.linalg.LinAlgError, InputError)
"""What all ranks find together in a solve; after anything else they are out of step."""
_numbers = count()


class LeadSolver:
    """The solver of rank 0: tells the others what it solves, and solves it with them.

    Parameters
    ----------
    moving, workers
        As for `IncrementSolver`.
    """

    def __init__(self, moving: FibersInFluid, workers: Workers) -> None:
        self._team, self._moving = workers.team, moving
        self._number = next(_numbers)
        self._inner = IncrementSolver(moving, workers)
        self._team.tell(("fibers", self._number, moving.still(moving.domain_at(0.0))))

    def solve(self, state: State, rate: Array, around: Surroundings, how: Pass) -> Increment:
        """Return the increments about `state`; see `IncrementSolver.solve`."""
        self._team.busy = True
        self._team.tell(
            ("solve", self._number, around.time, self._moving.domain_at(around.time), how),
            (state.modes, state.tensions, rate, around.flow, around.gradient, around.load),
        )
        try:
            found = self._inner.solve(state, rate, around, how)
        except _JOINT_FAILURES:
            self._team.busy = False
            raise
        self._team.busy = False
        return found

    def others(self, state: State, t: float, force: Array, resisted: Array) -> Array:
        """Return what others add to M f; see `IncrementSolver.others`."""
        return self._inner.others(state, t, force, resisted)


def solver_for(moving: FibersInFluid, workers: Workers) -> IncrementSolver | LeadSolver:
    """Return the solver for one rank, or for rank 0 of several."""
    kind = IncrementSolver if workers.team.size == 1 else LeadSolver
    return kind(moving, workers)


def assist(team: AbstractTeam, threads: int | None = None) -> int:
    """Solve with rank 0 until it `dismiss`es this rank; return the exit code it says.

    Raises
    ------
    InputError
        If there are fewer cores than `threads`.
    """
    workers = Workers(threads, team)
    known: dict[int, FibersInFluid] = {}
    while True:
        word, arrays = team.hear()
        match word:
            case ("fibers", number, moving):
                known[number] = moving
            case ("solve", number, time, domain, how):
                solver = IncrementSolver(known[number].still(domain), workers)
                modes, tensions, rate, *around = arrays
                with suppress(*_JOINT_FAILURES):  # rank 0 knows them too, and what to do
                    solver.solve(State(modes, tensions), rate, Surroundings(time, *around), how)
            case ("end", code):
                return code


def dismiss(team: AbstractTeam, code: int) -> None:
    """End the other ranks with an exit code: at once if they wait for this one in a solve."""
    if team.busy:
        team.abort(code or 1)
    team.tell(("end", code))
