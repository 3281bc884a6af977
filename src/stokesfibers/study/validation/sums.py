"""Sums over all images against independent ones: three, two and one periods, and Appendix C."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
from scipy.special import erfc

from stokesfibers.core.arrays import Array
from stokesfibers.core.parallel import Workers
from stokesfibers.domain import Free, Periodic
from stokesfibers.domain.domains import AbstractDomain
from stokesfibers.domain.sheared import Sheared
from stokesfibers.experiments.base import Settings
from stokesfibers.study.validation.record import Entry, Finding, close
from stokesfibers.summation.ewald import EwaldSum

_TOLERANCE = 1e-10
_CUBIC = {
    "simple": [(0.0, 0.0, 0.0)],
    "body-centred": [(0.0, 0.0, 0.0), (0.5, 0.5, 0.5)],
    "face-centred": [(0.0, 0.0, 0.0), (0.5, 0.5, 0.0), (0.5, 0.0, 0.5), (0.0, 0.5, 0.5)],
}
HASIMOTO = {"simple": 1.7601, "body-centred": 1.791, "face-centred": 1.791}
"""k of the mobility 1 - k phi^(1/3) of a dilute cubic array of spheres, phi the volume fraction."""
SIMPLE_CUBIC = 2.837297479
"""The same for the simple cubic array by the ratio of radius and period."""


def fast_sum(domain: AbstractDomain, sources: Array, forces: Array, targets: Array | None) -> Array:
    """Return 8 pi mu times the velocity at `targets`, or at the sources, by the Ewald sum."""
    plan = EwaldSum(_TOLERANCE).plan(domain, sources, targets, workers=Workers(1))
    return plan.execute(forces)


def stokeslet(r: Array) -> Array:
    """Return (I + rr / r^2) / r at r (pair, 3), (pair, 3, 3); zero at r = 0."""
    size = np.linalg.norm(r, axis=1)[:, None, None]
    inverse = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    return inverse * np.eye(3) + inverse**3 * r[:, :, None] * r[:, None, :]


def plain_sum(
    tensor: Callable[[Array], Array], targets: Array, sources: Array, forces: Array
) -> Array:
    """Return sum_j tensor(x_i - x_j) f_j, (target, 3)."""
    r = (targets[:, None] - sources[None]).reshape(-1, 3)
    pairs = tensor(r).reshape(len(targets), len(sources), 3, 3)
    return np.einsum("ijab,jb->ia", pairs, forces)


def line_of_images(r: Array, period: float) -> Array:
    """Return the sum over images along x by adding them up, for forces that add to zero.

    Images p and -p together, less what does not depend on r, fall like p^-3: the tails are
    extrapolated from seven partial sums in powers of (p + 1/2)^-2.
    """
    own, step = np.diag([2.0, 1.0, 1.0]), period * np.eye(3)[0]
    stops = np.array([24, 34, 48, 68, 96, 136, 192])
    total, partial = stokeslet(r), []
    for p in range(1, stops[-1] + 1):
        total = total + stokeslet(r + p * step) + stokeslet(r - p * step) - 2.0 * own / (p * period)
        if p in stops:
            partial.append(total)
    columns = np.stack([(stops + 0.5) ** (-2.0 * k) for k in range(len(stops))], axis=1)
    weights = np.linalg.solve(columns.T, np.eye(len(stops))[0])
    return np.tensordot(weights, np.array(partial), axes=1)


def layer_of_images(r: Array, periods: tuple[float, float]) -> Array:
    """Return the sum over images along x and y by its modes, for |z| > 0.

    Per mode q, B = -(2 pi / q^3) (1 + q |z|) exp(-q |z|) solves (d^2/dz^2 - q^2)^2 B = -8 pi delta
    and the tensor is (I laplacian - grad grad) B; the mean flow is -4 pi |z| / area in the plane.
    """
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
    return out / area


def lattice_of_images(r: Array, vectors: Array) -> Array:
    """Return the sum over the images along `vectors` (rows), by Ewald's split after Hasimoto."""
    volume = abs(float(np.linalg.det(vectors)))
    xi = np.sqrt(np.pi) / volume ** (1.0 / 3.0)
    images = np.array(list(product(range(-6, 7), repeat=3)))
    modes = images[np.any(images != 0, axis=1)]
    k = 2.0 * np.pi * modes @ np.linalg.inv(vectors).T
    k2 = np.sum(k**2, axis=1)
    damped = 8.0 * np.pi / k2 * (1.0 + 0.25 * k2 / xi**2) * np.exp(-0.25 * k2 / xi**2) / volume
    across = damped[:, None, None] * (np.eye(3) - k[:, :, None] * k[:, None, :] / k2[:, None, None])
    out = np.einsum("km,mab->kab", np.cos(r @ k.T), across)
    for image in images:
        at = r + image @ vectors
        size = np.linalg.norm(at, axis=1)
        rest = erfc(xi * size) / size
        steep = 2.0 * xi / np.sqrt(np.pi) * np.exp(-((xi * size) ** 2))
        out += (rest - steep)[:, None, None] * np.eye(3)
        out += ((rest + steep) / size**2)[:, None, None] * at[:, :, None] * at[:, None, :]
    return out


def _lattices(_: Settings) -> Iterator[Finding]:
    for name, places in _CUBIC.items():
        points = np.array(places) + 0.1
        forces = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        velocity = fast_sum(Periodic((1.0, 1.0, 1.0)), points, forces, None)[0, 2]
        # U = F / (6 pi mu a) (1 - k a / d), of which the sum over images is the second part
        k = -0.75 * float(velocity)
        if name == "simple":
            yield close(
                "drag of a simple cubic array, k of 1 - k a / d", k, SIMPLE_CUBIC, atol=2e-9
            )
        by_fraction = k / (4.0 / 3.0 * np.pi * len(points)) ** (1.0 / 3.0)
        quantity = f"the same by volume fraction, {name} cubic"
        yield close(quantity, by_fraction, HASIMOTO[name], atol=1e-3)


def _cloud(count: int) -> tuple[Array, Array, Array]:
    """Return sources, forces that add to zero, and targets above all sources in z."""
    random = np.random.default_rng(3)
    sources, targets = random.random((count, 3)), random.random((12, 3))
    forces = random.standard_normal((count, 3))
    targets[:, 2] += 1.2
    return sources, forces - forces.mean(axis=0), targets


def _off(ours: Array, theirs: Array) -> float:
    """Return the relative rms error of differences, since constants are conventions."""
    ours, theirs = ours - ours.mean(axis=0), theirs - theirs.mean(axis=0)
    return float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs))


def _images(_: Settings) -> Iterator[Finding]:
    x, f, at = _cloud(40)
    off = _off(fast_sum(Free(), x, f, at), plain_sum(stokeslet, at, x, f))
    yield close("relative rms error, free space, against the plain sum", off, 0.0, atol=_TOLERANCE)
    line = plain_sum(lambda r: line_of_images(r, 1.0), at, x, f)
    off = _off(fast_sum(Periodic((1.0, 0.0, 0.0)), x, f, at), line)
    yield close("one period, against images added up", off, 0.0, atol=_TOLERANCE)
    layer = plain_sum(lambda r: layer_of_images(r, (1.0, 1.1)), at, x, f)
    off = _off(fast_sum(Periodic((1.0, 1.1, 0.0)), x, f, at), layer)
    yield close("two periods, against modes in the plane", off, 0.0, atol=5.0 * _TOLERANCE)
    box = np.diag([1.0, 1.2, 0.9])
    for name, strain in (("three periods", 0.0), ("a sheared cell at strain 0.37", 0.37)):
        box[1, 0] = strain * box[1, 1]
        cell = plain_sum(lambda r: lattice_of_images(r, box), at, x, f)
        off = _off(fast_sum(Sheared((1.0, 1.2, 0.9), strain), x, f, at), cell)
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
