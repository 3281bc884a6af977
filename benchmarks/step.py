"""Cost of one step of the paper's engine, in units of a bare dense solve of the same size.

Both are measured in this process on one thread, alternating, and compared by their medians, since
the machines are noisy. The goal at N = 200 is at most 2 solves of 603 unknowns.
"""

from __future__ import annotations

import argparse
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

import stokesfibers as sf
from stokesfibers.run.simulate import nodal_positions
from stokesfibers.stepping.paper import PaperStepper


def measure(intervals: int, repeats: int) -> dict[str, float]:
    """Return milliseconds of a step, its stages and a dense solve, for one bent fiber."""
    fiber = sf.Fiber(slenderness=1e-3)
    problem = sf.Problem(
        fiber, mu_bar=4e5, flow=sf.Shear(1.0), engine=sf.PaperEngine(intervals=intervals)
    )
    stepper = PaperStepper(problem)
    alpha = np.linspace(0.0, 1.0, 400)
    bend = np.stack([alpha, 0.1 * np.sin(5.0 * alpha), 0.05 * np.cos(4.0 * alpha)], axis=-1)
    curve = sf.shapes.scaled(sf.shapes.through_points(bend), fiber)
    carry = stepper.init(nodal_positions(curve, problem))
    size = 3 * (intervals + 1)
    matrix = np.random.default_rng(1).normal(size=(size, size)) + 10.0 * np.eye(size)
    right = np.ones(size)
    for _ in range(3):
        carry, _ = stepper.step(carry)
        np.linalg.solve(matrix, right)
    solves, steps, stages = [], [], []
    for _ in range(repeats):
        started = perf_counter()
        np.linalg.solve(matrix, right)
        solves.append(perf_counter() - started)
        started = perf_counter()
        carry, report = stepper.step(carry)
        steps.append(perf_counter() - started)
        stages.append(report.wall_time)
    positions, tension = np.median(stages, axis=0)
    return {
        "solve": 1e3 * float(np.median(solves)),
        "step": 1e3 * float(np.median(steps)),
        "positions": 1e3 * float(positions),
        "tension": 1e3 * float(tension),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=100)
    repeats = parser.parse_args().repeats
    print("   N  unknowns  solve/ms  step/ms  positions/ms  tension/ms  step/solve")
    with threadpool_limits(1, user_api="blas"):
        for intervals in (50, 100, 200, 400):
            t = measure(intervals, repeats if intervals < 400 else max(5, repeats // 5))
            print(
                f"{intervals:4d}  {3 * (intervals + 1):8d}  {t['solve']:8.2f}  {t['step']:7.2f}  "
                f"{t['positions']:12.2f}  {t['tension']:10.2f}  {t['step'] / t['solve']:10.2f}"
            )


if __name__ == "__main__":
    main()
