"""The exact straight filament in steady shear: (44), (45) and its stress by (48), closed form.

In U_0 = (y, 0, 0) a straight filament has cot(theta) = t - t_v, vertical at t_v. Its tension
is A s (1 - s) with A = -mu_bar sin(2 theta) / (8 (c + 2)): negative under compression. Its stress
is the integral of T over s, A / 6, times x_s x_s.
"""

from __future__ import annotations

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.slender.mobility import slenderness_constant


def angle(time: Array, vertical: float) -> Array:
    """Return theta in (0, pi) of (45) at `time` for a filament that is vertical at `vertical`."""
    return np.arctan2(1.0, np.asarray(time, dtype=float) - vertical)


def tension_amplitude(theta: Array, mu_bar: float, eps: float) -> Array:
    """Return A of T = A s (1 - s), (44), at unit shear rate; T(1/2) = A / 4."""
    return -mu_bar * np.sin(2.0 * theta) / (8.0 * (slenderness_constant(eps) + 2.0))


def normal_stress_difference(theta: Array, mu_bar: float, eps: float) -> Array:
    """Return N_1 = Sigma_11 - Sigma_22 of (48)."""
    return tension_amplitude(theta, mu_bar, eps) * np.cos(2.0 * theta) / 6.0


def shear_stress(theta: Array, mu_bar: float, eps: float) -> Array:
    """Return Sigma_12 of (48), never negative in positive shear."""
    return tension_amplitude(theta, mu_bar, eps) * np.sin(2.0 * theta) / 12.0


def centreline(theta: float, count: int = 2) -> Array:
    """Return `count` points along the filament (44) of unit length centred at 0, (count, 2)."""
    along = 0.5 - np.linspace(0.0, 1.0, count)
    return along[:, None] * np.array([np.cos(theta), np.sin(theta)])
