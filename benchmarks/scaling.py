"""What a step costs by part, and what that means for many ranks: the tables of docs/scaling.md.

Each part is measured on one thread in seconds of processor time, which a busy machine disturbs less
than the clock. Parts are scaled to other numbers of filaments at the same density, for which all of
them grow linearly. The network is an assumption: see --bandwidth and --latency.

    python benchmarks/scaling.py
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import log2
from time import process_time

import numpy as np

import stokesfibers as sf
from stokesfibers.domain import Periodic
from stokesfibers.fiber.initials import INITIALS
from stokesfibers.run.simulate import reproducible
from stokesfibers.slender import spectral_ewald
from stokesfibers.stepping.spectral_run import SpectralRunStepper
from stokesfibers.stepping.spectral_solve import IncrementSolver, _Systems
from stokesfibers.summation import FastImages
from stokesfibers.summation.ewald import plan
from stokesfibers.summation.ewald.far import FarPart, nufft_library
from stokesfibers.summation.ewald.near import NearPart
from stokesfibers.summation.ewald.own import OwnPart

NODES = 24
TOLERANCE = 1e-4
PARTS = (
    ("shared", "assembly, factors", IncrementSolver, "_assembled"),
    ("shared", "substitution", _Systems, "solve"),
    ("shared", "own operators", _Systems, "resisted_force"),
    ("shared", "near lists", plan, "make_lists"),
    ("shared", "near sum", NearPart, "run"),
    ("shared", "own pairs", OwnPart, "run"),
    ("shared", "near fibers", spectral_ewald, "near_images"),
    ("shared", "close corrections, set up", spectral_ewald.EwaldScene, "_near"),
    ("shared", "close corrections", spectral_ewald.EwaldScene, "_correct"),
    ("two ranks", "transforms, set up", FarPart, "__init__"),
    ("two ranks", "transforms, forward", FarPart, "spread"),
    ("two ranks", "transforms, back", FarPart, "collect"),
    ("every", "modes", FarPart, "multiply"),
    ("every", "choice of the cut-off", plan.EwaldSum, "chosen"),
)
"""Who does it, what it is, and where it is done."""


@dataclass(frozen=True)
class Model:
    """A step on one rank: processor seconds by who does it, and what is sent, per filament.

    Attributes
    ----------
    shared, two, every, lead
        Seconds that all ranks share, two ranks halve, all repeat, and rank 0 spends alone.
    sent
        Bytes that each rank receives.
    messages
        Number of exchanges in a step, however many filaments.
    """

    shared: float
    two: float
    every: float
    lead: float
    sent: float
    messages: int

    def seconds(self, filaments: float, ranks: int, bandwidth: float, latency: float) -> float:
        """Return the time of a step."""
        alone = filaments * (self.every + self.lead)
        if ranks == 1:
            return alone + filaments * (self.shared + self.two)
        work = filaments * max((self.shared + self.two) / ranks, 0.5 * self.two)
        sent = filaments * self.sent * (1.0 - 1.0 / ranks) / bandwidth
        return alone + work + sent + self.messages * latency * log2(ranks)

    def all_shared(self, filaments: float, ranks: int, bandwidth: float, latency: float) -> float:
        """Return the time of a step if ranks shared all work, transforms and vectors too."""
        whole = filaments * (self.every + self.lead + self.shared + self.two)
        sent = filaments * self.sent * (1.0 - 1.0 / ranks) / bandwidth
        return whole / ranks + sent + self.messages * latency * log2(ranks)


@contextmanager
def timed(seconds: dict[str, float]) -> Iterator[None]:
    """Add the processor time of each part to `seconds` while the context lasts."""
    real = [(owner, name, getattr(owner, name)) for _, _, owner, name in PARTS]

    def clocked(label, work):
        def call(*args, **options):
            started = process_time()
            found = work(*args, **options)
            seconds[label] = seconds.get(label, 0.0) + process_time() - started
            return found

        return call

    for (_, label, _, _), (owner, name, work) in zip(PARTS, real, strict=True):
        setattr(owner, name, clocked(label, work))
    try:
        yield
    finally:
        for owner, name, work in real:
            setattr(owner, name, work)


def measured(filaments: int, density: float, repeats: int) -> Model:
    """Print the parts of a step, the least of some repeats, and return the model."""
    side = float((filaments / density) ** (1.0 / 3.0))
    fiber = sf.Fiber(slenderness=1e-2, count=filaments)
    engine = sf.SpectralEngine(nodes=NODES, adapt_nodes=False, dt=0.01)
    problem = sf.Problem(
        fiber,
        mu_bar=2e3,
        flow=sf.Shear(1.0),
        engine=engine,
        domain=Periodic((side,) * 3),
        image_sum=FastImages(TOLERANCE),
    )
    initial = INITIALS["suspension"](box=[side] * 3, seed=1, least_gap=0.01)
    stepper = SpectralRunStepper(problem, threads=1)
    carry = stepper.start(initial.curves(problem.fibers, problem.domain.lengths))
    plans = []
    real = plan.Plan.__init__

    def kept(self, *args, **options):
        real(self, *args, **options)
        plans.append(self.choice)

    plan.Plan.__init__ = kept
    carry, _ = stepper.step(carry)
    plan.Plan.__init__ = real
    best: dict[str, float] = {}
    for _ in range(repeats):
        seconds: dict[str, float] = {}
        started = process_time()
        with timed(seconds):
            _, report = stepper.step(carry)
        seconds["step"] = process_time() - started
        best = {k: min(v, best.get(k, v)) for k, v in seconds.items()}
    modes = int(np.prod(plans[-1].modes))
    return explained(best, filaments, report.iterations, modes)


def explained(seconds: dict[str, float], filaments: int, iterations: int, modes: int) -> Model:
    """Print the parts in microseconds per filament and return the model."""
    each = {label: value / filaments for label, value in seconds.items()}
    kinds = dict.fromkeys(("shared", "two ranks", "every"), 0.0)
    print(f"{filaments} filaments of {NODES} nodes, {iterations} iterations, {modes} modes")
    for kind, label, _, _ in PARTS:
        kinds[kind] += each[label]
        print(f"  {kind:10s} {label:28s} {1e6 * each[label]:8.1f} us per filament")
    rest = each["step"] - sum(kinds.values())
    print(f"  {'rank 0':10s} {'all else':28s} {1e6 * rest:8.1f} us per filament")
    sums = iterations + 2
    # state and flow; per sum forces, near, own, far (single precision), velocities; solution
    node = 8 * 25 + sums * (48 + 24 + 24 + 16 + 24) + 32
    sent = NODES * node + sums * 8.0 * modes / filaments
    print(f"  received per step {1e-3 * sent:.1f} kB per filament, {8 * sums + 6} exchanges")
    return Model(*kinds.values(), rest, sent, 8 * sums + 6)


def transforms(points: int, modes: int) -> None:
    """Print what of a transform depends on its points: what spreading own sources could save."""
    rng = np.random.default_rng(1)
    grid = np.empty((modes,) * 3, np.complex64)
    for count in (points, points // 16):
        where = (2.0 * np.pi * rng.random((count, 3))).astype(np.float32)
        library = nufft_library().plan(
            nu2u=True,
            coord=where,
            grid_shape=grid.shape,
            epsilon=TOLERANCE,
            nthreads=1,
            periodicity=2.0 * np.pi,
            fft_order=True,
        )
        strength = np.ones(count, np.complex64)
        best = np.inf
        for _ in range(5):
            started = process_time()
            library.nu2u(points=strength, forward=True, out=grid)
            best = min(best, process_time() - started)
        print(f"transform of {count} points to {modes}^3 modes: {1e3 * best:.1f} ms")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--filaments", type=int, default=1000)
    parser.add_argument("--density", type=float, default=8.0, help="n L^3")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--bandwidth", type=float, default=1e10, help="bytes per second and rank")
    parser.add_argument("--latency", type=float, default=5e-6, help="seconds")
    options = parser.parse_args()
    with reproducible():
        model = measured(options.filaments, options.density, options.repeats)
    transforms(NODES * options.filaments, 64)
    print("\nseconds per step, speed-up, and seconds if all work were shared")
    print("ranks" + 2 * "      step  speed-up    all shared" + "   (1e5, 1e6 filaments)")
    network = options.bandwidth, options.latency
    for ranks in (1, 2, 4, 8, 16, 64, 256):
        row = f"{ranks:5d}"
        for filaments in (1e5, 1e6):
            seconds = model.seconds(filaments, ranks, *network)
            gain = model.seconds(filaments, 1, *network) / seconds
            shared = model.all_shared(filaments, ranks, *network)
            row += f"{seconds:10.1f}{gain:10.1f}{shared:14.1f}"
        print(row)


if __name__ == "__main__":
    main()
