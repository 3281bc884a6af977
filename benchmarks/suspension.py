"""Cost of interacting fibers: the step of the 25-filament case, its pair sums, growth with M.

Everything is measured in one process with BLAS on one thread. Goals: a step of 25 fibers of 100
intervals within 200 dense solves of 303 unknowns; pair kernels at 60 % of a bare Stokeslet loop.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from numba import njit
from scipy.optimize import nnls
from threadpoolctl import threadpool_limits

import stokesfibers as sf
from stokesfibers.core.parallel import Workers
from stokesfibers.fiber.suspension import Suspension
from stokesfibers.plot.style import FAINT, INK, PALETTE, new_axes, save, style
from stokesfibers.run.start import nodal_positions
from stokesfibers.slender.suspension import Interaction, Scene
from stokesfibers.stepping.paper import PaperStepper

CASE = Path(__file__).parents[1] / "cases" / "fig12.toml"


@njit(nogil=True, fastmath=True)
def bare_stokeslets(targets, x, f):
    """Return the plain Stokeslet sum, (3, target); the yardstick of the pair kernels."""
    out = np.zeros_like(targets)
    for i in range(targets.shape[1]):
        ox, oy, oz = 0.0, 0.0, 0.0
        for j in range(x.shape[1]):
            rx, ry, rz = targets[0, i] - x[0, j], targets[1, i] - x[1, j], targets[2, i] - x[2, j]
            inverse2 = 1.0 / (rx * rx + ry * ry + rz * rz)
            inverse = np.sqrt(inverse2)
            along = (rx * f[0, j] + ry * f[1, j] + rz * f[2, j]) * inverse2
            ox += inverse * (f[0, j] + along * rx)
            oy += inverse * (f[1, j] + along * ry)
            oz += inverse * (f[2, j] + along * rz)
        out[0, i], out[1, i], out[2, i] = ox, oy, oz
    return out


def median(work: Callable[[], object], repeats: int) -> float:
    """Return the median seconds of `repeats` calls after a first one."""
    work()
    times = []
    for _ in range(repeats):
        started = perf_counter()
        work()
        times.append(perf_counter() - started)
    return float(np.median(times))


def fastest_in_turn(works: list[Callable[[], object]], rounds: int) -> list[float]:
    """Return the least seconds of each of `works`, called in turn, after a first round."""
    times = []
    for _ in range(rounds + 1):
        row = []
        for work in works:
            started = perf_counter()
            work()
            row.append(perf_counter() - started)
        times.append(row)
    return list(np.min(times[1:], axis=0))


def case_of(count: int, intervals: int) -> tuple[sf.Problem, np.ndarray]:
    """Return the fig12 problem with `count` fibers at its density, and initial positions."""
    case = sf.load_case(CASE)
    fiber = replace(case.problem.fibers[0], count=count)
    engine = sf.PaperEngine(intervals, dt=1.28 / intervals, beta=20.0)
    problem = replace(case.problem, fiber=fiber, engine=engine)
    side = float(np.sqrt(1.5 * 1.5 * count / 25.0))
    placed = Suspension(seed=1, box=(2.0, side, side), least_gap=0.03)
    curves = placed.curves(problem.fibers, problem.domain.lengths)
    return problem, nodal_positions(curves, problem)


def step_seconds(problem: sf.Problem, positions: np.ndarray, threads: int, repeats: int) -> float:
    """Return the median seconds of a step."""
    stepper = PaperStepper(problem, threads)
    carry = stepper.init(positions)
    for _ in range(2):
        carry, _ = stepper.step(carry)
    return median(lambda: stepper.step(carry), repeats)


def the_25(repeats: int) -> None:
    """Print the step of the 25-filament case against a dense solve, by threads.

    Steps on one and on all threads take turns, so that a change in the machine's speed meets both;
    the fastest of each counts. The bare pair loop shows what its threads can give.
    """
    matrix, right = np.random.default_rng(0).normal(size=(303, 303)), np.ones(303)
    problem, positions = case_of(25, 100)
    cores = len(os.sched_getaffinity(0))
    steppers = [PaperStepper(problem, threads) for threads in range(1, cores + 1)]
    carry = steppers[0].init(positions)
    for _ in range(2):
        carry, _ = steppers[0].step(carry)
    points = np.random.default_rng(1).random((3, 2000))
    loops = [Workers(threads) for threads in range(1, cores + 1)]

    def bare(workers: Workers) -> None:
        workers.for_each(2 * cores, lambda _: bare_stokeslets(points + 2.0, points, points))

    work = [lambda: np.linalg.solve(matrix, right)]
    work += [lambda s=s: s.step(carry) for s in steppers]
    work += [lambda w=w: bare(w) for w in loops]
    solve, *rest = fastest_in_turn(work, 2 * repeats)
    steps, bares = rest[:cores], rest[cores:]
    print("25 fibers, N = 100, period 2 in x")
    print(f"  dense solve of 303 unknowns  {1e3 * solve:8.2f} ms")
    for threads, (step, loop) in enumerate(zip(steps, bares, strict=True), 1):
        print(
            f"  step, {threads} thread(s)           {1e3 * step:8.1f} ms"
            f"  = {step / solve:5.0f} solves,"
            f" speed-up {steps[0] / step:.2f} (bare pair loop {bares[0] / loop:.2f})"
        )


def pair_rates(repeats: int) -> None:
    """Print source-target pairs per second of the pair kernel and of the bare loop, one thread."""
    problem, positions = case_of(25, 100)
    stepper = PaperStepper(problem, 1)
    shapes = tuple(f.shape(x.T) for f, x in zip(stepper.fibers, positions, strict=True))
    interaction = Interaction.build(
        stepper.fibers,
        problem.domain,
        image_sum=problem.image_sum,
        close_approach=problem.close_approach,
    )
    scene = Scene(interaction, shapes, Workers(1))
    force = scene.integrated_force(np.zeros(positions.shape[:2]))
    value = np.zeros_like(force)
    pairs = 3 * positions.shape[0] ** 2 * positions.shape[1] ** 2
    kernel = pairs / median(lambda: scene.at_nodes(force, value), repeats)
    flat = np.ascontiguousarray(positions.reshape(-1, 3).T)
    moved = flat + 0.5
    bare = flat.shape[1] ** 2 / median(lambda: bare_stokeslets(moved, flat, flat), repeats)
    print("pairs per second, one thread")
    print(f"  V + W, by parts, images, near search {kernel / 1e9:6.2f}e9")
    print(f"  bare Stokeslet loop                  {bare / 1e9:6.2f}e9   ratio {kernel / bare:.2f}")


def growth(counts: tuple[int, ...], intervals: int, repeats: int, plot: Path | None) -> None:
    """Print, and draw, the step over M against C_1 M N^3 + C_2 M^2 N^2 fitted to it."""
    seconds = []
    for count in counts:
        problem, positions = case_of(count, intervals)
        seconds.append(step_seconds(problem, positions, len(os.sched_getaffinity(0)), repeats))
    m, t = np.array(counts, dtype=float), np.array(seconds)
    terms = np.stack([m * intervals**3, m**2 * intervals**2], axis=1)
    constants = nnls(terms / t[:, None], np.ones(len(t)))[0]
    print(f"growth with M at N = {intervals}, all threads, against C1 M N^3 + C2 M^2 N^2")
    print(f"  C1 = {constants[0]:.3g} s, C2 = {constants[1]:.3g} s")
    for count, found, model in zip(counts, t, terms @ constants, strict=True):
        print(f"  M = {count:4d}: {found:8.3f} s, model {model:8.3f} s")
    if plot is not None:
        many = np.geomspace(m[0], m[-1])
        own, pairs = constants[0] * many * intervals**3, constants[1] * many**2 * intervals**2
        draw(plot, (m, t), (many, own, pairs))


def draw(file: Path, measured: tuple[np.ndarray, ...], model: tuple[np.ndarray, ...]) -> None:
    """Draw seconds of a step over M: measured, and the model with its parts."""
    many, own, pairs = model
    ax = new_axes()
    with style():
        ax.loglog(*measured, "o", color=PALETTE[0], label="measured")
        ax.loglog(many, own + pairs, color=INK, label="$C_1 M N^3 + C_2 M^2 N^2$")
        ax.loglog(many, own, ":", color=FAINT, label="$C_1 M N^3$")
        ax.loglog(many, pairs, "--", color=FAINT, label="$C_2 M^2 N^2$")
        ax.set_xlabel("filaments $M$")
        ax.set_ylabel("step [s]")
        ax.legend()
    save(ax, file)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--counts", type=int, nargs="+", default=[10, 30, 100, 300])
    parser.add_argument("--intervals", type=int, default=40)
    parser.add_argument("--plot", type=Path, help="picture of the growth with M")
    options = parser.parse_args()
    with threadpool_limits(1, user_api="blas"):
        the_25(options.repeats)
        pair_rates(options.repeats)
        growth(tuple(options.counts), options.intervals, min(options.repeats, 3), options.plot)


if __name__ == "__main__":
    main()
