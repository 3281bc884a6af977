"""Cost of the Ewald sum against the direct sum, with its stages, and fmm3dpy if it is there.

All in one process. The direct sum is the best one that compiles here: float64, vectorised, all
threads. It is timed on a part of the targets where the whole takes too long. Goals at 100,000
points and 1e-6: 35 times the direct sum with three periods, 12 times in free space.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Callable
from time import perf_counter

import numpy as np
from numba import njit
from threadpoolctl import threadpool_limits

from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.sheared import Sheared
from stokesfibers.summation.ewald import EwaldSum

DOMAINS = {
    "periodic": Periodic((1.0, 1.0, 1.0)),
    "free": Free(),
    "sheared": Sheared((1.0, 1.0, 1.0), 0.37),
}
MOST_PAIRS = 2e9
CHUNK = 64


@njit(nogil=True, error_model="numpy", fastmath=True)
def direct(targets, sources, force, out):
    """Set out (m, 3) to the plain sum at targets (m, 3) over sources and forces (3, n)."""
    for i in range(targets.shape[0]):
        ox, oy, oz = 0.0, 0.0, 0.0
        tx, ty, tz = targets[i, 0], targets[i, 1], targets[i, 2]
        for j in range(sources.shape[1]):
            rx, ry, rz = tx - sources[0, j], ty - sources[1, j], tz - sources[2, j]
            r2 = rx * rx + ry * ry + rz * rz
            inverse2 = 1.0 / r2 if r2 > 0.0 else 0.0
            inverse = np.sqrt(inverse2)
            along = (rx * force[0, j] + ry * force[1, j] + rz * force[2, j]) * inverse2
            ox += inverse * (force[0, j] + along * rx)
            oy += inverse * (force[1, j] + along * ry)
            oz += inverse * (force[2, j] + along * rz)
        out[i, 0], out[i, 1], out[i, 2] = ox, oy, oz


def fastest(work: Callable[[], object], repeats: int) -> float:
    """Return the least seconds of `repeats` calls after a first one."""
    work()
    times = []
    for _ in range(repeats):
        started = perf_counter()
        work()
        times.append(perf_counter() - started)
    return min(times)


def direct_sum(x: np.ndarray, f: np.ndarray, targets: int, workers: Workers) -> np.ndarray:
    """Return the direct sum at the first targets."""
    sources, force = np.ascontiguousarray(x.T), np.ascontiguousarray(f.T)
    out = np.empty((targets, 3))

    def some(k: int) -> None:
        part = slice(k * CHUNK, min((k + 1) * CHUNK, targets))
        direct(x[part], sources, force, out[part])

    workers.for_each(-(-targets // CHUNK), some)
    return out


def direct_seconds(x: np.ndarray, f: np.ndarray, repeats: int, workers: Workers) -> float:
    """Return seconds of the whole direct sum, from a part of its targets if it is long."""
    targets = int(min(len(x), max(CHUNK, MOST_PAIRS // len(x))))
    part = fastest(lambda: direct_sum(x, f, targets, workers), repeats)
    return part * len(x) / targets


def fmm_seconds(x: np.ndarray, f: np.ndarray, tolerance: float) -> float:
    """Return seconds of one sum by fmm3dpy, which compiles nothing; NaN if it is not installed."""
    try:
        fmm = importlib.import_module("fmm3dpy")
    except ImportError:
        return float("nan")
    sources, force = np.asfortranarray(x.T), np.asfortranarray(f.T)
    started = perf_counter()
    fmm.stfmm3d(eps=tolerance, sources=sources, stoklet=force, ifppreg=1)
    return perf_counter() - started


def measured_error(x: np.ndarray, f: np.ndarray, found: np.ndarray, workers: Workers) -> float:
    """Return the relative rms error in free space at the first thousand points."""
    count = min(1000, len(x))
    expected = direct_sum(x, f, count, workers)
    return float(np.linalg.norm(found[:count] - expected) / np.linalg.norm(expected))


def run(kind: str, count: int, tolerance: float, *, options: argparse.Namespace) -> None:
    """Print a line."""
    rng = np.random.default_rng(0)
    x, f = rng.random((count, 3)), rng.standard_normal((count, 3))
    workers, domain = Workers(), DOMAINS[kind]
    plain = direct_seconds(x, f, options.repeats, workers)
    ewald = EwaldSum(tolerance)
    planning = fastest(lambda: ewald.plan(domain, x, workers=workers), options.repeats)
    plan = ewald.plan(domain, x, workers=workers)
    best, stages, found = np.inf, {}, f
    for _ in range(options.repeats + 1):
        started = perf_counter()
        found = plan.execute(f)
        seconds = perf_counter() - started
        if seconds < best:
            best, stages = seconds, dict(plan.seconds)
    alone = near_seconds(plan, options.repeats, workers)
    fmm = fmm_seconds(x, f, tolerance) if kind == "free" and options.fmm else float("nan")
    error = measured_error(x, f, found, workers) if kind == "free" else float("nan")
    choice = plan.choice
    assert choice is not None
    print(
        f"{kind:>8s} {count:8d} {tolerance:8.0e} {best:9.4f} {planning:8.4f} {plain:9.3f} "
        f"{plain / best:7.1f} {fmm:8.2f} {alone:8.4f} "
        + " ".join(f"{stages[k]:8.4f}" for k in ("spread", "multiply", "collect"))
        + f" {choice.split.rc:7.4f} {choice.modes[0]:5d} {choice.pairs / count:9.0f} {error:9.1e}",
        flush=True,
    )


def near_seconds(plan, repeats: int, workers: Workers) -> float:
    """Return seconds of the near part by itself."""
    near = plan._near
    return fastest(lambda: workers.for_each(near.tasks, near.run), repeats)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--counts", type=float, nargs="+", default=[1e4, 3e4, 1e5, 3e5])
    parser.add_argument("--tolerances", type=float, nargs="+", default=[1e-3, 1e-6, 1e-9])
    parser.add_argument("--domains", nargs="+", choices=list(DOMAINS), default=["periodic", "free"])
    parser.add_argument("--fmm", action="store_true", help="also time fmm3dpy")
    options = parser.parse_args()
    print(
        "  domain   points      tol     sum/s   plan/s  direct/s   ratio    fmm/s   near/s   "
        "spread/s  mult/s collect/s     rc modes pairs/pt     error"
    )
    with threadpool_limits(1, user_api="blas"):
        for kind in options.domains:
            for count in options.counts:
                for tolerance in options.tolerances:
                    run(kind, int(count), tolerance, options=options)


if __name__ == "__main__":
    main()
