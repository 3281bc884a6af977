"""What the tests of several ranks start under mpirun: steps to compare, and ranks that fail.

mpirun -n 2 python on_ranks.py steps
mpirun -n 2 python on_ranks.py kill 20 run case.toml --out run.zarr

Rank 1 fails by a signal (kill), by an exception (raise), or by one that the launcher never hears of
(mute).
"""

from __future__ import annotations

import os
import signal
import sys
import time

import numpy as np

import stokesfibers as sf
from stokesfibers.core import mpi
from stokesfibers.core.mpi import team_of_launcher
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.sheared import Sheared
from stokesfibers.run.simulate import reproducible
from stokesfibers.stepping import spectral_solve
from stokesfibers.stepping.engines import stepper_of
from stokesfibers.stepping.spectral_team import assist, dismiss
from stokesfibers.summation import EngineImages, FastImages

SHORT = sf.Fiber(length=0.7, slenderness=2e-2, count=3)
LONG = sf.Fiber(slenderness=1e-2, count=4)
CASES = {
    "one fiber": (sf.Fiber(slenderness=1e-2), Free(), EngineImages()),
    "direct, free": ((LONG, SHORT), Free(), EngineImages()),
    "direct, one period": ((LONG, SHORT), Periodic((2.0, 0.0, 0.0)), EngineImages()),
    "fast, free, two radii": ((LONG, SHORT), Free(), FastImages(1e-9)),
    "fast, three periods": (LONG, Periodic((2.0, 2.0, 1.7)), FastImages(1e-4)),
    "fast, sheared, two radii": ((LONG, SHORT), Sheared((2.0, 2.0, 1.7)), FastImages(1e-6)),
}


def problem_of(name: str) -> tuple[sf.Problem, tuple]:
    """Return a problem and its curves: fibers beside each other, the first two close."""
    fiber, domain, image_sum = CASES[name]
    engine = sf.SpectralEngine(nodes=16, adapt_nodes=False, rtol=1e-8, newton_passes=2)
    problem = sf.Problem(
        fiber, mu_bar=1e4, flow=sf.Shear(1.0), engine=engine, domain=domain, image_sum=image_sum
    )
    curves = tuple(
        sf.shapes.nearly_straight(
            kind, angle=0.4 + 0.3 * k, amplitude=0.05, centre=(0.9 * (k % 3), 0.2 * k, 0.05 * k)
        )
        for k, kind in enumerate(problem.fibers)
    )
    return problem, curves


def stepped(name: str, *more) -> list[np.ndarray]:
    """Return all that a start and two steps leave."""
    problem, curves = problem_of(name)
    stepper = stepper_of(problem, 1, *more)
    carry = stepper.start(curves)
    for _ in range(2):
        carry, _ = stepper.step(carry)
    return list(carry.arrays().values())


def compare_steps(spoiled: bool) -> None:
    """Print, from rank 0, whether each case is bitwise that of one rank.

    If spoiled, the last rank errs by a rounding in what it solves.
    """
    team = team_of_launcher()
    if spoiled and team.rank == team.size - 1:
        solved = spectral_solve._solved

        def wrong(*arguments, **options):
            found, info = solved(*arguments, **options)
            return found * (1.0 + 1e-15), info

        spectral_solve._solved = wrong
    with reproducible():
        if team.rank:
            sys.exit(assist(team, 1))
        code = 1
        try:
            for name in CASES:
                pairs = list(zip(stepped(name, team), stepped(name), strict=True))
                same = all(a.tobytes() == b.tobytes() for a, b in pairs)
                print(f"{name}: {team.size} ranks: {'same' if same else 'other'}", flush=True)
            code = 0
        finally:
            dismiss(team, code)


class MuteWorld:
    """A communicator whose launcher does nothing where a rank aborts."""

    def __init__(self, world) -> None:
        self._world = world

    def __getattr__(self, name: str):
        return getattr(self._world, name)

    def Abort(self, _code: int) -> None:
        time.sleep(120.0)


class MuteTeam(mpi.MpiTeam):
    """Ranks whose launcher does not hear this one."""

    def __init__(self, world) -> None:
        super().__init__(world)
        self._world = MuteWorld(world)


def fail(how: str, after: int) -> None:
    """Do the command of the shell that follows; rank 1 fails after so many solves."""
    from stokesfibers.cli.main import main

    solve, calls = spectral_solve.IncrementSolver.solve, [0]

    rank, _ = mpi.launched()
    if how == "mute" and rank == 1:
        mpi.MpiTeam = MuteTeam

    def failing(self, *arguments, **options):
        calls[0] += 1
        if rank == 1 and calls[0] > after:
            if how == "kill":
                os.kill(os.getpid(), signal.SIGKILL)
            raise RuntimeError("out of order")
        return solve(self, *arguments, **options)

    spectral_solve.IncrementSolver.solve = failing
    main()


if __name__ == "__main__":
    word = sys.argv.pop(1)
    if word in ("steps", "spoiled"):
        compare_steps(word == "spoiled")
    else:
        fail(word, int(sys.argv.pop(1)))
