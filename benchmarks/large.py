"""Cost of a step of very many fibers with the fast sum: time, growth, memory, where it goes.

Goals on two cores: 1,000 fibers of 24 nodes under 0.6 s, 10,000 under 7 s and 6 GiB, growth
exponent at most 1.15 from 300 to 10,000. The time of a dense solve of 603 unknowns stands beside.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import resource
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

import stokesfibers as sf
from stokesfibers.domain import Free
from stokesfibers.domain.sheared import Sheared
from stokesfibers.fiber.suspension import Suspension
from stokesfibers.stepping.engines import stepper_of
from stokesfibers.summation import FastImages

DENSITY = 1.0  # fibers per L^3
STAGES = {
    "near part of the sum": ("near_single", "near_double", "own_pairs"),
    "Fourier transforms": ("nu2u", "u2nu", "multiply_modes"),
    "lists of near points": ("near_lists", "count_shared", "near_images", "gather"),
    "corrections of near fibers": ("corrections", "add_corrections"),
    "each fiber's equations": ("increment_system", "one"),
    "its solutions": ("solve", "resisted_force"),
}


def problem_of(count: int, *, free: bool) -> tuple[sf.Problem, tuple]:
    """Return a suspension of `count` fibers and its shapes."""
    side = (count / DENSITY) ** (1.0 / 3.0)
    domain = Free() if free else Sheared((side, side, side))
    problem = sf.Problem(
        sf.Fiber(slenderness=1e-2, count=count),
        mu_bar=1e4,
        flow=sf.Shear(1.0),
        engine=sf.SpectralEngine(nodes=24, dt=1e-3, order=2),
        domain=domain,
        image_sum=FastImages(tolerance=1e-4),
    )
    placed = Suspension(seed=1, box=(side, side, side), least_gap=0.02)
    return problem, placed.curves(problem.fibers, problem.domain.lengths)


def measured(count: int, *, free: bool, repeats: int, threads: int | None) -> tuple[float, float]:
    """Return the least seconds of a step and its GMRES iterations."""
    problem, curves = problem_of(count, free=free)
    stepper = stepper_of(problem, threads)
    carry = stepper.start(curves)
    carry, _ = stepper.step(carry)
    times, iterations = [], 0
    for _ in range(repeats):
        started = perf_counter()
        carry, report = stepper.step(carry)
        times.append(perf_counter() - started)
        iterations = report.iterations
    return min(times), iterations


def stages(count: int) -> None:
    """Print where a step on one thread spends its time."""
    problem, curves = problem_of(count, free=False)
    stepper = stepper_of(problem, 1)
    carry = stepper.start(curves)
    carry, _ = stepper.step(carry)
    profile = cProfile.Profile()
    profile.enable()
    stepper.step(carry)
    profile.disable()
    rows = pstats.Stats(profile).stats  # pyright: ignore[reportAttributeAccessIssue]
    total = sum(row[2] for row in rows.values())
    print(f"a step of {count} fibers on one thread, {total:.2f} s, by stage")
    left = total
    plain = {key[2].rsplit(".")[-1].strip(">"): 0.0 for key in rows}
    for key, row in rows.items():
        plain[key[2].rsplit(".")[-1].strip(">")] += row[2]
    for name, functions in STAGES.items():
        own = sum(plain.get(f, 0.0) for f in functions)
        left -= own
        print(f"  {name:28s} {own:7.3f} s  {100.0 * own / total:4.0f} %")
    print(f"  {'the rest':28s} {left:7.3f} s  {100.0 * left / total:4.0f} %")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--counts", type=int, nargs="+", default=[100, 300, 1000, 3000, 10000])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--threads", type=int)
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    matrix, right = rng.normal(size=(603, 603)), rng.normal(size=603)
    with threadpool_limits(1, user_api="blas"):
        solves = []
        for _ in range(20):
            started = perf_counter()
            np.linalg.solve(matrix, right)
            solves.append(perf_counter() - started)
        print(f"dense solve of 603 unknowns: {1e3 * min(solves):.2f} ms")
        for free in (False, True):
            print(f"{'free space' if free else 'sheared triply periodic cell'}, 24 nodes, 1e-4")
            found = []
            for count in options.counts:
                seconds, iterations = measured(
                    count, free=free, repeats=options.repeats, threads=options.threads
                )
                peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
                found.append(seconds)
                print(
                    f"  {count:6d} fibers  {seconds:7.3f} s  {seconds / min(solves):7.0f} solves"
                    f"  {iterations:2d} iterations  peak so far {peak:.2f} GiB",
                    flush=True,
                )
            large = np.array(options.counts) >= 300
            if large.sum() > 1:
                slope = np.polyfit(
                    np.log(np.array(options.counts)[large]), np.log(np.array(found)[large]), 1
                )[0]
                print(f"  growth exponent from 300 on: {slope:.2f}")
        stages(min(1000, max(options.counts)))


if __name__ == "__main__":
    main()
