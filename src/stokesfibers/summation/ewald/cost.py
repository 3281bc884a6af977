"""Which cut-off is cheapest: pairs counted in boxes of about the near volume, modes from the box.

The constants are seconds on one thread of a 2.1 GHz AVX-512 machine; only their ratios matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.kernels import ewald as kernels
from stokesfibers.summation.ewald.cloud import Cloud
from stokesfibers.summation.ewald.far import MOST_MODES, SINGLE_TOLERANCE, box_of
from stokesfibers.summation.ewald.near_polynomial import SINGLE_TOLERANCE as SINGLE_NEAR
from stokesfibers.summation.ewald.split import Split

PAIR_SECONDS = {"single": 5.2e-9, "double": 11.5e-9}
"""Per pair within rc, with those that the loop runs over in vain."""
TARGET_SECONDS = 2e-7
SUPPORT_SECONDS = 0.6e-9
"""Per point, transform and cube of the spreading kernel's width."""
MODE_SECONDS = {"single": 0.4e-7, "double": 0.8e-7}
"""Per mode and transform, oversampling included."""
TRANSFORMS = 4
STEP = 1.12
"""Ratio of neighbouring cut-offs that are tried."""
_TRIES = 60
_COARSE = 4
_CUBE = (4.0 * np.pi / 3.0) ** (1.0 / 3.0)  # side of a cube of the volume of the unit ball
_SLOTS = 1 << 20


@dataclass(frozen=True)
class Cost:
    """What a cut-off is expected to take.

    Attributes
    ----------
    rc
        The cut-off.
    pairs
        Number of pairs within it, images included, about.
    modes
        Number of Fourier modes.
    near, far
        Seconds of each part on one thread.
    """

    rc: float
    pairs: float
    modes: float
    near: float
    far: float

    @property
    def seconds(self) -> float:
        return self.near + self.far


def near_pairs(cloud: Cloud, rc: float) -> float:
    """Return about how many pairs of target and source are within rc."""
    low, _ = cloud.bounds
    side = _CUBE * rc
    slots = int(min(_SLOTS, 8 * (len(cloud.sources) + len(cloud.targets)) + 64))
    own = kernels.count_shared(cloud.inside, low, side, slots)
    if cloud.target_inside is cloud.inside:
        return float(own @ own)
    return float(own @ kernels.count_shared(cloud.target_inside, low, side, slots))


def cost_of(cloud: Cloud, split: Split) -> Cost:
    """Return the expected cost of a split."""
    low, high = cloud.bounds
    modes = float(np.prod(box_of(cloud.lattice, high - low, split).modes.astype(float)))
    pairs = near_pairs(cloud, split.rc)
    near_kind = "single" if split.tolerance >= SINGLE_NEAR else "double"
    far_kind = "single" if split.tolerance >= SINGLE_TOLERANCE else "double"
    points = len(cloud.sources) + len(cloud.targets)
    width = 2.0 - np.log10(split.tolerance)
    spread = 0.5 * points * TRANSFORMS * SUPPORT_SECONDS * width**3
    far = spread + TRANSFORMS * MODE_SECONDS[far_kind] * modes
    near = PAIR_SECONDS[near_kind] * pairs + TARGET_SECONDS * len(cloud.targets)
    return Cost(split.rc, pairs, modes, near, far)


def near_shares(cloud: Cloud, split: Split, ranks: int) -> Array:
    """Return the ranks' shares of the near part, (rank,): those with the far part take less.

    The far part is the first two ranks', half and half. Results do not depend on shares.
    """
    if ranks < 3:
        return np.full(ranks, 1.0 / ranks)
    cost = cost_of(cloud, split)
    shares = np.full(ranks, cost.seconds / ranks)
    shares[:2] = max(0.0, cost.seconds / ranks - 0.5 * cost.far)
    return shares / shares.sum()


def largest_cutoff(cloud: Cloud) -> float:
    """Return the largest rc that is allowed: half the least period, or the size of the cloud."""
    low, high = cloud.bounds
    periodic = cloud.lattice.periodic
    if periodic.any():
        return 0.5 * float(cloud.lattice.periods[periodic].min())
    extent = float((high - low).max())
    return extent if extent > 0.0 else 1.0


def cheapest(cloud: Cloud, unit: Split) -> Cost:
    """Return the cheapest cut-off for splits like `unit`, which has rc = 1.

    Every fourth cut-off is tried from the largest down, then the three either side of the best:
    to count pairs is what costs here.
    """
    largest = largest_cutoff(cloud)
    best, at = cost_of(cloud, scaled(unit, largest)), 0
    for k in range(_COARSE, _TRIES, _COARSE):
        cost = cost_of(cloud, scaled(unit, largest / STEP**k))
        if cost.modes > MOST_MODES or cost.far > best.seconds:
            break
        if cost.seconds < best.seconds:
            best, at = cost, k
    for k in range(max(0, at - _COARSE + 1), at + _COARSE):
        cost = cost_of(cloud, scaled(unit, largest / STEP**k))
        if cost.modes <= MOST_MODES and cost.seconds < best.seconds:
            best = cost
    if best.modes > MOST_MODES:
        raise InputError("periods", f"a cell that needs fewer than {MOST_MODES:.1e} modes", largest)
    return best


def scaled(unit: Split, rc: float) -> Split:
    """Return a split like `unit` with another cut-off."""
    return Split(unit.kind, unit.tolerance, rc, unit.bandwidth / rc)


def check_cutoff(cloud: Cloud, rc: float) -> None:
    """Refuse a cut-off beyond half a period."""
    periodic = cloud.lattice.periodic
    most = 0.5 * float(cloud.lattice.periods[periodic].min()) if periodic.any() else np.inf
    if rc > most * (1.0 + 1e-12):
        raise InputError("rc", f"a cut-off up to {most:g}, half the least period", rc)
