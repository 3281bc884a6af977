"""What a split leaves out, and the splits that leave out no more than a tolerance.

For independent forces of one size at random places of density rho, the error's variance is rho
times an integral over the square of the kernel left out. The velocity's own is 4.47 rho L in a
periodic cube of side L (``(128 pi^2 / 3) / (2 pi)^4`` times the lattice sum of ``|m|^-4``, 16.53)
and larger in free space. So the relative error of the sum is

    error = E(c) sqrt(rc / L),

E depending on the mollifier and its band-width ``c = K rc`` alone. Splits are made for `REFERENCE`,
the largest rc / L there is, and may leave out `SHARE` of the tolerance there.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.special import erfc

from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.summation.ewald.prolate import prolate_series, prolate_values

LEAST_TOLERANCE = 1e-12
"""Below it the NUFFT and the polynomials are at their rounding."""
LARGEST_TOLERANCE = 0.1
SHARE = 0.4
"""Of the tolerance, what the split may leave out where rc is half the period."""
REFERENCE = 0.5
"""rc / L the split is made for."""
_VELOCITY = 4.47  # variance of the velocity per component, over rho L
STEP = 0.5
"""Band-widths are interpolated between multiples of this."""
_NODES = 120
_SAMPLES = 800
_REACH = 60.0  # in units of 1 / rc, how much of the spectrum's tail is counted


def check_tolerance(tolerance: float) -> None:
    """Refuse what cannot be reached.

    Raises
    ------
    InputError
        If the tolerance is outside [`LEAST_TOLERANCE`, `LARGEST_TOLERANCE`].
    """
    if not LEAST_TOLERANCE <= tolerance <= LARGEST_TOLERANCE:
        raise InputError(
            "tolerance",
            f"a relative error from {LEAST_TOLERANCE:g} to {LARGEST_TOLERANCE:g}",
            tolerance,
            f"In double precision {LEAST_TOLERANCE:g} is the least that is reachable.",
        )


def _spectrum_left_out(k: Array, gamma: Array) -> float:
    """Return E of the far multiplier `gamma` left out at wavenumbers k, in units of 1 / rc."""
    power = 4.0 * np.pi * k**2 * (8.0 * np.pi * gamma / k**2) ** 2 * (2.0 / 3.0)
    return float(np.sqrt(np.trapezoid(power, k) / (2.0 * np.pi) ** 3 / _VELOCITY))


def prolate_error(bandwidth: float) -> float:
    """Return E(c) of the prolate mollifier: near part exact within rc, far part cut at K."""
    series = prolate_series(bandwidth)
    z, w = np.polynomial.legendre.leggauss(_NODES)
    r, w = 0.5 * (z + 1.0), 0.5 * w
    slope = prolate_values(series, r)
    slope = w * slope / (w @ slope)
    k = np.linspace(bandwidth, bandwidth + _REACH, _SAMPLES)
    phase = np.outer(k, r)
    gamma = np.cos(phase) @ slope + 0.5 * k * (np.sin(phase) @ (slope * r))
    return _spectrum_left_out(k, gamma)


def gaussian_error(bandwidth: float) -> float:
    """Return E(c) of Hasimoto's mollifier: near part cut at rc, far part at K, alike."""
    xi = np.sqrt(0.5 * bandwidth)
    k = np.linspace(bandwidth, 3.0 * bandwidth, _SAMPLES)
    x2 = (0.5 * k / xi) ** 2
    far = _spectrum_left_out(k, np.exp(-x2) * (1.0 + x2))
    r = np.linspace(1.0, 3.0, _SAMPLES)
    slope = 2.0 * xi / np.sqrt(np.pi) * r * np.exp(-((xi * r) ** 2))
    across, along = (erfc(xi * r) - slope) / r, 2.0 * erfc(xi * r) / r
    power = 4.0 * np.pi * r**2 * (2.0 * across**2 + along**2) / 3.0
    return float(np.hypot(far, np.sqrt(np.trapezoid(power, r) / _VELOCITY)))


_ERRORS = {"prolate": prolate_error, "gaussian": gaussian_error}
_WIDEST = {"prolate": 80, "gaussian": 140}  # in steps
_NARROWEST = 5


@lru_cache(maxsize=256)
def _log_error(kind: str, step: int) -> float:
    return float(np.log(_ERRORS[kind](step * STEP)))


@lru_cache(maxsize=256)
def bandwidth_for(kind: str, tolerance: float) -> float:
    """Return the least c = K rc with ``E(c) sqrt(REFERENCE) <= SHARE tolerance``.

    log E is all but a straight line: it is interpolated.

    Raises
    ------
    InputError
        If `kind` is not a split or the tolerance cannot be reached.
    """
    if kind not in _ERRORS:
        raise InputError("split", " or ".join(map(repr, _ERRORS)), repr(kind))
    check_tolerance(tolerance)
    goal = np.log(SHARE * tolerance / np.sqrt(REFERENCE))
    low, high = _NARROWEST, _WIDEST[kind]
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if _log_error(kind, middle) <= goal else (middle, high)
    above, below = _log_error(kind, low), _log_error(kind, high)
    part = min(1.0, max(0.0, (above - goal) / (above - below)))
    return STEP * (low + part)


def self_error(kind: str, bandwidth: float) -> float:
    """Return how far each point's own far part is off, in units of 1 / rc.

    That is ``2 Phi'(0) - (8 / 3 pi) int_0^K gamma dk``, of which pairs feel nothing.
    """
    z, w = np.polynomial.legendre.leggauss(_NODES)
    x, w = 0.5 * (z + 1.0), 0.5 * w
    if kind == "gaussian":
        xi = np.sqrt(0.5 * bandwidth)
        x2 = (0.5 * bandwidth * x / xi) ** 2
        slope, gamma = 2.0 * xi / np.sqrt(np.pi), np.exp(-x2) * (1.0 + x2)
    else:
        series = prolate_series(bandwidth)
        values = prolate_values(series, x)
        slope, gamma = 1.0 / (w @ values), values - 0.5 * x * prolate_values(series, x, 1)
    return float(abs(2.0 * slope - 8.0 / (3.0 * np.pi) * bandwidth * (w @ gamma)))


def estimated_error(kind: str, bandwidth: float, share: float, density: float = np.inf) -> float:
    """Return the relative rms error a split leaves.

    Parameters
    ----------
    kind, bandwidth
        Of the split.
    share
        rc / L.
    density
        Points per rc^3: where there are few, what each does to itself weighs more.
    """
    own = self_error(kind, bandwidth) ** 2 / (_VELOCITY * density)
    return float(np.sqrt(share * (_ERRORS[kind](bandwidth) ** 2 + own)))
