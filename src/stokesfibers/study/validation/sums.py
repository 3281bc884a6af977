"""Sums over all images against independent ones: three, two and one periods, and Appendix C."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.domains import AbstractDomain
from stokesfibers.domain.sheared import Sheared
from stokesfibers.experiments import slow_sums as slow
from stokesfibers.experiments.base import Settings
from stokesfibers.experiments.ewald_tables import LATTICES
from stokesfibers.experiments.ewald_tables_rows import HASIMOTO, PRINTED
from stokesfibers.experiments.slow_sums import Pairs
from stokesfibers.study.validation.record import Entry, Finding, close
from stokesfibers.summation.ewald import EwaldSum

_TOLERANCE = 1e-10


def fast_sum(domain: AbstractDomain, pairs: Pairs) -> Array:
    """Return 8 pi mu times the velocity at the targets, by the Ewald sum."""
    plan = EwaldSum(_TOLERANCE).plan(domain, pairs.sources, pairs.targets, workers=Workers(1))
    return plan.execute(pairs.forces)


def layer_by_modes(pairs: Pairs, periods: tuple[float, float]) -> Array:
    """Return the sum over images along x and y by its modes, (m, 3), targets above all sources.

    Per mode q, B = -(2 pi / q^3) (1 + q |z|) exp(-q |z|) solves (d^2/dz^2 - q^2)^2 B = -8 pi delta
    and the tensor is (I laplacian - grad grad) B; the mean flow is -4 pi |z| / area in the plane.
    """
    r = pairs.apart.reshape(-1, 3)
    area, z, sign = periods[0] * periods[1], np.abs(r[:, 2]), np.sign(r[:, 2])
    out = np.zeros((len(r), 3, 3))
    out[:, 0, 0] = out[:, 1, 1] = -4.0 * np.pi * z
    most = [int(np.ceil(40.0 * d / (2.0 * np.pi * z.min()))) for d in periods]
    for m, n in product(range(-most[0], most[0] + 1), range(-most[1], most[1] + 1)):
        if m == 0 and n == 0:
            continue
        k = 2.0 * np.pi * np.array([m / periods[0], n / periods[1], 0.0])
        q = float(np.linalg.norm(k))
        front = -(2.0 * np.pi / q**3) * np.exp(-q * z)
        b = front * (1.0 + q * z)
        first, second = -front * q**2 * z * sign, front * q**2 * (q * z - 1.0)
        phase = r @ k
        tensor = (second - q**2 * b)[:, None, None] * np.eye(3) + b[:, None, None] * np.outer(k, k)
        tensor[:, 2, 2] -= second
        tensor *= np.cos(phase)[:, None, None]
        mixed = (first * np.sin(phase))[:, None] * k[:2]
        tensor[:, :2, 2] += mixed
        tensor[:, 2, :2] += mixed
        out += tensor
    tensors = (out / area).reshape(len(pairs.targets), len(pairs.sources), 3, 3)
    return np.einsum("mnij,nj->mi", tensors, pairs.forces)


def _lattices(_: Settings) -> Iterator[Finding]:
    for name, places in LATTICES.items():
        points = np.array(places) + 0.1
        forces = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        velocity = fast_sum(Periodic((1.0, 1.0, 1.0)), Pairs(points, points, forces))[0, 2]
        # U = F / (6 pi mu a) (1 - k a / d), of which the sum over images is the second part
        k = -0.75 * float(velocity)
        if len(points) == 1:
            yield close("drag of a simple cubic array, k of 1 - k a / d", k, HASIMOTO, atol=2e-9)
        by_fraction = k / (4.0 / 3.0 * np.pi * len(points)) ** (1.0 / 3.0)
        quantity = f"the same by volume fraction, {name.removesuffix(' cubic')} cubic"
        yield close(quantity, by_fraction, PRINTED[name], atol=1e-3)


def _cloud(count: int) -> Pairs:
    """Return sources, forces that add to zero, and targets above all sources in z."""
    random = np.random.default_rng(3)
    sources, targets = random.random((count, 3)), random.random((12, 3))
    forces = random.standard_normal((count, 3))
    targets[:, 2] += 1.2
    return Pairs(targets, sources, forces - forces.mean(axis=0))


def _off(ours: Array, theirs: Array) -> float:
    """Return the relative rms error of differences, since constants are conventions."""
    ours, theirs = ours - ours.mean(axis=0), theirs - theirs.mean(axis=0)
    return float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs))


def _images(_: Settings) -> Iterator[Finding]:
    pairs = _cloud(40)
    off = _off(fast_sum(Free(), pairs), slow.free(pairs))
    yield close("relative rms error, free space, against the plain sum", off, 0.0, atol=_TOLERANCE)
    line = slow.one_direction(pairs, 1.0, 0)
    off = _off(fast_sum(Periodic((1.0, 0.0, 0.0)), pairs), line)
    yield close("one period, against images added up", off, 0.0, atol=_TOLERANCE)
    layer = layer_by_modes(pairs, (1.0, 1.1))
    off = _off(fast_sum(Periodic((1.0, 1.1, 0.0)), pairs), layer)
    yield close("two periods, against modes in the plane", off, 0.0, atol=5.0 * _TOLERANCE)
    box = np.diag([1.0, 1.2, 0.9])
    for name, strain in (("three periods", 0.0), ("a sheared cell at strain 0.37", 0.37)):
        box[1, 0] = strain * box[1, 1]
        off = _off(fast_sum(Sheared((1.0, 1.2, 0.9), strain), pairs), slow.lattice(pairs, box))
        yield close(f"{name}, against Gaussian splitting", off, 0.0, atol=5.0 * _TOLERANCE)


ENTRIES = (
    Entry("cubic-arrays", "exact", "Drag of dilute cubic arrays", "Hasimoto 1959", _lattices),
    Entry(
        "periodic-sums",
        "independent",
        "Sums over all images",
        "plain sums, extrapolated; modes",
        _images,
    ),
)
