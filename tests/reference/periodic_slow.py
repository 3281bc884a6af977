"""Slow, obvious sums of Stokeslets with no to three periodic directions.

Nothing here is shared with the package, and only the triply periodic sum is split after Ewald: one
direction is a plain sum of images whose tail is extrapolated, two are lines of such sums, or the
closed-form modes of two directions. Velocities are times 8 pi mu: ``S(r) = (I + rr/r^2)/r``, and
zero at r = 0: a point feels its images, not itself. Tensors have shape (pair, 3, 3).
"""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.special import erfc, spherical_jn


def stokeslet(r: np.ndarray) -> np.ndarray:
    """Return S at r (pair, 3); zero where r = 0."""
    size = np.linalg.norm(r, axis=1)[:, None, None]
    inverse = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    return inverse * np.eye(3) + inverse**3 * r[:, :, None] * r[:, None, :]


def mollified(multiplier, k_max: float, r: np.ndarray) -> np.ndarray:
    """Return the transform of ``multiplier(k) 8 pi / k^2 (I - kk)``, |k| < k_max, at r (pair, 3).

    The mean of ``(I - kk) exp(i k.r)`` over directions is ``(j0 - j1/x) I + j2 rr``, x = k r.
    """
    size = np.maximum(np.linalg.norm(r, axis=1), 1e-12)
    z, w = np.polynomial.legendre.leggauss(int(0.5 * k_max * size.max()) + 80)
    k = 0.5 * k_max * (1.0 + z)
    weight = 2.0 * k_max / np.pi * w * multiplier(k)
    x = np.outer(size, k)
    across = (spherical_jn(0, x) - spherical_jn(1, x) / x) @ weight
    along = spherical_jn(2, x) @ weight
    unit = r / size[:, None]
    dyad = unit[:, :, None] * unit[:, None, :]
    return across[:, None, None] * np.eye(3) + along[:, None, None] * dyad


def near_images(split, r: np.ndarray, periods: tuple[float, float, float]) -> np.ndarray:
    """Return the sum of S - S_far over images nearer than rc; periods are inf where free."""
    out = np.zeros((len(r), 3, 3))
    finite = np.isfinite(periods)
    steps = np.where(finite, periods, 0.0)
    ranges = []
    for axis in range(3):
        most = int((np.abs(r[:, axis]).max() + split.rc) / periods[axis]) + 1 if finite[axis] else 0
        ranges.append(range(-most, most + 1))
    for image in product(*ranges):
        place = r + np.array(image) * steps
        near = np.linalg.norm(place, axis=1) < split.rc
        if near.any():
            far = mollified(split.multiplier, split.k_max, place[near])
            out[near] += stokeslet(place[near]) - far
    return out


def free_sum(targets: np.ndarray, sources: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Return the direct sum, (target, 3); a point does not act on itself."""
    return total(stokeslet, targets, sources, forces)


def total(tensor, targets: np.ndarray, sources: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Return sum_j tensor(x_i - x_j) f_j, (target, 3)."""
    r = (targets[:, None] - sources[None]).reshape(-1, 3)
    pairs = tensor(r).reshape(len(targets), len(sources), 3, 3)
    return np.einsum("ijab,jb->ia", pairs, forces)


def extrapolated(partials: np.ndarray, at: np.ndarray, powers: range) -> np.ndarray:
    """Return the limit of partial sums (sum, ...) whose error is a series in 1 / at.

    As many powers as there are sums less one are taken out.
    """
    columns = [np.ones(len(at))] + [at ** (-float(p)) for p in powers[: len(at) - 1]]
    weights = np.linalg.solve(np.stack(columns, axis=1).T, np.eye(len(at))[0])
    return np.tensordot(weights, partials, axes=1)


def one_periodic(r: np.ndarray, period: float, axis: int) -> np.ndarray:
    """Return sum_p S(r + p d a), less (I + aa)/|p d| for each p != 0.

    Images p and -p together fall like p^-3, p^-5, ...: the sum up to n errs by a series in
    (n + 1/2)^-2. Good to 1e-12 within eight periods of the origin.
    """
    step = period * np.eye(3)[axis]
    own = np.eye(3) + np.outer(np.eye(3)[axis], np.eye(3)[axis])
    stops = np.array([24, 34, 48, 68, 96, 136, 192])
    sum_ = stokeslet(r)
    partials = []
    for p in range(1, stops[-1] + 1):
        sum_ = sum_ + stokeslet(r + p * step) + stokeslet(r - p * step) - 2.0 * own / (p * period)
        if p in stops:
            partials.append(sum_)
    return extrapolated(np.array(partials), stops + 0.5, range(2, 20, 2))


def _line(r: np.ndarray, period: float, axis: int) -> np.ndarray:
    """Return `one_periodic` far from the line, up to a constant: two-dimensional Stokeslets."""
    across = r.copy()
    across[:, axis] = 0.0
    rho2 = np.sum(across**2, axis=1)[:, None, None]
    along = np.outer(np.eye(3)[axis], np.eye(3)[axis])
    dyad = 2.0 * across[:, :, None] * across[:, None, :] / rho2
    return (dyad - (np.eye(3) + along) * np.log(rho2)) / period


def two_periodic(r: np.ndarray, periods: tuple[float, float], axes: tuple[int, int]) -> np.ndarray:
    """Return the sum over images of two directions, up to a constant: for forces that sum to zero.

    Lines of images along the shorter period; far ones are two-dimensional Stokeslets, to
    exp(-2 pi 6). Lines m and -m together, less a constant, fall like m^-2, m^-4, ...
    """
    (d, e), (a, b) = sorted(periods), np.array(axes)[np.argsort(periods)]
    step = e * np.eye(3)[b]
    near = max(1, int(7.0 * d / e))
    stops = near + np.array([6, 9, 13, 19, 27, 39, 56, 80])
    away = 6.0 * d * np.eye(3)[b : b + 1]
    constant = one_periodic(away, d, a) - _line(away, d, a)
    lines = one_periodic(r, d, a) - constant
    partials = []
    for m in range(1, stops[-1] + 1):
        for shift in (m * step, -m * step):
            place = r + shift
            line = one_periodic(place, d, a) - constant if m <= near else _line(place, d, a)
            lines = lines + line - _line(shift[None], d, a)
        if m in stops:
            partials.append(lines)
    return extrapolated(np.array(partials), stops + 0.5, range(1, 30, 2))


def two_periodic_modes(r: np.ndarray, periods: tuple[float, float]) -> np.ndarray:
    """Return the sum over images along x and y by its modes, for |z| > 0; with a net force too.

    Per mode q, ``B = -(2 pi / q^3) (1 + q |z|) exp(-q |z|)`` solves
    ``(d2/dz2 - q^2)^2 B = -8 pi delta``, and ``S = (I laplacian - grad grad) B``; for q = 0 the
    velocity along the planes is ``-4 pi |z| / A``, symmetric about them.
    """
    area = periods[0] * periods[1]
    z, s = np.abs(r[:, 2]), np.sign(r[:, 2])
    out = np.zeros((len(r), 3, 3))
    out[:, 0, 0] = out[:, 1, 1] = -4.0 * np.pi * z / area
    most = [int(np.ceil(40.0 * d / (2.0 * np.pi * z.min()))) for d in periods]
    for m, n in product(range(-most[0], most[0] + 1), range(-most[1], most[1] + 1)):
        if m == 0 and n == 0:
            continue
        k = 2.0 * np.pi * np.array([m / periods[0], n / periods[1], 0.0])
        q = np.linalg.norm(k)
        front = -(2.0 * np.pi / q**3) * np.exp(-q * z)
        b, first, second = front * (1.0 + q * z), -front * q**2 * z * s, front * q**2 * (q * z - 1)
        wave = k[0] * r[:, 0] + k[1] * r[:, 1]
        tensor = (second - q**2 * b)[:, None, None] * np.eye(3) + b[:, None, None] * np.outer(k, k)
        tensor[:, 2, 2] -= second
        tensor *= np.cos(wave)[:, None, None]
        mixed = first[:, None] * k[:2] * np.sin(wave)[:, None]
        tensor[:, 2, :2] += mixed
        tensor[:, :2, 2] += mixed
        out += tensor / area
    return out


def three_periodic(r: np.ndarray, periods: tuple[float, float, float]) -> np.ndarray:
    """Return the sum over images of three directions with zero mean flow (Hasimoto).

    At r = 0 without the image that is there.
    """
    xi = np.sqrt(np.pi) / np.prod(periods) ** (1.0 / 3.0)
    reach, k_max = 6.2 / xi, 12.4 * xi
    out = np.zeros((len(r), 3, 3))
    shells = [int(np.ceil(reach / d)) + 1 for d in periods]
    for image in product(*(range(-n, n + 1) for n in shells)):
        place = r + np.array(image) * periods
        size = np.linalg.norm(place, axis=1)
        away = size > 0.0
        out[~away] -= 4.0 * xi / np.sqrt(np.pi) * np.eye(3)
        place, size = place[away], size[away][:, None, None]
        dyad = place[:, :, None] * place[:, None, :] / size**2
        outer = erfc(xi * size) / size
        gaussian = 2.0 * xi / np.sqrt(np.pi) * np.exp(-((xi * size) ** 2))
        out[away] += outer * (np.eye(3) + dyad) - gaussian * (np.eye(3) - dyad)
    waves = [int(np.ceil(k_max * d / (2.0 * np.pi))) for d in periods]
    for mode in product(*(range(-n, n + 1) for n in waves)):
        if mode == (0, 0, 0):
            continue
        k = 2.0 * np.pi * np.array(mode) / periods
        k2 = k @ k
        y = k2 / (4.0 * xi**2)
        weight = 8.0 * np.pi / k2 * (1.0 + y) * np.exp(-y) / np.prod(periods)
        out += weight * np.cos(r @ k)[:, None, None] * (np.eye(3) - np.outer(k, k) / k2)
    return out
