"""Cost of the high-order engine: a step of one fiber by stage, and a whole run of the shell.

A step is measured in units of a bare dense LAPACK solve with as many unknowns, 4 N - 1, in this
process on one thread; the two take turns and the fastest of each counts, since the machines are
noisy. The goal at N = 32 is at most 3 solves of 127 unknowns. A run of the buckling case, with its
kernels compiled before, is to take less than 3 s from the start of the process on.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

import stokesfibers as sf
from stokesfibers.kernels import spectral as kernels
from stokesfibers.stepping import spectral, spectral_solve
from stokesfibers.stepping.spectral_run import SpectralRunStepper

CASE = Path(__file__).parents[1] / "cases" / "buckling.toml"

PARTS = (
    ("flow and load at the nodes", spectral.SpectralStepper, "_surroundings"),
    ("assembly", kernels, "increment_system"),
    ("LU factors", spectral_solve, "_factored"),
    ("substitution", spectral_solve, "_solved"),
    ("error norms", kernels, "step_errors"),
)


@contextmanager
def timed(seconds: dict[str, float]):
    """Add the time of each part of a step to `seconds` while the context lasts."""
    real = [(owner, name, getattr(owner, name)) for _, owner, name in PARTS]

    def clocked(label: str, work: Callable) -> Callable:
        def call(*args, **options):
            started = perf_counter()
            found = work(*args, **options)
            seconds[label] = seconds.get(label, 0.0) + perf_counter() - started
            return found

        return call

    for (label, _, _), (owner, name, work) in zip(PARTS, real, strict=True):
        setattr(owner, name, clocked(label, work))
    try:
        yield
    finally:
        for owner, name, work in real:
            setattr(owner, name, work)


def bent(nodes: int) -> tuple[SpectralRunStepper, object]:
    """Return a stepper and its carry in the middle of a run, where the fiber is buckled."""
    fiber = sf.Fiber(slenderness=1e-3)
    engine = sf.SpectralEngine(nodes=nodes, adapt_nodes=False, rtol=1e-3)
    problem = sf.Problem(fiber, mu_bar=2e5, flow=sf.Shear(1.0), engine=engine)
    stepper = SpectralRunStepper(problem, threads=1)
    carry = stepper.start((sf.shapes.nearly_straight(fiber, angle=2.3, amplitude=0.02),))
    while stepper.time(carry) < 3.0:
        carry, _ = stepper.step(carry)
    return stepper, carry


def step_by_stage(nodes: int, repeats: int) -> float:
    """Print a step's parts in ms and in dense solves; return the solves of the whole."""
    stepper, carry = bent(nodes)
    size = 4 * nodes - 1
    matrix = np.random.default_rng(1).normal(size=(size, size)) + 10.0 * np.eye(size)
    right = np.ones(size)
    solves, steps = [], []
    stages: dict[str, list[float]] = {label: [] for label, _, _ in PARTS}
    for _ in range(repeats):
        for times, work in (
            (solves, lambda: np.linalg.solve(matrix, right)),
            (steps, lambda: stepper.step(carry)),
        ):
            work()  # what the other left in the caches is not the point
            started = perf_counter()
            work()
            times.append(perf_counter() - started)
        seconds: dict[str, float] = {}
        with timed(seconds):
            _, report = stepper.step(carry)
        for label, values in stages.items():
            values.append(seconds.get(label, 0.0) / (1 + report.rejected))
    solve, step = min(solves), min(steps)
    print(f"one fiber, N = {nodes}: a step against a dense solve of {size} unknowns")
    rows = [(label, min(values)) for label, values in stages.items()]
    rows.append(("the rest", step - sum(seconds for _, seconds in rows)))
    for label, seconds in rows:
        print(f"  {label:28s} {1e3 * seconds:7.3f} ms  {seconds / solve:5.2f} solves")
    print(f"  {'step':28s} {1e3 * step:7.3f} ms  {step / solve:5.2f} solves")
    print(f"  {'dense solve':28s} {1e3 * solve:7.3f} ms")
    return step / solve


def run_of_the_shell(repeats: int) -> None:
    """Print the wall time of the buckling case from the shell, process start included."""
    program = [sys.executable, "-c", "from stokesfibers.cli.entry import main; main()"]
    # as for a user, Python keeps the modules it has translated
    surroundings = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    times = []
    with TemporaryDirectory() as folder:
        out = str(Path(folder) / "run.zarr")
        for _ in range(repeats + 1):
            started = perf_counter()
            words = [*program, "run", str(CASE), "--out", out, "--overwrite", "--quiet"]
            subprocess.run(words, check=True, env=surroundings)
            times.append(perf_counter() - started)
    print("stokesfibers run of the buckling case, high-order engine")
    print(f"  first {times[0]:.2f} s, fastest of {repeats} more {min(times[1:]):.2f} s")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=200)
    parser.add_argument("--nodes", type=int, nargs="+", default=[16, 32, 64])
    options = parser.parse_args()
    with threadpool_limits(1, user_api="blas"):
        for nodes in options.nodes:
            step_by_stage(nodes, options.repeats)
    run_of_the_shell(5)


if __name__ == "__main__":
    main()
